#pragma once

#include <functional>
#include <string>

#include "cli/eval/scoring.h"
#include "runtime/error.h"
#include "services/response/response_config.h"

namespace airworthy::eval {

/// Sees the detector after each of its ticks.
using TickObserver = std::function<void(const response::ResponseMonitor&)>;

/// Runs the response detector over one log, on message time, in this process, and collects its alarms. Only
/// channels with role `input` reach the detector; GROUND_TRUTH goes to the scoring alone. Safe to call from
/// several threads.
[[nodiscard]] rt::Expected<Flight> run_flight(const std::string& log_path, response::ResponseConfig config,
                                              TickObserver observer = {});

}  // namespace airworthy::eval
