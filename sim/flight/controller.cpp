#include "sim/flight/controller.h"

#include <algorithm>
#include <cmath>

#include "sim/dynamics/multirotor_dynamics.h"

namespace airworthy::sim {
namespace {

constexpr double kStep_s = 1.0 / Controller::kRate_Hz;
constexpr double kMostTilt = 0.7;  // horizontal over vertical specific force
constexpr double kMostRate_rad_s = 4.0;
constexpr double kMostYawRate_rad_s = 1.0;
constexpr double kMostAcceleration_m_s2 = 8.0;
constexpr double kGyroCutoff_rad_s = 2.0 * 3.14159265358979 * 60.0;
constexpr double kLead = 2.5;       // the motor's lag is shortened by this much
constexpr double kDelay_s = 0.012;  // of filters, sampling and commands
constexpr double kContact_s = 0.1;  // of landing, before the vehicle is held level
// Accelerating a propeller turns the body at once and ten times as hard as its drag does later.
constexpr double kYawGainRatio = 0.08;
constexpr double kMostContact_s = 1.0;
constexpr double kLiftRamp_m_s3 = 2.0;
constexpr double kMostLift_m_s2 = 5.0;
constexpr double kMostYawStep_rad = 0.3;
constexpr double kSpinUp_s = 1.0;     // thrust at take-off rises to its limit within this
constexpr double kTouchDown_s = 0.5;  // contact before the landing counts
constexpr double kDisarm_s = 1.5;     // idling after it
constexpr double kArm_s = 1.0;        // standing before the motors are started

double yaw_of(const Eigen::Quaterniond& q) {
  return std::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()), 1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
}

}  // namespace

Controller::Controller(const Multirotor& nominal)
    : vehicle_{nominal},
      inertia_{nominal.inertia_kg_m2[0], nominal.inertia_kg_m2[1], nominal.inertia_kg_m2[2]},
      most_thrust_N_{nominal.thrust_coefficient_N_s2 * nominal.speed_max_rad_s * nominal.speed_max_rad_s},
      least_thrust_N_{nominal.thrust_coefficient_N_s2 * nominal.speed_min_rad_s * nominal.speed_min_rad_s},
      // An integrator behind the lag of motor and filters is damped by 0.7 when gain · lag = 0.5.
      rate_gain_{0.5 / (nominal.motor_time_constant_s / kLead + kDelay_s)},
      attitude_gain_{rate_gain_ / 3.0},
      velocity_gain_{std::min(attitude_gain_ / 2.5, 4.0)},
      position_gain_{velocity_gain_ / 2.5} {
  const auto rotors = static_cast<Eigen::Index>(nominal.rotor_count);
  Eigen::Matrix<double, 4, Eigen::Dynamic, 0, 4, kMaxRotors> effectiveness(4, rotors);
  for (Eigen::Index i = 0; i < rotors; ++i) {
    const Rotor& rotor = nominal.rotor[static_cast<std::size_t>(i)];
    const Eigen::Vector3d hub{rotor.position_m[0], rotor.position_m[1], rotor.position_m[2]};
    const Eigen::Vector3d axis{rotor.thrust_axis[0], rotor.thrust_axis[1], rotor.thrust_axis[2]};
    const Eigen::Vector3d moment = hub.cross(axis) + rotor.spin * nominal.torque_ratio_m * axis;
    effectiveness.col(i) << -axis.z(), moment;
  }
  const Eigen::Matrix4d square = effectiveness * effectiveness.transpose();
  // Where a geometry cannot yaw, the tiny regularisation leaves that axis alone.
  const Eigen::Matrix4d regular = square + 1e-9 * square.trace() * Eigen::Matrix4d::Identity();
  mixer_ = effectiveness.transpose() * regular.inverse();
}

void Controller::forget() {
  velocity_integral_.setZero();
  rate_integral_.setZero();
  speed_smooth_.fill(0.0);
}

Eigen::Vector3d Controller::wanted_acceleration(const Estimate& estimate, const Reference& reference) {
  Eigen::Vector3d correction = position_gain_ * (reference.position_N_m - estimate.position_N_m);
  if (reference.manoeuvre == Manoeuvre::kLand) correction.z() = 0.0;
  const double correction_norm = correction.norm();
  if (correction_norm > reference.most_speed_m_s) correction *= reference.most_speed_m_s / correction_norm;
  const Eigen::Vector3d velocity_error = reference.velocity_N_m_s + correction - estimate.velocity_N_m_s;
  const Eigen::Vector3d proportional = velocity_gain_ * velocity_error;
  // Standing on the ground before take-off, the error says nothing about the model.
  const bool may_integrate = !estimate.has_contact || reference.manoeuvre == Manoeuvre::kLand;
  // A vehicle heavier than its file says must still get off.
  if (estimate.has_contact && reference.manoeuvre == Manoeuvre::kTakeOff) {
    velocity_integral_.z() = std::max(velocity_integral_.z() - kLiftRamp_m_s3 * kStep_s, -kMostLift_m_s2);
  }
  Eigen::Vector3d wanted = reference.acceleration_N_m_s2 + proportional + velocity_integral_;
  for (int axis = 0; axis < 3; ++axis) {
    const double limited = std::clamp(wanted[axis], -kMostAcceleration_m_s2, kMostAcceleration_m_s2);
    if (limited == wanted[axis] && may_integrate)
      velocity_integral_[axis] += 0.25 * velocity_gain_ * proportional[axis] * kStep_s;
    wanted[axis] = limited;
  }
  return wanted;
}

Controller::RotorVector Controller::mix(double thrust_N, const Eigen::Vector3d& moment_Nm) const {
  const RotorVector collective = mixer_.col(0) * thrust_N;
  const RotorVector tilting = mixer_.col(1) * moment_Nm.x() + mixer_.col(2) * moment_Nm.y();
  const RotorVector yawing = mixer_.col(3) * moment_Nm.z();
  // The largest share of a wish that leaves every rotor within its limits.
  const auto share = [this](const RotorVector& base, const RotorVector& wish) {
    double most = 1.0;
    for (Eigen::Index i = 0; i < base.size(); ++i) {
      const double room = wish[i] > 0.0 ? most_thrust_N_ - base[i] : base[i] - least_thrust_N_;
      if (wish[i] != 0.0) most = std::min(most, std::max(0.0, room) / std::abs(wish[i]));
    }
    return most;
  };
  RotorVector result = collective;
  result += share(result, tilting) * tilting;
  result += share(result, yawing) * yawing;
  return result.cwiseMax(least_thrust_N_).cwiseMin(most_thrust_N_);
}

ControlOutput Controller::fly(const Estimate& estimate, const Reference& reference) {
  ControlOutput output;
  output.is_armed = true;
  Eigen::Vector3d specific = wanted_acceleration(estimate, reference);
  specific.z() -= kGravity_m_s2;
  specific.z() = std::min(specific.z(), -0.3 * kGravity_m_s2);
  const bool touches_down = reference.manoeuvre == Manoeuvre::kLand && contact_s_ > kContact_s;
  if (touches_down) specific.head<2>().setZero();
  const double horizontal = specific.head<2>().norm();
  if (horizontal > -kMostTilt * specific.z()) specific.head<2>() *= -kMostTilt * specific.z() / horizontal;

  // Thrust is along -z of the body; the nose turns north in small steps, so that tilt never waits for it.
  const double yaw_rad = yaw_of(estimate.q_NB);
  const double heading_rad = yaw_rad - std::clamp(yaw_rad, -kMostYawStep_rad, kMostYawStep_rad);
  const Eigen::Vector3d z_axis = -specific.normalized();
  const Eigen::Vector3d y_axis =
      z_axis.cross(Eigen::Vector3d{std::cos(heading_rad), std::sin(heading_rad), 0.0}).normalized();
  Eigen::Matrix3d R_NB;
  R_NB << y_axis.cross(z_axis), y_axis, z_axis;
  output.setpoint_q_NB = Eigen::Quaterniond{R_NB};

  double thrust_N = vehicle_.mass_kg * specific.dot(estimate.q_NB.toRotationMatrix().col(2)) * -1.0;
  if (reference.manoeuvre == Manoeuvre::kTakeOff) {
    const double weight_N = vehicle_.mass_kg * kGravity_m_s2;
    thrust_N = std::min(thrust_N, 1.5 * weight_N * reference.segment_time_s / kSpinUp_s);
  }
  thrust_N = std::max(thrust_N, 0.0);

  Eigen::Quaterniond error = estimate.q_NB.conjugate() * output.setpoint_q_NB;
  if (error.w() < 0.0) error.coeffs() = -error.coeffs();
  Eigen::Vector3d rates = 2.0 * attitude_gain_ * error.vec();
  rates.z() *= 0.3;
  for (int axis = 0; axis < 3; ++axis) {
    const double most = axis == 2 ? kMostYawRate_rad_s : kMostRate_rad_s;
    rates[axis] = std::clamp(rates[axis], -most, most);
  }
  output.setpoint_rates_rad_s = rates;

  Eigen::Vector3d angular = rate_gain_ * (rates - gyro_smooth_);
  angular.z() *= kYawGainRatio;
  if (!estimate.has_contact) rate_integral_ += 0.3 * rate_gain_ * angular * kStep_s;
  rate_integral_ = rate_integral_.cwiseMax(-20.0).cwiseMin(20.0);
  const RotorVector thrusts = mix(thrust_N, inertia_.cwiseProduct(Eigen::Vector3d{angular + rate_integral_}));
  for (Eigen::Index i = 0; i < thrusts.size(); ++i) {
    const auto rotor = static_cast<std::size_t>(i);
    const double wanted = std::sqrt(thrusts[i] / vehicle_.thrust_coefficient_N_s2);
    // (1 + τs) / (1 + τs/lead): the motor follows as if it were faster.
    if (speed_smooth_[rotor] <= 0.0) speed_smooth_[rotor] = wanted;
    const double speed = wanted + (kLead - 1.0) * (wanted - speed_smooth_[rotor]);
    speed_smooth_[rotor] +=
        (1.0 - std::exp(-kStep_s * kLead / vehicle_.motor_time_constant_s)) * (wanted - speed_smooth_[rotor]);
    output.command_ratio[rotor] = std::clamp(
        (speed - vehicle_.speed_min_rad_s) / (vehicle_.speed_max_rad_s - vehicle_.speed_min_rad_s), 0.0, 1.0);
  }
  output.thrust_ratio =
      std::min(1.0, thrust_N / (most_thrust_N_ * static_cast<double>(vehicle_.rotor_count)));
  return output;
}

ControlOutput Controller::step(const Estimate& estimate, const Reference& reference) {
  gyro_smooth_ += (1.0 - std::exp(-kGyroCutoff_rad_s * kStep_s)) * (estimate.gyro_rad_s - gyro_smooth_);
  contact_s_ = std::clamp(contact_s_ + (estimate.has_contact ? kStep_s : -kStep_s), 0.0, kMostContact_s);

  const bool is_landing = reference.manoeuvre == Manoeuvre::kLand;
  if (reference.manoeuvre == Manoeuvre::kTakeOff) has_landed_ = false;
  if (is_landing && contact_s_ > kTouchDown_s) has_landed_ = true;
  ControlOutput output;
  if (reference.manoeuvre == Manoeuvre::kGround || has_landed_) {
    forget();
    is_flying_ = false;
    landed_s_ += kStep_s;
    output.is_armed = has_landed_ ? landed_s_ < kDisarm_s : reference.segment_time_s > kArm_s;
    output.setpoint_q_NB = Eigen::AngleAxisd{yaw_of(estimate.q_NB), Eigen::Vector3d::UnitZ()};
    return output;
  }
  landed_s_ = 0.0;
  output = fly(estimate, reference);
  is_flying_ = is_flying_ || !estimate.has_contact;
  output.landed_state = is_landing                                   ? LandedState::kLanding
                        : !is_flying_                                ? LandedState::kOnGround
                        : reference.manoeuvre == Manoeuvre::kTakeOff ? LandedState::kTakingOff
                                                                     : LandedState::kInAir;
  return output;
}

}  // namespace airworthy::sim
