#pragma once

#include <cstddef>
#include <string>

#include "gateway/health/health_config.h"
#include "gateway/health/health_counters.h"
#include "gateway/health/health_input.h"

namespace airworthy::health {

/// Printable, valid UTF-8 of at most `max_bytes`: control characters become spaces, broken bytes '?'.
[[nodiscard]] std::string clean_text(const std::string& text, std::size_t max_bytes);

/// Keeps the differences of any two times representable.
[[nodiscard]] TimePoint clamp_time(TimePoint t);

/// Makes a message harmless: cleans its texts, cuts its lists, clamps its times, turns impossible numbers
/// into NaN.
void bound_input(Input& input, const HealthLimits& limits, HealthCounters& counters);

}  // namespace airworthy::health
