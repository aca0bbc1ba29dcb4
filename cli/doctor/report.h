#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "cli/doctor/finding.h"

namespace airworthy::doctor {

[[nodiscard]] std::string_view name(Level level);

/// For people: a line for each check, with why and the cure below it where something is amiss, and a summary.
[[nodiscard]] std::string to_text(const std::vector<Finding>& findings);

/// For programs: {"schema": 1, "failures": N, "findings": [{"id", "level", "found", "why", "cure",
/// "permanent"}]}.
[[nodiscard]] std::string to_json(const std::vector<Finding>& findings);

[[nodiscard]] bool has_failure(const std::vector<Finding>& findings);

}  // namespace airworthy::doctor
