#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstddef>

#include "core/vehicle/multirotor.h"
#include "sim/flight/flight_plan.h"

namespace airworthy::sim {

/// What the autopilot believes.
struct Estimate {
  Eigen::Vector3d position_N_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_N_m_s = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_NB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d gyro_rad_s = Eigen::Vector3d::Zero();
  bool has_contact = false;
};

enum class LandedState { kOnGround = 1, kInAir = 2, kTakingOff = 3, kLanding = 4 };

/// What the autopilot wants, layer by layer.
struct ControlOutput {
  bool is_armed = false;
  LandedState landed_state = LandedState::kOnGround;
  std::array<double, kMaxRotors> command_ratio{};
  Eigen::Quaterniond setpoint_q_NB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d setpoint_rates_rad_s = Eigen::Vector3d::Zero();
  double thrust_ratio = 0.0;  ///< collective over full thrust
};

/// Cascaded position, velocity, attitude and rate control for any rotor count and geometry, as usual on
/// autopilots: proportional position and attitude loops, proportional-integral velocity and rate loops, the
/// pseudo-inverse of the effectiveness matrix as mixer, yaw given up first in saturation. It knows the nominal
/// vehicle only. Gains follow from the motor lag.
class Controller {
 public:
  static constexpr double kRate_Hz = 500.0;

  explicit Controller(const Multirotor& nominal);

  [[nodiscard]] ControlOutput step(const Estimate& estimate, const Reference& reference);

 private:
  using RotorVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxRotors, 1>;

  [[nodiscard]] ControlOutput fly(const Estimate& estimate, const Reference& reference);
  [[nodiscard]] Eigen::Vector3d wanted_acceleration(const Estimate& estimate, const Reference& reference);
  [[nodiscard]] RotorVector mix(double thrust_N, const Eigen::Vector3d& moment_Nm) const;
  void forget();

  Multirotor vehicle_;
  Eigen::Vector3d inertia_;
  Eigen::Matrix<double, Eigen::Dynamic, 4, 0, kMaxRotors, 4> mixer_;  ///< (thrust, moments) to rotor thrusts
  double most_thrust_N_;                                              ///< of one rotor
  double least_thrust_N_;
  double rate_gain_;
  double attitude_gain_;
  double velocity_gain_;
  double position_gain_;

  Eigen::Vector3d velocity_integral_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_integral_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_smooth_ = Eigen::Vector3d::Zero();
  std::array<double, kMaxRotors> speed_smooth_{};  ///< 0 = none yet
  double contact_s_ = 0.0;
  double landed_s_ = 0.0;
  bool has_landed_ = false;
  bool is_flying_ = false;
};

}  // namespace airworthy::sim
