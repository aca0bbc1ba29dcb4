#pragma once

#include <vector>

#include "cli/doctor/finding.h"
#include "cli/doctor/probes.h"

namespace airworthy::doctor {

/// Judges what was observed: one finding for each check, always in the same order. The cures, run in this
/// order, work.
[[nodiscard]] std::vector<Finding> judge(const Probes& probes);

}  // namespace airworthy::doctor
