#pragma once

#include <string>

#include "cli/eval/scoring.h"
#include "runtime/error.h"
#include "services/response/response_config.h"

namespace airworthy::eval {

/// Runs the response detector over one log, on message time, in this process, and collects its alarms. Only
/// channels with role `input` reach the detector; GROUND_TRUTH goes to the scoring alone. Safe to call from
/// several threads.
[[nodiscard]] rt::Expected<Flight> run_flight(const std::string& log_path, response::ResponseConfig config);

}  // namespace airworthy::eval
