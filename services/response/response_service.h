#pragma once

#include <array>
#include <deque>
#include <functional>
#include <optional>

#include "airworthy/attitude_setpoint_t.hpp"
#include "airworthy/attitude_t.hpp"
#include "airworthy/detector_status_t.hpp"
#include "airworthy/fault_event_t.hpp"
#include "airworthy/flight_state_t.hpp"
#include "airworthy/imu_t.hpp"
#include "airworthy/rotor_command_t.hpp"
#include "core/detectors/response/response_monitor.h"
#include "runtime/process/node.h"
#include "services/response/response_config.h"

namespace airworthy::response {

/// Moves messages between the bus and the response monitor. No arithmetic of its own.
class ResponseService {
 public:
  static constexpr Duration kStatusPeriod{500'000};
  static constexpr std::size_t kRecentEvents = 32;

  ResponseService(rt::Node& node, const ResponseConfig& config);

  /// Shows the monitor after each of its ticks, to learn from a recorded flight.
  void observe_ticks(std::function<void(const ResponseMonitor&)> observer) {
    observer_ = std::move(observer);
  }

  ResponseService(const ResponseService&) = delete;
  ResponseService& operator=(const ResponseService&) = delete;

 private:
  void on_imu(const imu_t& message);
  void on_attitude(const attitude_t& message);
  void on_setpoint(const attitude_setpoint_t& message);
  void on_rotor_command(const rotor_command_t& message);
  void on_flight_state(const flight_state_t& message);
  void handle_tick();
  void handle_verdict(std::size_t channel, const ChannelVerdict& verdict);
  void publish_status();

  rt::Node& node_;
  const ResponseConfig& config_;
  ResponseMonitor monitor_;
  rt::Publisher<fault_event_t> events_;
  rt::Publisher<detector_status_t> status_;
  std::array<std::optional<fault_event_t>, kMostChannels> active_;
  std::deque<fault_event_t> recent_;
  std::int64_t next_number_ = 1;
  std::function<void(const ResponseMonitor&)> observer_;
};

}  // namespace airworthy::response
