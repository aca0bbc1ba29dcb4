#pragma once

#include <functional>
#include <memory>
#include <string>

#include "cli/eval/flight.h"
#include "runtime/error.h"
#include "runtime/process/node.h"
#include "services/response/response_config.h"

namespace airworthy::eval {

/// A detector's service, alive while a flight plays.
using Detector = std::shared_ptr<void>;
/// Puts a detector on a node of the flight's vehicle.
using MakeDetector = std::function<Detector(rt::Node& node)>;

/// Runs a detector over one log, on message time, in this process, and collects its alarms and, from its
/// DETECTOR_STATUS, when it judged. `process` is the name under which the detector speaks. Only channels with role `input` reach the detector; GROUND_TRUTH goes to the
/// scoring alone. Safe to call from several threads.
[[nodiscard]] rt::Expected<Flight> run_flight(const std::string& log_path, const std::string& process,
                                              const MakeDetector& make);

/// An error where a log is not of the vehicle that it is to be of.
[[nodiscard]] rt::Expected<void> check_vehicle(const std::string& log, const std::string& vehicle,
                                               const std::string& expected);

/// Sees the response detector after each of its ticks.
using TickObserver = std::function<void(const response::ResponseMonitor&)>;

/// The same with the response detector.
[[nodiscard]] rt::Expected<Flight> run_flight(const std::string& log_path, response::ResponseConfig config,
                                              TickObserver observer = {});

}  // namespace airworthy::eval
