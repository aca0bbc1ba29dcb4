#include "drivers/mavlink/mavlink_receiver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/protocol/mavlink/constants.h"
#include "core/protocol/mavlink/values.h"
#include "drivers/mavlink/mavlink_translation.h"

namespace airworthy::drivers {
namespace {

/// A better source silent for this long no longer counts.
constexpr Duration kPrecedence{1'000'000};
/// An automatically chosen autopilot that was not heard for this long may be replaced by another.
constexpr Duration kAutopilotLost{10'000'000};
/// HEARTBEATs come at 1 Hz; a system is lost after five missed.
constexpr Duration kHeartbeatTimeout{5'000'000};
constexpr std::size_t kMostGroundStations = 16;

constexpr double kMostSpeed_m_s = 500.0;
constexpr double kMostDistance_m = 1e6;

std::uint32_t stream_of(std::uint32_t message_id, std::uint32_t instance) {
  return message_id << 8U | instance;
}

double plausible(double value, double limit, rt::Counters& counters) {
  if (std::isnan(value) || std::abs(value) <= limit) return value;
  counters.add("refused.implausible_value");
  return std::numeric_limits<double>::quiet_NaN();
}

double plausible(float value, double limit, rt::Counters& counters) {
  return plausible(static_cast<double>(value), limit, counters);
}

}  // namespace

MavlinkReceiver::MavlinkReceiver(const MavlinkConfig& config, MessageSink& sink, rt::Counters& counters,
                                 rt::Log& log)
    : config_{config},
      sink_{sink},
      counters_{counters},
      log_{log},
      device_time_{counters},
      autopilot_{config.autopilot} {
  if (config.system_id != 0) system_id_ = static_cast<std::uint8_t>(config.system_id);
}

bool MavlinkReceiver::Precedence::admits(std::size_t rank, TimePoint arrival) {
  last_[rank] = arrival;
  return std::none_of(last_.begin(), last_.lower_bound(rank),
                      [arrival](const auto& better) { return arrival - better.second < kPrecedence; });
}

void MavlinkReceiver::on_frame(const mavlink::Frame& frame, TimePoint arrival) {
  if (!is_from_autopilot(frame, arrival)) return;
  ++counts_[frame.message_id];
  dispatch(frame, arrival);
}

bool MavlinkReceiver::has_autopilot(TimePoint now) const {
  return last_heartbeat_ != TimePoint{} && now - last_heartbeat_ <= kHeartbeatTimeout;
}

bool MavlinkReceiver::is_from_autopilot(const mavlink::Frame& frame, TimePoint arrival) {
  if (frame.message_id == mavlink::Heartbeat::kId) choose_autopilot(frame, arrival);
  const auto sender = static_cast<std::uint16_t>(frame.system_id << 8U | frame.component_id);
  if (ground_stations_.contains(sender)) {
    counters_.add("frames.ground_station");
  } else if (!system_id_) {
    counters_.add("frames.before_autopilot");
  } else if (frame.system_id != *system_id_) {
    counters_.add("frames.other_system");
  } else if (frame.component_id != config_.component_id) {
    counters_.add("frames.other_component");
  } else {
    counters_.add("frames.autopilot");
    return true;
  }
  return false;
}

void MavlinkReceiver::choose_autopilot(const mavlink::Frame& frame, TimePoint arrival) {
  const auto message = mavlink::decode<mavlink::Heartbeat>(frame);
  if (message.type == mavlink::kTypeGroundStation) {
    if (ground_stations_.size() < kMostGroundStations) {
      ground_stations_.insert(static_cast<std::uint16_t>(frame.system_id << 8U | frame.component_id));
    }
    return;
  }
  if (message.autopilot == mavlink::kAutopilotInvalid || frame.component_id != config_.component_id) return;
  if (system_id_ == frame.system_id) {
    note_heartbeat(message, arrival);
    return;
  }
  if (config_.system_id != 0) return;
  if (system_id_ && arrival - last_heartbeat_ < kAutopilotLost) return;
  system_id_ = frame.system_id;
  log_.info("autopilot_found", {{"system", frame.system_id},
                                {"component", frame.component_id},
                                {"autopilot", message.autopilot},
                                {"type", message.type}});
  note_heartbeat(message, arrival);
}

void MavlinkReceiver::note_heartbeat(const mavlink::Heartbeat& message, TimePoint arrival) {
  last_heartbeat_ = arrival;
  if (config_.autopilot == Autopilot::kUnknown) {
    autopilot_ = message.autopilot == mavlink::kAutopilotPx4         ? Autopilot::kPx4
                 : message.autopilot == mavlink::kAutopilotArdupilot ? Autopilot::kArdupilot
                                                                     : Autopilot::kOther;
  }
  const std::int8_t armed = (message.base_mode & mavlink::kModeFlagArmed) != 0 ? 1 : 0;
  const std::int64_t mode = message.custom_mode;
  const bool is_news = flight_state_.armed.value != armed || flight_state_.mode.value != mode;
  flight_state_.armed.set(armed, arrival);
  flight_state_.mode.set(mode, arrival);
  if (is_news) {
    log_.info("flight_mode", {{"armed", armed}, {"mode", mode}});
    publish_flight_state(arrival);
  }
}

void MavlinkReceiver::dispatch(const mavlink::Frame& frame, TimePoint arrival) {
  switch (frame.message_id) {
    case mavlink::HighresImu::kId:
      return on_message(mavlink::decode<mavlink::HighresImu>(frame), arrival);
    case mavlink::RawImu::kId:
      return on_message(mavlink::decode<mavlink::RawImu>(frame), arrival);
    case mavlink::ScaledImu::kId:
      return on_scaled_imu(mavlink::decode<mavlink::ScaledImu>(frame), mavlink::ScaledImu::kId, 0, arrival);
    case mavlink::ScaledImu2::kId:
      return on_scaled_imu(mavlink::decode<mavlink::ScaledImu2>(frame), mavlink::ScaledImu2::kId, 1, arrival);
    case mavlink::ScaledImu3::kId:
      return on_scaled_imu(mavlink::decode<mavlink::ScaledImu3>(frame), mavlink::ScaledImu3::kId, 2, arrival);
    case mavlink::Attitude::kId:
      return on_message(mavlink::decode<mavlink::Attitude>(frame), arrival);
    case mavlink::AttitudeQuaternion::kId:
      return on_message(mavlink::decode<mavlink::AttitudeQuaternion>(frame), arrival);
    case mavlink::AttitudeTarget::kId:
      return on_message(mavlink::decode<mavlink::AttitudeTarget>(frame), arrival);
    case mavlink::NavControllerOutput::kId:
      return on_message(mavlink::decode<mavlink::NavControllerOutput>(frame), arrival);
    case mavlink::VfrHud::kId:
      return on_message(mavlink::decode<mavlink::VfrHud>(frame), arrival);
    case mavlink::ExtendedSysState::kId:
      return on_message(mavlink::decode<mavlink::ExtendedSysState>(frame), arrival);
    case mavlink::EscInfo::kId:
      return on_message(mavlink::decode<mavlink::EscInfo>(frame), arrival);
    case mavlink::EscStatus::kId:
      return on_message(mavlink::decode<mavlink::EscStatus>(frame), arrival);
    case mavlink::EscTelemetry1To4::kId:
      return on_message(mavlink::decode<mavlink::EscTelemetry1To4>(frame), arrival);
    case mavlink::ServoOutputRaw::kId:
      return on_message(mavlink::decode<mavlink::ServoOutputRaw>(frame), arrival);
    case mavlink::ActuatorOutputStatus::kId:
      return on_message(mavlink::decode<mavlink::ActuatorOutputStatus>(frame), arrival);
    case mavlink::Statustext::kId:
      return on_message(mavlink::decode<mavlink::Statustext>(frame), arrival);
    default:
      return;
  }
}

/// Publishes if there is both a message and a time; two streams on one channel never make its time go back.
template <class Message>
void MavlinkReceiver::publish(std::optional<Message>& message, std::optional<TimePoint> time,
                              TimePoint& last) {
  if (!message || !time) return;
  last = std::max(last, *time);
  sink_.publish(*message, last);
}

bool MavlinkReceiver::admits_imu(std::uint32_t message_id, int sensor_id, TimePoint arrival) {
  const auto found = std::find(config_.imu_sources.begin(), config_.imu_sources.end(), message_id);
  if (found == config_.imu_sources.end()) return false;
  const auto rank = static_cast<std::size_t>(found - config_.imu_sources.begin());
  if (imu_precedence_[sensor_id].admits(rank, arrival)) return true;
  counters_.add("superseded.imu");
  return false;
}

void MavlinkReceiver::on_message(const mavlink::HighresImu& message, TimePoint arrival) {
  auto imu = to_imu(message, config_.averaging_window_s, counters_);
  if (!imu || !admits_imu(message.kId, imu->sensor_id, arrival)) return;
  publish(imu, device_time_.of_us(message.time_usec, stream_of(message.kId, message.id), arrival), last_.imu);
}

void MavlinkReceiver::on_message(const mavlink::RawImu& message, TimePoint arrival) {
  const bool is_milli_g =
      config_.raw_imu_unit == RawImuUnit::kMilliG ||
      (config_.raw_imu_unit == RawImuUnit::kByAutopilot && autopilot_ == Autopilot::kArdupilot);
  if (!is_milli_g) {
    counters_.add("refused.raw_imu_unit_unknown");
    return;
  }
  auto imu = to_imu(message, config_.averaging_window_s, counters_);
  if (!imu || !admits_imu(message.kId, imu->sensor_id, arrival)) return;
  publish(imu, device_time_.of_us(message.time_usec, stream_of(message.kId, message.id), arrival), last_.imu);
}

void MavlinkReceiver::on_scaled_imu(const mavlink::ScaledImuFields& message, std::uint32_t id, int sensor_id,
                                    TimePoint arrival) {
  auto imu = to_imu(message, sensor_id, config_.averaging_window_s, counters_);
  if (!imu || !admits_imu(id, sensor_id, arrival)) return;
  publish(imu, device_time_.of_ms(message.time_boot_ms, stream_of(id, 0), arrival), last_.imu);
}

void MavlinkReceiver::on_message(const mavlink::Attitude& message, TimePoint arrival) {
  auto attitude = to_attitude(message, counters_);
  if (!attitude || !attitude_precedence_.admits(0, arrival)) return;
  publish(attitude, device_time_.of_ms(message.time_boot_ms, stream_of(message.kId, 0), arrival),
          last_.attitude);
}

void MavlinkReceiver::on_message(const mavlink::AttitudeQuaternion& message, TimePoint arrival) {
  auto attitude = to_attitude(message, counters_);
  if (!attitude) return;
  if (!attitude_precedence_.admits(1, arrival)) {
    counters_.add("superseded.attitude");
    return;
  }
  publish(attitude, device_time_.of_ms(message.time_boot_ms, stream_of(message.kId, 0), arrival),
          last_.attitude);
}

void MavlinkReceiver::on_message(const mavlink::AttitudeTarget& message, TimePoint arrival) {
  auto setpoint = to_setpoint(message, counters_);
  if (!setpoint || !setpoint_precedence_.admits(0, arrival)) return;
  publish(setpoint, device_time_.of_ms(message.time_boot_ms, stream_of(message.kId, 0), arrival),
          last_.setpoint);
}

void MavlinkReceiver::on_message(const mavlink::NavControllerOutput& message, TimePoint arrival) {
  auto setpoint = to_setpoint(message, counters_);
  if (setpoint && setpoint_precedence_.admits(1, arrival)) {
    publish(setpoint, arrival, last_.setpoint);
  } else if (setpoint) {
    counters_.add("superseded.setpoint");
  }
  const double airspeed_error =
      airspeed_error_m_s(message.aspd_error, config_.airspeed_error_unit, autopilot_);
  flight_state_.altitude_error_m.set(plausible(message.alt_error, kMostDistance_m, counters_), arrival);
  flight_state_.airspeed_error_m_s.set(plausible(airspeed_error, kMostSpeed_m_s, counters_), arrival);
  flight_state_.crosstrack_error_m.set(plausible(message.xtrack_error, kMostDistance_m, counters_), arrival);
  publish_flight_state(arrival);
}

void MavlinkReceiver::on_message(const mavlink::VfrHud& message, TimePoint arrival) {
  flight_state_.airspeed_m_s.set(plausible(message.airspeed, kMostSpeed_m_s, counters_), arrival);
  flight_state_.groundspeed_m_s.set(plausible(message.groundspeed, kMostSpeed_m_s, counters_), arrival);
  flight_state_.altitude_m.set(plausible(message.alt, kMostDistance_m, counters_), arrival);
  flight_state_.climb_m_s.set(plausible(message.climb, kMostSpeed_m_s, counters_), arrival);
  publish_flight_state(arrival);
}

void MavlinkReceiver::on_message(const mavlink::ExtendedSysState& message, TimePoint arrival) {
  constexpr std::uint8_t kLanding = 4;
  if (message.landed_state > kLanding) counters_.add("refused.landed_state");
  const bool is_known = message.landed_state != 0 && message.landed_state <= kLanding;
  const auto landed_state = static_cast<std::int8_t>(is_known ? message.landed_state : -1);
  const bool is_news = flight_state_.landed_state.value != landed_state;
  flight_state_.landed_state.set(landed_state, arrival);
  if (is_news) publish_flight_state(arrival);
}

void MavlinkReceiver::publish_flight_state(TimePoint arrival) {
  std::optional message{flight_state_.to_message(arrival, config_.field_timeout)};
  publish(message, arrival, last_.flight_state);
}

void MavlinkReceiver::on_message(const mavlink::EscInfo& message, TimePoint arrival) {
  if (repeats_first_batch(message)) {
    counters_.add("refused.esc_batch_repeated");
    return;
  }
  std::array<mavlink::EscValues, mavlink::kEscsPerMessage> escs;
  for (std::size_t lane = 0; lane < escs.size(); ++lane) escs[lane] = esc_values(message, lane);
  auto status = to_esc_status(escs, message.index, config_, "ESC_INFO", counters_);
  if (!status) return;
  publish(status, device_time_.of_us(message.time_usec, stream_of(message.kId, message.index), arrival),
          last_.esc);
}

/// Some PX4 versions fill every batch with ESCs 0 to 3. A later batch that equals the first is taken for
/// that, for a temperature of the wrong rotor is worse than none.
bool MavlinkReceiver::repeats_first_batch(const mavlink::EscInfo& message) {
  if (message.index == 0) {
    first_esc_batch_ = message;
    return false;
  }
  return first_esc_batch_ && first_esc_batch_->temperature == message.temperature &&
         first_esc_batch_->error_count == message.error_count &&
         first_esc_batch_->failure_flags == message.failure_flags;
}

void MavlinkReceiver::on_message(const mavlink::EscStatus& message, TimePoint arrival) {
  std::array<mavlink::EscValues, mavlink::kEscsPerMessage> escs;
  for (std::size_t lane = 0; lane < escs.size(); ++lane) escs[lane] = esc_values(message, lane);
  auto status = to_esc_status(escs, message.index, config_, "ESC_STATUS", counters_);
  if (!status) return;
  publish(status, device_time_.of_us(message.time_usec, stream_of(message.kId, message.index), arrival),
          last_.esc);
}

void MavlinkReceiver::on_message(const mavlink::EscTelemetry1To4& message, TimePoint arrival) {
  std::array<mavlink::EscValues, mavlink::kEscsPerMessage> escs;
  for (std::size_t lane = 0; lane < escs.size(); ++lane) {
    escs[lane] = esc_values(message, lane);
    // Zero also means "this ESC measures no speed", until it has shown that it does.
    has_turned_[lane] = has_turned_[lane] || escs[lane].speed_rpm.value_or(0.0) != 0.0;
    if (!has_turned_[lane]) escs[lane].speed_rpm.reset();
  }
  auto status = to_esc_status(escs, 0, config_, "ESC_TELEMETRY_1_TO_4", counters_);
  publish(status, arrival, last_.esc);
}

void MavlinkReceiver::on_message(const mavlink::ServoOutputRaw& message, TimePoint arrival) {
  if (config_.rotor_command_source != RotorCommandSource::kServoOutputRaw) return;
  auto command = to_rotor_command(message, config_);
  if (!command) return;
  publish(command, device_time_.of_us(message.time_usec, stream_of(message.kId, message.port), arrival),
          last_.rotor_command);
}

void MavlinkReceiver::on_message(const mavlink::ActuatorOutputStatus& message, TimePoint arrival) {
  if (config_.rotor_command_source != RotorCommandSource::kActuatorOutputStatus) return;
  auto command = to_rotor_command(message, config_, counters_);
  if (!command) return;
  publish(command, device_time_.of_us(message.time_usec, stream_of(message.kId, 0), arrival),
          last_.rotor_command);
}

void MavlinkReceiver::on_message(const mavlink::Statustext& message, TimePoint) {
  constexpr std::uint8_t kError = 3;
  constexpr std::uint8_t kWarning = 4;
  const auto text = mavlink::text_of(message);
  // Three events, because the log limits the rate of each: chatter must not hide an error.
  if (message.severity <= kError) {
    log_.error("autopilot_error", {{"severity", message.severity}, {"text", text}});
  } else if (message.severity == kWarning) {
    log_.warning("autopilot_warning", {{"severity", message.severity}, {"text", text}});
  } else {
    log_.info("autopilot_text", {{"severity", message.severity}, {"text", text}});
  }
}

}  // namespace airworthy::drivers
