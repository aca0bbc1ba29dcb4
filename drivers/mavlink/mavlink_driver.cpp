#include "drivers/mavlink/mavlink_driver.h"

#include <algorithm>
#include <limits>

#include "core/protocol/mavlink/constants.h"
#include "core/protocol/mavlink/message_table.h"
#include "core/protocol/mavlink/messages.h"
#include "runtime/bus/channels.h"

namespace airworthy::drivers {
namespace {

constexpr std::size_t kMostOpenTimesyncs = 8;
/// A requested rate is missed when less than this part of it arrives.
constexpr double kRateTolerance = 0.8;

counter_t counter(std::string name, std::uint64_t value) {
  counter_t message;
  message.name = std::move(name);
  message.value = static_cast<std::int64_t>(value);
  return message;
}

void add_parser_counters(const mavlink::ParserCounters& from, std::vector<counter_t>& to) {
  to.push_back(counter("parser.bytes", from.bytes));
  to.push_back(counter("parser.frames_ok", from.frames_ok));
  to.push_back(counter("parser.frames_unverified", from.frames_unverified));
  to.push_back(counter("parser.frames_incompatible", from.frames_incompatible));
  to.push_back(counter("parser.frames_old_esc_info", from.frames_old_esc_info));
  to.push_back(counter("parser.crc_errors", from.crc_errors));
  to.push_back(counter("parser.bytes_skipped", from.bytes_skipped));
  to.push_back(counter("parser.frames_lost", from.frames_lost));
  to.push_back(counter("parser.frames_reordered", from.frames_reordered));
  to.push_back(counter("parser.senders_forgotten", from.senders_forgotten));
}

void add_port_counters(const PortCounters& from, std::vector<counter_t>& to) {
  const auto add = [&to](const char* name, std::int64_t value) {
    to.push_back(counter(name, static_cast<std::uint64_t>(value)));
  };
  add("port.bytes_received", from.bytes_received);
  add("port.bytes_sent", from.bytes_sent);
  add("port.opens", from.opens);
  add("port.open_failures", from.open_failures);
  add("port.losses", from.losses);
  add("port.writes_dropped", from.writes_dropped);
  add("port.refusals", from.refusals);
}

std::string name_of(std::uint32_t message_id) {
  const auto* info = mavlink::find_message(message_id);
  return info != nullptr ? std::string{info->name} : std::to_string(message_id);
}

}  // namespace

MavlinkDriver::MavlinkDriver(rt::Node& node, boost::asio::io_context& io, const MavlinkConfig& config,
                             rt::ProcessStatus& process_status, const Port::Params& port_params)
    : node_{node},
      config_{config},
      process_status_{process_status},
      port_{Port::make(io, config.link, port_params)},
      receiver_{config, *this, node.counters(), node.log()},
      imu_{node.advertise(channel::kImu)},
      attitude_{node.advertise(channel::kAttitude)},
      setpoint_{node.advertise(channel::kAttitudeSetpoint)},
      flight_state_{node.advertise(channel::kFlightState)},
      esc_{node.advertise(channel::kEscStatus)},
      rotor_command_{node.advertise(channel::kRotorCommand)},
      status_{node.advertise(channel::kDriverStatus)} {
  node_.every(kStatusPeriod, [this](TimePoint now) { publish_status(now); });
  node_.every(kFlushAfter / 2, [this](TimePoint now) { watch_silence(now); });
  node_.every(kRateCheckPeriod, [this](TimePoint) { check_rates(); });
  if (config.send_heartbeat) node_.every(Duration{1'000'000}, [this](TimePoint) { send_heartbeat(); });
  if (config.timesync_rate_Hz > 0.0) {
    node_.every(from_seconds(1.0 / config.timesync_rate_Hz), [this](TimePoint now) { send_timesync(now); });
  }
  port_->start({.on_data = [this](std::span<const std::uint8_t> data) { on_data(data); },
                .on_open = [this] { on_open(); },
                .on_close = [this](const std::string& why) { on_close(why); }});
}

void MavlinkDriver::on_open() {
  parser_.reset();
  open_timesyncs_ns_.clear();
  has_requested_ = false;
  opened_ = node_.clock().now();
  node_.log().info("link_open", {{"link", config_.link.text}});
  report_state(opened_);
}

void MavlinkDriver::on_close(const std::string& why) {
  node_.log().warning("link_closed", {{"link", config_.link.text}, {"cause", why}});
  report_state(node_.clock().now());
}

void MavlinkDriver::on_data(std::span<const std::uint8_t> data) {
  const rt::StepMeter::Step step{node_.step_meter()};
  const TimePoint arrival = node_.clock().now();
  last_data_ = arrival;
  parser_.push(data, [this, arrival](const mavlink::Frame& frame) { on_frame(frame, arrival); });
  if (parser_.counters().frames_old_esc_info > 0 && !is_dialect_reported_) {
    is_dialect_reported_ = true;
    node_.log().warning("dialect_too_old",
                        {{"message", "ESC_INFO"}, {"needs", "a dialect of 2021-08-25 or later"}});
  }
}

void MavlinkDriver::on_frame(const mavlink::Frame& frame, TimePoint arrival) {
  receiver_.on_frame(frame, arrival);
  const bool is_from_autopilot =
      receiver_.system_id() == frame.system_id && frame.component_id == config_.component_id;
  if (!is_from_autopilot) return;
  if (frame.message_id == mavlink::Timesync::kId)
    on_timesync(mavlink::decode<mavlink::Timesync>(frame), arrival);
  if (frame.message_id == mavlink::CommandAck::kId)
    on_command_ack(mavlink::decode<mavlink::CommandAck>(frame));
  if (!has_requested_ && receiver_.has_autopilot(arrival)) {
    has_requested_ = true;
    send_requests();
  }
}

void MavlinkDriver::on_timesync(const mavlink::Timesync& message, TimePoint arrival) {
  if (message.tc1 == 0) return;  // the flight controller's own question, which others may answer
  const auto found = std::find(open_timesyncs_ns_.begin(), open_timesyncs_ns_.end(), message.ts1);
  if (found == open_timesyncs_ns_.end()) {
    node_.counters().add("timesync.not_ours");
    return;
  }
  open_timesyncs_ns_.erase(found);
  receiver_.device_time().add_round_trip(from_us(message.ts1 / 1000), arrival, message.tc1 / 1000);
}

void MavlinkDriver::on_command_ack(const mavlink::CommandAck& message) {
  if (message.command != mavlink::kCommandSetMessageInterval || message.result == 0) return;
  node_.counters().add("requests_refused");
  node_.log().warning("request_refused", {{"command", message.command}, {"result", message.result}});
}

void MavlinkDriver::watch_silence(TimePoint now) {
  if (!port_->is_open()) return;
  const TimePoint last = std::max(last_data_.value_or(opened_), opened_);
  if (parser_.pending_bytes() > 0 && now - last >= kFlushAfter) {
    parser_.flush([this, now](const mavlink::Frame& frame) { on_frame(frame, now); });
  }
  // A datagram socket cannot go stale, and the other end may be off for long.
  const bool is_stream = config_.link.kind == LinkKind::kSerial || config_.link.kind == LinkKind::kTcp;
  if (is_stream && now - last > config_.silence) port_->reopen("silent");
}

template <class Message>
void MavlinkDriver::send(const Message& message) {
  if (!port_->is_open()) return;
  const int system = config_.own_system_id != 0 ? config_.own_system_id : receiver_.system_id().value_or(1);
  const mavlink::Sender sender{static_cast<std::uint8_t>(system),
                               static_cast<std::uint8_t>(config_.own_component_id)};
  port_->write(mavlink::encode(message, sender, next_sequence_++).view());
}

void MavlinkDriver::send_heartbeat() {
  mavlink::Heartbeat message;
  message.type = mavlink::kTypeOnboardController;
  message.autopilot = mavlink::kAutopilotInvalid;
  message.system_status = mavlink::kStateActive;
  send(message);
}

void MavlinkDriver::send_timesync(TimePoint now) {
  if (!receiver_.system_id() || !port_->is_open()) return;
  mavlink::Timesync message;
  message.ts1 = to_us(now) * 1000;
  message.target_system = *receiver_.system_id();
  message.target_component = static_cast<std::uint8_t>(config_.component_id);
  open_timesyncs_ns_.push_back(message.ts1);
  if (open_timesyncs_ns_.size() > kMostOpenTimesyncs) open_timesyncs_ns_.pop_front();
  send(message);
}

void MavlinkDriver::send_requests() {
  for (const RateRequest& request : config_.requests) {
    mavlink::CommandLong message;
    message.command = mavlink::kCommandSetMessageInterval;
    message.param1 = static_cast<float>(request.message_id);
    message.param2 = static_cast<float>(1e6 / request.rate_Hz);
    message.target_system = *receiver_.system_id();
    message.target_component = static_cast<std::uint8_t>(config_.component_id);
    send(message);
  }
}

void MavlinkDriver::check_rates() {
  bool is_short = false;
  for (const RateRequest& request : config_.requests) {
    const auto found = receiver_.counts().find(request.message_id);
    const std::int64_t count = found == receiver_.counts().end() ? 0 : found->second;
    Rate& rate = rates_[request.message_id];
    const double measured_Hz = static_cast<double>(count - rate.at_last_check) / to_seconds(kRateCheckPeriod);
    rate.at_last_check = count;
    const bool was_open_throughout = port_->is_open() && node_.clock().now() - opened_ > 2 * kRateCheckPeriod;
    if (!has_requested_ || !was_open_throughout || measured_Hz >= kRateTolerance * request.rate_Hz) continue;
    is_short = true;
    node_.counters().add("rate_missed." + request.message);
    node_.log().warning(
        "rate_missed",
        {{"message", request.message}, {"requested_Hz", request.rate_Hz}, {"measured_Hz", measured_Hz}});
  }
  if (is_short) send_requests();
}

void MavlinkDriver::publish_status(TimePoint now) {
  driver_status_t message;
  message.link = config_.link.text;
  message.connected = port_->is_open() ? 1 : 0;
  message.detail = port_->detail();
  message.seconds_since_data =
      last_data_ ? to_seconds(now - *last_data_) : std::numeric_limits<double>::quiet_NaN();
  message.counters = node_.counters().to_messages();
  add_parser_counters(parser_.counters(), message.counters);
  add_port_counters(port_->counters(), message.counters);
  message.counter_count = static_cast<std::int32_t>(message.counters.size());

  const double period_s = last_status_ == TimePoint{} ? 0.0 : to_seconds(now - last_status_);
  last_status_ = now;
  for (const auto& [id, count] : receiver_.counts()) {
    Rate& rate = rates_[id];
    message_rate_t& row = message.rates.emplace_back();
    row.name = name_of(id);
    row.count = count;
    row.rate_Hz = period_s > 0.0 ? static_cast<double>(count - rate.at_last_status) / period_s
                                 : std::numeric_limits<double>::quiet_NaN();
    rate.at_last_status = count;
  }
  message.rate_count = static_cast<std::int32_t>(message.rates.size());

  const DeviceTime::Summary clock = receiver_.device_time().summary(now);
  message.clock_source = clock.source;
  message.clock_offset_us = clock.offset_us;
  message.clock_uncertainty_us = clock.uncertainty_us;
  status_.publish(message, now);
  report_state(now);
}

void MavlinkDriver::report_state(TimePoint now) {
  if (!port_->is_open()) {
    process_status_.set(rt::ProcessState::kDegraded, config_.link.text + ": " + port_->detail());
  } else if (!receiver_.has_autopilot(now)) {
    process_status_.set(rt::ProcessState::kDegraded, "no autopilot heard on " + config_.link.text);
  } else {
    process_status_.set(rt::ProcessState::kRunning, "");
  }
}

}  // namespace airworthy::drivers
