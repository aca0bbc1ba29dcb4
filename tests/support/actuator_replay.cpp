// Runs the actuator detector over a recording on message time and prints what it raised, one JSON object a line; the last
// line tells how long it judged. For tools/evidence.
#include <fmt/format.h>

#include <cstdio>
#include <string>

#include "runtime/bus/channels.h"
#include "runtime/bus/log_bus.h"
#include "runtime/process/exit.h"
#include "services/actuator/actuator_service.h"

namespace airworthy {
namespace {

int replay(const std::string& log_path, const actuator::ActuatorConfig& config) {
  auto bus = rt::LogBus::open(log_path);
  if (!bus) return rt::fail(1, bus.error());
  rt::ManualClock clock;
  rt::Log log{"actuator_replay", rt::LogLevel::kError};
  rt::Node observer{**bus, clock, log, {config.vehicle, "actuator_replay", 1}};
  observer.subscribe<fault_event_t>(channel::kFaultEvent, [](const fault_event_t& event) {
    if (event.phase != 1) return;
    fmt::print("{{\"time_us\": {}, \"component\": \"{}\", \"magnitude\": {:.3f}}}\n", event.header.time_us,
               event.component, event.magnitude);
  });
  std::int64_t truth_us = -1;
  observer.subscribe<ground_truth_t>(channel::kGroundTruth,
                                     [&](const ground_truth_t& truth) { truth_us = truth.onset_us; });
  std::int64_t judged = 0;
  std::int64_t states = 0;
  observer.subscribe<actuator_state_t>(channel::kActuatorState, [&](const actuator_state_t& state) {
    ++states;
    judged += state.rotor_judged[0];
  });
  rt::Node node{**bus, clock, log, {config.vehicle, "airworthy-actuator", 1}};
  actuator::ActuatorService service{node, config};
  const auto played = (*bus)->play(clock, [&](std::string_view name) {
    for (const rt::ChannelInfo& info : channel::kAll) {
      if (name == observer.full_name(info)) return info.role != rt::Role::kDerived;
    }
    return false;
  });
  if (!played) return rt::fail(1, played.error());
  fmt::print("{{\"onset_us\": {}, \"judged_s\": {:.2f}}}\n", truth_us,
             static_cast<double>(judged) * to_seconds(config.state_period));
  return 0;
}

}  // namespace
}  // namespace airworthy

int main(int argc, char** argv) {
  using namespace airworthy;
  if (argc < 3) {
    std::fputs("usage: actuator_replay LOG CONFIG [KEY=VALUE ...]\n", stderr);
    return 64;
  }
  const auto config = actuator::ActuatorConfig::load(argv[2], {argv + 3, argv + argc});
  if (!config) return rt::fail(78, config.error());
  return replay(argv[1], *config);
}
