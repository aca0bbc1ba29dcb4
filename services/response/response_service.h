#pragma once

#include <functional>
#include <optional>

#include "airworthy/attitude_setpoint_t.hpp"
#include "airworthy/attitude_t.hpp"
#include "airworthy/esc_status_t.hpp"
#include "airworthy/flight_state_t.hpp"
#include "airworthy/imu_t.hpp"
#include "airworthy/rotor_command_t.hpp"
#include "core/detectors/response/response_monitor.h"
#include "runtime/detector/fault_reporter.h"
#include "runtime/phase/flight_phase_input.h"
#include "runtime/process/node.h"
#include "services/response/response_config.h"

namespace airworthy::response {

/// Moves messages between the bus and the response monitor. No arithmetic of its own.
class ResponseService {
 public:
  ResponseService(rt::Node& node, const ResponseConfig& config);

  /// Shows the monitor after each of its ticks, to learn from a recorded flight.
  void observe_ticks(std::function<void(const ResponseMonitor&)> observer) {
    observer_ = std::move(observer);
  }

  ResponseService(const ResponseService&) = delete;
  ResponseService& operator=(const ResponseService&) = delete;

 private:
  void on_imu(const imu_t& message);
  void on_attitude(const attitude_t& message);
  void on_setpoint(const attitude_setpoint_t& message);
  void on_rotor_command(const rotor_command_t& message);
  void on_flight_state(const flight_state_t& message);
  void handle_tick();
  void handle_verdict(std::size_t channel, const ChannelVerdict& verdict);
  /// Empty while the component is judged.
  [[nodiscard]] std::string reason_of(NotJudged reason) const;
  [[nodiscard]] rt::DetectorReport report() const;

  rt::Node& node_;
  const ResponseConfig& config_;
  std::optional<rt::FlightPhaseInput> phase_;  ///< of a multirotor
  ResponseMonitor monitor_;
  rt::FaultReporter reporter_;
  std::function<void(const ResponseMonitor&)> observer_;
};

}  // namespace airworthy::response
