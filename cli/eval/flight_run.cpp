#include "cli/eval/flight_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "cli/eval/status_judgement.h"
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

// A fault, its end (kind none of a component that has one), or that the flight is healthy.
void note_truth(const ground_truth_t& message, Flight& flight) {
  Truth truth{message.component, message.fault_kind, std::nullopt, std::nullopt};
  if (message.onset_us >= 0) truth.onset = from_us(message.onset_us);
  if (!flight.truth || (truth.onset && (!flight.truth->onset || *truth.onset < *flight.truth->onset))) {
    flight.truth = truth;
  }
  if (truth.onset) {
    const auto later = std::upper_bound(flight.faults.begin(), flight.faults.end(), truth,
                                        [](const Truth& a, const Truth& b) { return *a.onset < *b.onset; });
    flight.faults.insert(later, truth);
    return;
  }
  const auto ended = std::find_if(flight.faults.begin(), flight.faults.end(), [&](const Truth& fault) {
    return fault.component == message.component && !fault.end;
  });
  if (ended != flight.faults.end()) ended->end = from_us(message.header.time_us);
}

// What a log has, for those who wonder why nothing was judged: sensors, and numbers of rotors.
class InputNotes {
 public:
  explicit InputNotes(rt::Node& node) {
    node.subscribe<imu_t>(channel::kImu, [this](const imu_t& message) { imu_.insert(message.sensor_id); });
    node.subscribe<esc_status_t>(
        channel::kEscStatus, [this](const esc_status_t& message) { speeds_.insert(message.rotor_count); });
    node.subscribe<rotor_command_t>(channel::kRotorCommand, [this](const rotor_command_t& message) {
      commands_.insert(message.rotor_count);
    });
  }

  [[nodiscard]] std::string text() const {
    std::vector<std::string> all;
    if (!imu_.empty()) all.push_back(fmt::format("IMU of sensor {}", fmt::join(imu_, ", ")));
    if (!speeds_.empty()) all.push_back(fmt::format("speeds of {} rotors", fmt::join(speeds_, ", ")));
    if (!commands_.empty()) all.push_back(fmt::format("commands of {} rotors", fmt::join(commands_, ", ")));
    return fmt::format("{}", fmt::join(all, ", "));
  }

 private:
  std::set<std::int32_t> imu_;
  std::set<std::int32_t> speeds_;
  std::set<std::int32_t> commands_;
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

  node.subscribe<ground_truth_t>(channel::kGroundTruth,
                                 [&flight](const ground_truth_t& message) { note_truth(message, flight); });
  node.subscribe<fault_event_t>(channel::kFaultEvent, [&flight](const fault_event_t& message) {
    if (message.phase != 1) return;
    flight.alarms.push_back({from_us(message.header.time_us), from_us(message.onset_us), message.component,
                             message.fault_kind, message.magnitude, message.candidates});
  });
  const InputNotes inputs{node};
  StatusJudgement judgement;
  node.subscribe<detector_status_t>(channel::kDetectorStatus,
                                    [&](const detector_status_t& message) { judgement.on_status(message); });
  bool started = false;
  const auto note_time = [&](const auto& message) {
    flight.end = from_us(message.header.time_us);
    if (!started) flight.start = flight.end;
    started = true;
  };
  if (contents->has(node.full_name(channel::kImu.info))) {
    node.subscribe<imu_t>(channel::kImu, note_time);
  } else {
    node.subscribe<attitude_t>(channel::kAttitude, note_time);
  }

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
  flight.judgement = judgement.whole();
  flight.components = judgement.components();
  flight.misfits = judgement.misfits();
  flight.inputs = inputs.text();
  return flight;
}

rt::Expected<void> check_vehicle(const std::string& log, const std::string& vehicle,
                                 const std::string& expected) {
  if (vehicle == expected) return {};
  return rt::fail_with(
      fmt::format("{}: of vehicle \"{}\", not of \"{}\" (--vehicle NAME says whose logs these are)", log,
                  vehicle, expected));
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
