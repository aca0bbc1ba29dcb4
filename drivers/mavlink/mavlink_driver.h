#pragma once

#include <boost/asio/io_context.hpp>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "airworthy/driver_status_t.hpp"
#include "core/protocol/mavlink/parser.h"
#include "drivers/mavlink/mavlink_config.h"
#include "drivers/mavlink/mavlink_receiver.h"
#include "drivers/mavlink/message_sink.h"
#include "drivers/ports/port.h"
#include "runtime/process/node.h"
#include "runtime/process/process_status.h"

namespace airworthy::drivers {

/// The process between a flight controller and the bus: feeds the link's bytes to the parser, its frames to
/// the receiver, the receiver's messages to the bus; sends what was configured; tells how the link is doing.
class MavlinkDriver final : private MessageSink {
 public:
  static constexpr Duration kStatusPeriod{500'000};
  /// A half frame whose rest does not come within this is given up.
  static constexpr Duration kFlushAfter{200'000};
  static constexpr Duration kRateCheckPeriod{5'000'000};

  MavlinkDriver(rt::Node& node, boost::asio::io_context& io, const MavlinkConfig& config,
                rt::ProcessStatus& process_status, const Port::Params& port_params = {});

 private:
  struct Rate {
    std::int64_t at_last_status = 0;
    std::int64_t at_last_check = 0;
  };

  void publish(imu_t& message, TimePoint time) override { imu_.publish(message, time); }
  void publish(attitude_t& message, TimePoint time) override { attitude_.publish(message, time); }
  void publish(attitude_setpoint_t& message, TimePoint time) override { setpoint_.publish(message, time); }
  void publish(flight_state_t& message, TimePoint time) override { flight_state_.publish(message, time); }
  void publish(esc_status_t& message, TimePoint time) override { esc_.publish(message, time); }
  void publish(rotor_command_t& message, TimePoint time) override { rotor_command_.publish(message, time); }

  void on_open();
  void on_close(const std::string& why);
  void on_data(std::span<const std::uint8_t> data);
  void on_frame(const mavlink::Frame& frame, TimePoint arrival);
  void on_timesync(const mavlink::Timesync& message, TimePoint arrival);
  void on_command_ack(const mavlink::CommandAck& message);

  void watch_silence(TimePoint now);
  void send_heartbeat();
  void send_timesync(TimePoint now);
  void send_requests();
  void check_rates();
  void publish_status(TimePoint now);
  void report_state(TimePoint now);
  template <class Message>
  void send(const Message& message);

  rt::Node& node_;
  const MavlinkConfig& config_;
  rt::ProcessStatus& process_status_;
  std::unique_ptr<Port> port_;
  mavlink::Parser parser_;
  MavlinkReceiver receiver_;

  rt::Publisher<imu_t> imu_;
  rt::Publisher<attitude_t> attitude_;
  rt::Publisher<attitude_setpoint_t> setpoint_;
  rt::Publisher<flight_state_t> flight_state_;
  rt::Publisher<esc_status_t> esc_;
  rt::Publisher<rotor_command_t> rotor_command_;
  rt::Publisher<driver_status_t> status_;

  std::uint8_t next_sequence_ = 0;
  std::deque<std::int64_t> open_timesyncs_ns_;
  std::optional<TimePoint> last_data_;
  TimePoint opened_{};
  bool has_requested_ = false;
  bool is_dialect_reported_ = false;
  TimePoint last_status_{};
  std::map<std::uint32_t, Rate> rates_;
};

}  // namespace airworthy::drivers
