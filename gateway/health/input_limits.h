#pragma once

#include "gateway/health/health_config.h"
#include "gateway/health/health_counters.h"
#include "gateway/health/health_input.h"

namespace airworthy::health {

/// Keeps the differences of any two times representable.
[[nodiscard]] TimePoint clamp_time(TimePoint t);

/// Makes a message harmless: cleans its texts, cuts its lists, clamps its times, turns impossible numbers
/// into NaN.
void bound_input(Input& input, const HealthLimits& limits, HealthCounters& counters);

}  // namespace airworthy::health
