#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <tuple>

#include "airworthy/attitude_setpoint_t.hpp"
#include "airworthy/attitude_t.hpp"
#include "airworthy/esc_status_t.hpp"
#include "airworthy/flight_state_t.hpp"
#include "airworthy/ground_truth_t.hpp"
#include "airworthy/imu_t.hpp"
#include "airworthy/rotor_command_t.hpp"
#include "runtime/bus/log_writer.h"
#include "runtime/clock/manual_clock.h"
#include "runtime/process/node.h"

namespace airworthy::importer {

/// What one import wrote.
struct LogSummary {
  std::string log;  ///< path of the file
  std::string vehicle;
  std::int64_t start_us = 0;                     ///< vehicle time of the first message
  std::int64_t end_us = 0;                       ///< and of the last one
  std::map<std::string, std::int64_t> messages;  ///< by channel
  std::map<std::string, std::int64_t> left_out;  ///< input that was not imported, by reason
};

/// A log being written, as the vehicle's own processes would have filled it: every message has a header, its
/// publication time is its measurement time. The session comes from the name of the log, so that the same
/// input gives the same bytes.
class FlightLog {
 public:
  static constexpr const char* kProducer = "airworthy-import";

  [[nodiscard]] static rt::Expected<std::unique_ptr<FlightLog>> create(const std::filesystem::path& path,
                                                                       const std::string& vehicle);
  FlightLog(const FlightLog&) = delete;
  FlightLog& operator=(const FlightLog&) = delete;

  /// Times must not go backward.
  template <class Message>
  void publish(Message& message, TimePoint time) {
    move_to(time);
    std::get<rt::Publisher<Message>>(publishers_).publish(message, time);
  }

  /// For what publishes by itself; call move_to() before it does.
  [[nodiscard]] rt::Node& node() { return node_; }
  void move_to(TimePoint time);

  /// Counts input that is not imported.
  void leave_out(const std::string& reason) { ++left_out_[reason]; }

  /// Gives the log its name; before this, or after a failure, there is none. A log without a message other
  /// than truth is a failure.
  [[nodiscard]] rt::Expected<LogSummary> commit();

 private:
  FlightLog(std::unique_ptr<rt::LogWriter> writer, const std::filesystem::path& path,
            const std::string& vehicle);

  std::string path_;
  std::unique_ptr<rt::LogWriter> writer_;
  rt::ManualClock clock_;
  rt::Log log_{kProducer, rt::LogLevel::kError};
  rt::Node node_;
  std::tuple<rt::Publisher<imu_t>, rt::Publisher<esc_status_t>, rt::Publisher<rotor_command_t>,
             rt::Publisher<attitude_t>, rt::Publisher<attitude_setpoint_t>, rt::Publisher<flight_state_t>,
             rt::Publisher<ground_truth_t>>
      publishers_;
  std::map<std::string, std::int64_t> left_out_;
  bool has_time_ = false;
  TimePoint start_;
};

}  // namespace airworthy::importer
