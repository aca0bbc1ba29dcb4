#pragma once

#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "core/protocol/mavlink/constants.h"
#include "core/protocol/mavlink/frame.h"
#include "core/protocol/mavlink/messages.h"
#include "drivers/mavlink/device_time.h"
#include "drivers/mavlink/flight_state.h"
#include "drivers/mavlink/mavlink_config.h"
#include "drivers/mavlink/message_sink.h"
#include "runtime/log/log.h"
#include "runtime/process/counters.h"

namespace airworthy::drivers {

/// Turns the frames of one flight controller into our messages: picks the vehicle, dates each message, lets
/// the better of two sources of the same thing count. No input or output of its own: all times come as
/// arguments.
class MavlinkReceiver {
 public:
  MavlinkReceiver(const MavlinkConfig& config, MessageSink& sink, rt::Counters& counters, rt::Log& log);

  /// One frame, whoever sent it. Arrivals never go back.
  void on_frame(const mavlink::Frame& frame, TimePoint arrival);

  /// The system id we listen to; empty until an autopilot was heard.
  [[nodiscard]] std::optional<std::uint8_t> system_id() const { return system_id_; }
  [[nodiscard]] bool has_autopilot(TimePoint now) const;
  [[nodiscard]] Autopilot autopilot() const { return autopilot_; }
  [[nodiscard]] DeviceTime& device_time() { return device_time_; }
  /// Frames of the flight controller by message id.
  [[nodiscard]] const std::map<std::uint32_t, std::int64_t>& counts() const { return counts_; }

 private:
  /// Of several sources of the same thing, those better than the one at hand must have been silent for a
  /// while.
  class Precedence {
   public:
    [[nodiscard]] bool admits(std::size_t rank, TimePoint arrival);

   private:
    std::map<std::size_t, TimePoint> last_;
  };

  [[nodiscard]] bool is_from_autopilot(const mavlink::Frame& frame, TimePoint arrival);
  void choose_autopilot(const mavlink::Frame& frame, TimePoint arrival);
  void note_heartbeat(const mavlink::Heartbeat& message, TimePoint arrival);
  void dispatch(const mavlink::Frame& frame, TimePoint arrival);

  void on_message(const mavlink::HighresImu& message, TimePoint arrival);
  void on_message(const mavlink::RawImu& message, TimePoint arrival);
  void on_scaled_imu(const mavlink::ScaledImuFields& message, std::uint32_t id, int sensor_id,
                     TimePoint arrival);
  void on_message(const mavlink::Attitude& message, TimePoint arrival);
  void on_message(const mavlink::AttitudeQuaternion& message, TimePoint arrival);
  void on_message(const mavlink::AttitudeTarget& message, TimePoint arrival);
  void on_message(const mavlink::NavControllerOutput& message, TimePoint arrival);
  void on_message(const mavlink::VfrHud& message, TimePoint arrival);
  void on_message(const mavlink::ExtendedSysState& message, TimePoint arrival);
  void on_message(const mavlink::EscInfo& message, TimePoint arrival);
  void on_message(const mavlink::EscStatus& message, TimePoint arrival);
  void on_message(const mavlink::EscTelemetry1To4& message, TimePoint arrival);
  void on_message(const mavlink::ServoOutputRaw& message, TimePoint arrival);
  void on_message(const mavlink::ActuatorOutputStatus& message, TimePoint arrival);
  void on_message(const mavlink::Statustext& message, TimePoint arrival);

  [[nodiscard]] bool admits_imu(std::uint32_t message_id, int sensor_id, TimePoint arrival);
  [[nodiscard]] bool repeats_first_batch(const mavlink::EscInfo& message);
  void publish_flight_state(TimePoint arrival);
  template <class Message>
  void publish(std::optional<Message>& message, std::optional<TimePoint> time, TimePoint& last);

  const MavlinkConfig& config_;
  MessageSink& sink_;
  rt::Counters& counters_;
  rt::Log& log_;
  DeviceTime device_time_;
  FlightState flight_state_;

  std::optional<std::uint8_t> system_id_;
  Autopilot autopilot_;
  TimePoint last_heartbeat_{};
  std::set<std::uint16_t> ground_stations_;
  std::map<std::uint32_t, std::int64_t> counts_;

  std::map<int, Precedence> imu_precedence_;
  Precedence attitude_precedence_;
  Precedence setpoint_precedence_;
  std::optional<mavlink::EscInfo> first_esc_batch_;
  std::array<bool, mavlink::kEscsPerMessage> has_turned_{};

  struct {
    TimePoint imu{}, attitude{}, setpoint{}, flight_state{}, esc{}, rotor_command{};
  } last_;
};

}  // namespace airworthy::drivers
