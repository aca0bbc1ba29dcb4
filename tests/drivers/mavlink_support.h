#pragma once

#include <utility>
#include <vector>

#include "core/protocol/mavlink/constants.h"
#include "core/protocol/mavlink/frame.h"
#include "core/protocol/mavlink/messages.h"
#include "drivers/mavlink/mavlink_config.h"
#include "drivers/mavlink/message_sink.h"

namespace airworthy::drivers::testing {

/// Keeps what a receiver publishes.
class RecordingSink final : public MessageSink {
 public:
  template <class Message>
  using Record = std::vector<std::pair<TimePoint, Message>>;

  void publish(imu_t& message, TimePoint time) override { imu.emplace_back(time, message); }
  void publish(attitude_t& message, TimePoint time) override { attitude.emplace_back(time, message); }
  void publish(attitude_setpoint_t& message, TimePoint time) override {
    setpoint.emplace_back(time, message);
  }
  void publish(flight_state_t& message, TimePoint time) override { flight_state.emplace_back(time, message); }
  void publish(esc_status_t& message, TimePoint time) override { esc.emplace_back(time, message); }
  void publish(rotor_command_t& message, TimePoint time) override {
    rotor_command.emplace_back(time, message);
  }

  Record<imu_t> imu;
  Record<attitude_t> attitude;
  Record<attitude_setpoint_t> setpoint;
  Record<flight_state_t> flight_state;
  Record<esc_status_t> esc;
  Record<rotor_command_t> rotor_command;
};

/// What config/mavlink.toml sets, without the file.
inline MavlinkConfig default_config() {
  MavlinkConfig config;
  config.vehicle = "quad1";
  config.imu_sources = {mavlink::HighresImu::kId, mavlink::RawImu::kId, mavlink::ScaledImu::kId,
                        mavlink::ScaledImu2::kId, mavlink::ScaledImu3::kId};
  config.rotor_of_esc = {1, 2, 3, 4};
  return config;
}

inline mavlink::Heartbeat heartbeat(std::uint8_t autopilot, bool armed = true) {
  mavlink::Heartbeat message;
  message.type = 2;
  message.autopilot = autopilot;
  message.base_mode = armed ? mavlink::kModeFlagArmed : std::uint8_t{0};
  message.custom_mode = 0x04030000;
  message.system_status = mavlink::kStateActive;
  return message;
}

}  // namespace airworthy::drivers::testing
