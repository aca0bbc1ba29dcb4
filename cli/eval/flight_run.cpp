#include "cli/eval/flight_run.h"

#include <filesystem>

#include "runtime/bus/channels.h"
#include "runtime/bus/log_bus.h"
#include "runtime/process/node.h"
#include "services/response/response_service.h"

namespace airworthy::eval {
namespace {

constexpr Duration kTickPeriod{50'000};

// The tick grid of a log that has none, as the gateway would have published it.
class TickSource {
 public:
  explicit TickSource(rt::Node& node) : publisher_{node.advertise(channel::kTick)} {
    node.every(kTickPeriod, [this](TimePoint now) {
      tick_t tick{};
      publisher_.publish(tick, now);
    });
  }

 private:
  rt::Publisher<tick_t> publisher_;
};

}  // namespace

rt::Expected<Flight> run_flight(const std::string& log_path, const std::string& process,
                                const MakeDetector& make) {
  const auto contents = rt::LogBus::survey(log_path);
  if (!contents) return tl::unexpected{contents.error()};
  auto bus = rt::LogBus::open(log_path);
  if (!bus) return tl::unexpected{bus.error()};

  Flight flight;
  flight.name = std::filesystem::path{log_path}.stem().string();
  flight.vehicle = contents->vehicle;
  rt::ManualClock clock;
  rt::Log log{"airworthy-eval", rt::LogLevel::kError};
  rt::Node node{**bus, clock, log, {contents->vehicle, "airworthy-eval", 1}};

  node.subscribe<ground_truth_t>(channel::kGroundTruth, [&flight](const ground_truth_t& message) {
    Truth truth{message.component, message.fault_kind, std::nullopt};
    if (message.onset_us >= 0) truth.onset = from_us(message.onset_us);
    if (!flight.truth || (truth.onset && (!flight.truth->onset || *truth.onset < *flight.truth->onset))) {
      flight.truth = truth;
    }
  });
  node.subscribe<fault_event_t>(channel::kFaultEvent, [&flight](const fault_event_t& message) {
    if (message.phase != 1) return;
    flight.alarms.push_back({from_us(message.header.time_us), from_us(message.onset_us), message.component,
                             message.fault_kind, message.magnitude});
  });
  bool started = false;
  node.subscribe<imu_t>(channel::kImu, [&](const imu_t& message) {
    flight.end = from_us(message.header.time_us);
    if (!started) flight.start = flight.end;
    started = true;
  });

  rt::Node detector_node{**bus, clock, log, {contents->vehicle, process, 1}};
  const Detector detector = make(detector_node);
  std::optional<TickSource> ticks;
  if (!contents->has(node.full_name(channel::kTick.info))) ticks.emplace(node);

  const auto played = (*bus)->play(clock, [&node](std::string_view name) {
    for (const rt::ChannelInfo& info : channel::kAll) {
      if (name == node.full_name(info)) return info.role != rt::Role::kDerived;
    }
    return false;
  });
  if (!played) return tl::unexpected{played.error()};
  return flight;
}

rt::Expected<Flight> run_flight(const std::string& log_path, response::ResponseConfig config,
                                TickObserver observer) {
  return run_flight(log_path, "airworthy-response", [&](rt::Node& node) {
    config.vehicle = node.identity().vehicle;
    auto service = std::make_shared<response::ResponseService>(node, config);
    if (observer) service->observe_ticks(observer);
    return service;
  });
}

}  // namespace airworthy::eval
