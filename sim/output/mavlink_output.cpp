#include "sim/output/mavlink_output.h"

#include <algorithm>
#include <cmath>

#include "core/protocol/mavlink/constants.h"
#include "core/protocol/mavlink/messages.h"

namespace airworthy::sim {
namespace {

constexpr mavlink::Sender kSelf{1, mavlink::kAutopilotComponent};
constexpr std::uint8_t kTypeQuadrotor = 2;  // MAV_TYPE; what counts is that it is no ground station
constexpr std::uint8_t kResultUnsupported = 3;
constexpr double kClockStart_s = 5.0;  // of the device since boot
constexpr double kHeartbeatPeriod_s = 1.0;
constexpr double kEscInfoPeriod_s = 1.0;

std::uint64_t device_us(double time_s) {
  return static_cast<std::uint64_t>(std::llround((kClockStart_s + time_s) * 1e6));
}

std::uint32_t device_ms(double time_s) { return static_cast<std::uint32_t>(device_us(time_s) / 1000); }

float narrow(double value) { return static_cast<float>(value); }

}  // namespace

MavlinkOutput::MavlinkOutput(Write write, std::size_t rotor_count)
    : write_{std::move(write)}, rotor_count_{rotor_count} {}

template <class Message>
void MavlinkOutput::send(const Message& message) {
  write_(mavlink::encode(message, kSelf, sequence_++).view());
}

void MavlinkOutput::on_received(std::span<const std::uint8_t> bytes, double time_s) {
  parser_.push(bytes, [&](const mavlink::Frame& frame) { answer(frame, time_s); });
}

void MavlinkOutput::answer(const mavlink::Frame& frame, double time_s) {
  if (frame.message_id == mavlink::Timesync::kId) {
    auto message = mavlink::decode<mavlink::Timesync>(frame);
    if (message.tc1 != 0) return;  // somebody's answer
    message.tc1 = static_cast<std::int64_t>(device_us(time_s)) * 1000;
    message.target_system = frame.system_id;
    message.target_component = frame.component_id;
    send(message);
  } else if (frame.message_id == mavlink::CommandLong::kId) {
    const auto command = mavlink::decode<mavlink::CommandLong>(frame);
    mavlink::CommandAck ack;
    ack.command = command.command;
    ack.result = kResultUnsupported;  // rates are those of the realism table
    ack.target_system = frame.system_id;
    ack.target_component = frame.component_id;
    send(ack);
  }
}

void MavlinkOutput::on_imu(const ImuSample& sample) {
  mavlink::HighresImu message;
  message.time_usec = device_us(sample.time_s);
  message.xacc = narrow(sample.accel_m_s2.x());
  message.yacc = narrow(sample.accel_m_s2.y());
  message.zacc = narrow(sample.accel_m_s2.z());
  message.xgyro = narrow(sample.gyro_rad_s.x());
  message.ygyro = narrow(sample.gyro_rad_s.y());
  message.zgyro = narrow(sample.gyro_rad_s.z());
  message.fields_updated = mavlink::kHighresImuInertial;
  send(message);
}

void MavlinkOutput::on_esc(const EscSample& sample) {
  last_esc_ = sample;
  for (std::size_t first = 0; first < rotor_count_; first += mavlink::kEscsPerMessage) {
    mavlink::EscStatus message;
    message.time_usec = device_us(sample.time_s);
    message.index = static_cast<std::uint8_t>(first);
    const std::size_t lanes = std::min(mavlink::kEscsPerMessage, rotor_count_ - first);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const double speed_rpm = sample.speed_rpm[first + lane];
      if (std::isnan(speed_rpm)) continue;  // all zero: no such ESC now
      message.rpm[lane] = static_cast<std::int32_t>(std::lround(speed_rpm));
      message.voltage[lane] = narrow(sample.voltage_V[first + lane]);
    }
    send(message);
  }
  if (sample.time_s < next_esc_info_s_) return;
  next_esc_info_s_ = sample.time_s + kEscInfoPeriod_s;
  send_esc_info(sample.time_s);
}

void MavlinkOutput::send_esc_info(double time_s) {
  for (std::size_t first = 0; first < rotor_count_; first += mavlink::kEscsPerMessage) {
    mavlink::EscInfo message;
    message.time_usec = device_us(time_s);
    message.index = static_cast<std::uint8_t>(first);
    message.count = static_cast<std::uint8_t>(rotor_count_);
    const std::size_t lanes = std::min(mavlink::kEscsPerMessage, rotor_count_ - first);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const double temperature_degC = last_esc_.temperature_degC[first + lane];
      if (std::isnan(temperature_degC)) continue;
      message.temperature[lane] =
          static_cast<std::int16_t>(std::lround(std::min(temperature_degC, 320.0) * 100.0));
      message.info = static_cast<std::uint8_t>(message.info | (1U << lane));
    }
    send(message);
  }
}

void MavlinkOutput::on_attitude(const AutopilotSample& sample) {
  const Eigen::Quaterniond& q = sample.estimate.q_NB;
  mavlink::AttitudeQuaternion attitude;
  attitude.time_boot_ms = device_ms(sample.time_s);
  attitude.q1 = narrow(q.w());
  attitude.q2 = narrow(q.x());
  attitude.q3 = narrow(q.y());
  attitude.q4 = narrow(q.z());
  attitude.rollspeed = narrow(sample.estimate.gyro_rad_s.x());
  attitude.pitchspeed = narrow(sample.estimate.gyro_rad_s.y());
  attitude.yawspeed = narrow(sample.estimate.gyro_rad_s.z());
  send(attitude);

  mavlink::AttitudeTarget target;
  target.time_boot_ms = device_ms(sample.time_s);
  const Eigen::Quaterniond& wanted = sample.control.setpoint_q_NB;
  target.q = {narrow(wanted.w()), narrow(wanted.x()), narrow(wanted.y()), narrow(wanted.z())};
  target.body_roll_rate = narrow(sample.control.setpoint_rates_rad_s.x());
  target.body_pitch_rate = narrow(sample.control.setpoint_rates_rad_s.y());
  target.body_yaw_rate = narrow(sample.control.setpoint_rates_rad_s.z());
  target.thrust = narrow(sample.control.thrust_ratio);
  send(target);
}

void MavlinkOutput::on_commands(const AutopilotSample& sample) {
  mavlink::ActuatorOutputStatus message;
  message.time_usec = device_us(sample.time_s);
  message.active = static_cast<std::uint32_t>(rotor_count_);
  for (std::size_t i = 0; i < rotor_count_; ++i)
    message.actuator[i] = narrow(sample.control.command_ratio[i]);
  send(message);
}

void MavlinkOutput::send_heartbeat(const AutopilotSample& sample) {
  mavlink::Heartbeat message;
  message.type = kTypeQuadrotor;
  message.autopilot = mavlink::kAutopilotPx4;
  message.base_mode = sample.control.is_armed ? mavlink::kModeFlagArmed : std::uint8_t{0};
  message.system_status = mavlink::kStateActive;
  send(message);
}

void MavlinkOutput::on_flight_state(const AutopilotSample& sample, LandedState landed_state) {
  if (sample.time_s >= next_heartbeat_s_) {
    next_heartbeat_s_ = sample.time_s + kHeartbeatPeriod_s;
    send_heartbeat(sample);
  }
  mavlink::VfrHud hud;
  const Eigen::Vector3d& velocity = sample.estimate.velocity_N_m_s;
  hud.groundspeed = narrow(velocity.head<2>().norm());
  hud.airspeed = hud.groundspeed;
  hud.alt = narrow(-sample.estimate.position_N_m.z());
  hud.climb = narrow(-velocity.z());
  hud.throttle = static_cast<std::uint16_t>(std::lround(100.0 * sample.control.thrust_ratio));
  send(hud);
  mavlink::ExtendedSysState state;
  state.landed_state = static_cast<std::uint8_t>(landed_state);
  send(state);
}

}  // namespace airworthy::sim
