#include "gateway/gateway_service.h"

#include <utility>

#include "airworthy/driver_status_t.hpp"
#include "airworthy/process_status_t.hpp"
#include "gateway/feed/health_json.h"
#include "gateway/health/input_limits.h"
#include "gateway/message_conversion.h"
#include "runtime/bus/channels.h"

namespace airworthy::gateway {

GatewayService::GatewayService(rt::Node& node, const GatewayConfig& config, FeedPublisher& feed,
                               TickSource ticks, bool wall_time_known)
    : node_{node},
      model_{config.health},
      feed_{feed},
      wall_time_known_{wall_time_known},
      ticks_{node.advertise(channel::kTick)},
      health_{node.advertise(channel::kVehicleHealth)} {
  if (config.multirotor) flight_phase_.emplace(node, *config.multirotor);
  node.subscribe<process_status_t>(channel::kProcessStatus, [this](const process_status_t& message) {
    add(message, "PROCESS_STATUS.meaningless");
  });
  node.subscribe<driver_status_t>(channel::kDriverStatus, [this](const driver_status_t& message) {
    add(message, "DRIVER_STATUS.meaningless");
  });
  node.subscribe<fault_event_t>(channel::kFaultEvent,
                                [this](const fault_event_t& message) { on_fault_event(message); });
  node.subscribe<detector_status_t>(
      channel::kDetectorStatus, [this](const detector_status_t& message) { on_detector_status(message); });
  if (ticks == TickSource::kBus) {
    node.subscribe<tick_t>(channel::kTick,
                           [this](const tick_t& message) { on_tick(from_us(message.header.time_us)); });
  } else {
    node.every(kTickPeriod, [this](TimePoint now) {
      tick_t tick{};
      ticks_.publish(tick, now);
      on_tick(now);
    });
  }
}

template <class Message>
void GatewayService::add(const Message& message, const char* rejected_counter) {
  if (auto input = to_input(message)) {
    model_.add(std::move(*input));
  } else {
    node_.counters().add(rejected_counter);
  }
}

void GatewayService::on_fault_event(const fault_event_t& message) {
  add(message, "FAULT_EVENT.meaningless");
  forward(message, false);
}

void GatewayService::on_detector_status(const detector_status_t& message) {
  add(message, "DETECTOR_STATUS.meaningless");
  for (const fault_event_t& event : message.recent) forward(event, true);
}

void GatewayService::forward(const fault_event_t& message, bool recovered) {
  auto event = to_input(message);
  if (!event) return;
  health::Input input{std::move(*event)};
  health::HealthCounters cut;  // the model counts what it cuts from the same message
  health::bound_input(input, model_.config().limits, cut);
  const auto& fault = std::get<health::FaultReport>(input);
  if (fault.origin.producer.empty() || !events_.insert(fault)) return;
  node_.counters().add(recovered ? "events_recovered" : "events_forwarded");

  const FeedTime time = feed_time();
  nlohmann::json body{{"event", to_json(fault, time)}, {"recovered", recovered}};
  time.write(body, "time", node_.clock().now());
  feed_.publish("event", std::move(body));
  if (fault.phase == health::FaultPhase::kUpdate) return;
  node_.log().info("fault_event", {{"phase", to_word(fault.phase)},
                                   {"component", fault.component},
                                   {"kind", fault.fault_kind},
                                   {"severity", to_word(fault.severity)},
                                   {"producer", fault.origin.producer}});
}

void GatewayService::on_tick(TimePoint tick) {
  auto snapshot = model_.tick(tick);
  if (!snapshot) return;
  if (flight_phase_) {
    // As of the time the snapshot tells, so that what was measured by then has had time to arrive.
    const Phase phase = flight_phase_->advance_to(snapshot->time).phase();
    snapshot->flight_phase = name_of(phase);
    snapshot->changed = snapshot->changed || phase != told_phase_;
    told_phase_ = phase;
  }
  // Ticks come a little early and late; and a replay that starts over has its past in the future.
  const bool due = !last_published_ || tick - *last_published_ >= kHealthPeriod - kTickPeriod / 2 ||
                   tick < *last_published_;
  if (!due && !snapshot->changed) return;
  last_published_ = tick;
  publish(*snapshot);
}

void GatewayService::publish(const health::HealthSnapshot& snapshot) {
  vehicle_health_t message = to_message(snapshot);
  health_.publish(message, snapshot.time);
  feed_.publish("health", to_json(snapshot, feed_time()));
  log_transition(snapshot);
  copy_counters();
}

void GatewayService::log_transition(const health::HealthSnapshot& snapshot) {
  if (logged_status_ == snapshot.status && logged_root_cause_ == snapshot.root_cause) return;
  logged_status_ = snapshot.status;
  logged_root_cause_ = snapshot.root_cause;
  node_.log().info("vehicle_health", {{"status", to_word(snapshot.status)},
                                      {"root_cause", snapshot.root_cause},
                                      {"advice", snapshot.advice}});
}

void GatewayService::copy_counters() {
  for (const auto& [name, value] : model_.counters().list()) {
    node_.counters()["health." + std::string{name}] = value;
  }
  node_.counters()["feed.sent"] = feed_.sent();
  node_.counters()["feed.failed"] = feed_.failed();
}

FeedTime GatewayService::feed_time() {
  if (!wall_time_known_) return FeedTime{std::nullopt};
  return FeedTime{wall_clock_.utc_offset_us(node_.clock().now())};
}

}  // namespace airworthy::gateway
