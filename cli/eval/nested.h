#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/calibrate/flight_name.h"
#include "cli/calibrate/learning.h"
#include "cli/eval/flight.h"

namespace airworthy::eval {

/// Runs every log with a calibration that all the others taught: priors and thresholds are learned anew for each
/// flight, from the logs that are not a part of it and whose truth is known. Logs of another vehicle are refused and
/// teach nothing. One result per log, in order.
[[nodiscard]] std::vector<rt::Expected<Flight>> run_nested(const std::vector<std::string>& logs,
                                                           const std::string& vehicle,
                                                           const response::ResponseConfig& config,
                                                           const calibrate::FlightName& flight_name,
                                                           const calibrate::LearningParams& learning);

}  // namespace airworthy::eval
