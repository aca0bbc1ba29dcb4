#pragma once

#include <optional>

#include "airworthy/actuator_state_t.hpp"
#include "airworthy/attitude_t.hpp"
#include "airworthy/esc_status_t.hpp"
#include "airworthy/flight_state_t.hpp"
#include "airworthy/imu_t.hpp"
#include "airworthy/rotor_command_t.hpp"
#include "core/detectors/actuator/actuator_monitor.h"
#include "runtime/detector/fault_reporter.h"
#include "runtime/phase/flight_phase_input.h"
#include "runtime/process/node.h"
#include "services/actuator/actuator_config.h"

namespace airworthy::actuator {

/// Moves messages between the bus and the actuator monitor. Faults are reported in the callback of the inertial sample that
/// decided.
class ActuatorService {
 public:
  ActuatorService(rt::Node& node, const ActuatorConfig& config);
  ActuatorService(const ActuatorService&) = delete;
  ActuatorService& operator=(const ActuatorService&) = delete;

 private:
  void on_imu(const imu_t& message);
  void on_esc_status(const esc_status_t& message);
  void report_rotor(std::size_t rotor, const LossVerdict& verdict);
  void report_axis(std::size_t axis, const LossVerdict& verdict);
  void publish_state();
  [[nodiscard]] rt::DetectorReport report() const;

  rt::Node& node_;
  const ActuatorConfig& config_;
  rt::FlightPhaseInput
      phase_;  ///< subscribes before this does: a sample's phase is known when the sample is judged
  ActuatorMonitor monitor_;
  rt::FaultReporter reporter_;
  rt::Publisher<actuator_state_t> states_;
  std::optional<TimePoint> state_published_;
};

}  // namespace airworthy::actuator
