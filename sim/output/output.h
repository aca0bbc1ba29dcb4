#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/vehicle/multirotor.h"
#include "sim/flight/controller.h"
#include "sim/sensors/esc_telemetry_model.h"
#include "sim/sensors/imu_model.h"

namespace airworthy::sim {

/// What the autopilot reports of its attitude, wishes and outputs.
struct AutopilotSample {
  double time_s = 0.0;
  Estimate estimate;
  ControlOutput control;
  Eigen::Vector3d wind_N_m_s = Eigen::Vector3d::Zero();
};

/// What really happens, for evaluation.
struct Truth {
  std::string component;  ///< empty = whole flight healthy
  std::string fault_kind = "none";
  double onset_s = -1.0;
  double magnitude = 0.0;  ///< NaN = none
};

/// Receives what the simulated devices send; times never go back. Rotors are numbered as in the vehicle file.
class Output {
 public:
  Output() = default;
  virtual ~Output() = default;

  virtual void on_truth(const Truth& truth) = 0;
  virtual void on_imu(const ImuSample& sample) = 0;
  virtual void on_esc(const EscSample& sample) = 0;
  virtual void on_attitude(const AutopilotSample& sample) = 0;
  virtual void on_commands(const AutopilotSample& sample) = 0;
  virtual void on_flight_state(const AutopilotSample& sample, LandedState landed_state) = 0;

 protected:
  Output(const Output&) = default;
  Output& operator=(const Output&) = default;
};

}  // namespace airworthy::sim
