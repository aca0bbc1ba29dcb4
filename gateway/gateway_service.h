#pragma once

#include <cstdint>
#include <optional>

#include "airworthy/detector_status_t.hpp"
#include "airworthy/fault_event_t.hpp"
#include "airworthy/tick_t.hpp"
#include "airworthy/vehicle_health_t.hpp"
#include "gateway/event_memory.h"
#include "gateway/feed/feed_publisher.h"
#include "gateway/feed/feed_time.h"
#include "gateway/gateway_config.h"
#include "gateway/health/health_model.h"
#include "runtime/phase/flight_phase_input.h"
#include "runtime/process/node.h"

namespace airworthy::gateway {

/// Where the ticks come from on which every deadline is judged.
enum class TickSource : std::uint8_t {
  kOwn,  ///< this process is the vehicle's clock: publishes TICK at 20 Hz
  kBus   ///< recorded ticks, played back
};

/// Moves messages between bus, health model and feed. No judgement of its own.
class GatewayService {
 public:
  static constexpr Duration kTickPeriod{50'000};
  static constexpr Duration kHealthPeriod{200'000};

  /// `wall_time_known`: vehicle time is this computer's, at its own pace, so that UTC can be told.
  GatewayService(rt::Node& node, const GatewayConfig& config, FeedPublisher& feed, TickSource ticks,
                 bool wall_time_known);
  GatewayService(const GatewayService&) = delete;
  GatewayService& operator=(const GatewayService&) = delete;

 private:
  template <class Message>
  void add(const Message& message, const char* rejected_counter);
  void on_tick(TimePoint tick);
  void on_fault_event(const fault_event_t& message);
  void on_detector_status(const detector_status_t& message);
  void forward(const fault_event_t& message, bool recovered);
  void publish(const health::HealthSnapshot& snapshot);
  void log_transition(const health::HealthSnapshot& snapshot);
  void copy_counters();
  [[nodiscard]] FeedTime feed_time();

  rt::Node& node_;
  health::HealthModel model_;
  std::optional<rt::FlightPhaseInput> flight_phase_;  ///< of a multirotor that the vehicle file describes
  FeedPublisher& feed_;
  bool wall_time_known_;
  WallClock wall_clock_;
  rt::Publisher<tick_t> ticks_;
  rt::Publisher<vehicle_health_t> health_;
  EventMemory events_;
  Phase told_phase_ = Phase::kUnknown;
  std::optional<TimePoint> last_published_;
  std::optional<health::Status> logged_status_;
  std::string logged_root_cause_;
};

}  // namespace airworthy::gateway
