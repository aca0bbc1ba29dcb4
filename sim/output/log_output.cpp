#include "sim/output/log_output.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/bus/channels.h"

namespace airworthy::sim {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Euler {
  double roll_rad;
  double pitch_rad;
  double yaw_rad;
};

Euler euler(const Eigen::Quaterniond& q) {
  return {std::atan2(2.0 * (q.w() * q.x() + q.y() * q.z()), 1.0 - 2.0 * (q.x() * q.x() + q.y() * q.y())),
          std::asin(std::clamp(2.0 * (q.w() * q.y() - q.z() * q.x()), -1.0, 1.0)),
          std::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()), 1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()))};
}

void copy(const Eigen::Vector3d& from, double (&to)[3]) {
  std::copy(from.data(), from.data() + 3, std::begin(to));
}

std::vector<double> first(const std::array<double, kMaxRotors>& values, std::size_t count) {
  return {values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count)};
}

}  // namespace

TimePoint LogOutput::vehicle_time(double time_s) {
  return TimePoint{Duration{std::llround((kStart_s + time_s) * 1e6)}};
}

LogOutput::LogOutput(rt::Bus& bus, const std::string& vehicle, std::size_t rotor_count, std::uint64_t seed)
    : clock_{vehicle_time(0.0)},
      // A session number in [1, 2^48) that is the same for the same seed.
      node_{bus, clock_, log_,
            rt::Identity{vehicle, kProducer,
                         static_cast<std::int64_t>(seed % ((std::uint64_t{1} << 48U) - 1) + 1)}},
      rotor_count_{rotor_count},
      truth_{node_.advertise(channel::kGroundTruth)},
      imu_{node_.advertise(channel::kImu)},
      esc_{node_.advertise(channel::kEscStatus)},
      attitude_{node_.advertise(channel::kAttitude)},
      setpoint_{node_.advertise(channel::kAttitudeSetpoint)},
      command_{node_.advertise(channel::kRotorCommand)},
      state_{node_.advertise(channel::kFlightState)} {}

void LogOutput::on_truth(const Truth& truth) {
  ground_truth_t message{};
  message.component = truth.component;
  message.fault_kind = truth.fault_kind;
  message.onset_us = truth.onset_s < 0.0 ? -1 : to_us(vehicle_time(truth.onset_s));
  message.magnitude = truth.magnitude;
  truth_.publish(message, clock_.now());
}

void LogOutput::on_imu(const ImuSample& sample) {
  const TimePoint time = vehicle_time(sample.time_s);
  clock_.advance_to(time);
  imu_t message{};
  copy(sample.accel_m_s2, message.accel_m_s2);
  copy(sample.gyro_rad_s, message.gyro_rad_s);
  message.temperature_degC = kNaN;
  message.averaging_window_s = sample.averaging_window_s;
  imu_.publish(message, time);
}

void LogOutput::on_esc(const EscSample& sample) {
  const TimePoint time = vehicle_time(sample.time_s);
  clock_.advance_to(time);
  esc_status_t message{};
  message.source = "simulated";
  message.rotor_count = static_cast<std::int32_t>(rotor_count_);
  message.speed_rpm = first(sample.speed_rpm, rotor_count_);
  message.voltage_V = first(sample.voltage_V, rotor_count_);
  message.current_A = first(sample.current_A, rotor_count_);
  message.temperature_degC = first(sample.temperature_degC, rotor_count_);
  message.error_count.assign(rotor_count_, -1);
  esc_.publish(message, time);
}

void LogOutput::on_attitude(const AutopilotSample& sample) {
  const TimePoint time = vehicle_time(sample.time_s);
  clock_.advance_to(time);
  attitude_t attitude{};
  const Euler angles = euler(sample.estimate.q_NB);
  attitude.roll_rad = angles.roll_rad;
  attitude.pitch_rad = angles.pitch_rad;
  attitude.yaw_rad = angles.yaw_rad;
  copy(sample.estimate.gyro_rad_s, attitude.rates_rad_s);
  attitude_.publish(attitude, time);

  attitude_setpoint_t setpoint{};
  const Euler wanted = euler(sample.control.setpoint_q_NB);
  setpoint.roll_rad = wanted.roll_rad;
  setpoint.pitch_rad = wanted.pitch_rad;
  setpoint.yaw_rad = wanted.yaw_rad;
  copy(sample.control.setpoint_rates_rad_s, setpoint.rates_rad_s);
  setpoint.thrust_ratio = sample.control.thrust_ratio;
  setpoint_.publish(setpoint, time);
}

void LogOutput::on_commands(const AutopilotSample& sample) {
  const TimePoint time = vehicle_time(sample.time_s);
  clock_.advance_to(time);
  rotor_command_t message{};
  message.rotor_count = static_cast<std::int32_t>(rotor_count_);
  message.command_ratio = first(sample.control.command_ratio, rotor_count_);
  command_.publish(message, time);
}

void LogOutput::on_flight_state(const AutopilotSample& sample, LandedState landed_state) {
  const TimePoint time = vehicle_time(sample.time_s);
  clock_.advance_to(time);
  flight_state_t message{};
  const Eigen::Vector3d& velocity = sample.estimate.velocity_N_m_s;
  message.airspeed_m_s = kNaN;
  message.groundspeed_m_s = velocity.head<2>().norm();
  message.climb_m_s = -velocity.z();
  message.altitude_m = -sample.estimate.position_N_m.z();
  message.altitude_error_m = kNaN;
  message.airspeed_error_m_s = kNaN;
  message.crosstrack_error_m = kNaN;
  message.armed = sample.control.is_armed ? 1 : 0;
  message.landed_state = static_cast<std::int8_t>(landed_state);
  message.mode = -1;
  state_.publish(message, time);
}

}  // namespace airworthy::sim
