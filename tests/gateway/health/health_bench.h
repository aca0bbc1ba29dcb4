#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/health/health_model.h"

namespace airworthy::health {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kTickPeriod_us = 50'000;
/// Ticks of the tests start here.
constexpr std::int64_t kStart_us = 100'000'000;

constexpr TimePoint at_s(double seconds) {
  return from_us(kStart_us + static_cast<std::int64_t>(seconds * 1e6 + (seconds < 0 ? -0.5 : 0.5)));
}

/// A process of the tests: stamps its messages as a real one does.
class Speaker {
 public:
  explicit Speaker(std::string name, std::int64_t session = 1) : name_{std::move(name)}, session_{session} {}

  void restart(std::int64_t session) {
    session_ = session;
    next_seq_.clear();
  }

  Origin origin(TimePoint sent, int kind) { return {name_, session_, next_seq_[kind]++, sent, sent}; }

  ProcessSign sign(TimePoint sent, ProcessState state = ProcessState::kRunning, std::string detail = {}) {
    return {origin(sent, 0), state, std::move(detail)};
  }
  LinkReport link(TimePoint sent, bool connected, double seconds_since_data, std::string detail = {}) {
    return {origin(sent, 1), "serial:/dev/ttyAMA0:921600", connected, std::move(detail), seconds_since_data};
  }
  FaultReport fault(TimePoint sent, std::int64_t number, FaultPhase phase, Severity severity,
                    std::string component, bool latched = false) {
    FaultReport fault;
    fault.origin = origin(sent, 2);
    fault.number = number;
    fault.phase = phase;
    fault.detector = name_ + ".detector";
    fault.component = std::move(component);
    fault.fault_kind = "loss_of_effectiveness";
    fault.severity = severity;
    fault.latched = latched;
    fault.probability = 0.99;
    fault.magnitude = 0.4;
    fault.magnitude_sigma = kNaN;
    fault.onset = sent - Duration{100'000};
    fault.detected = sent;
    fault.summary = fault.component + " lost 60 % of its effectiveness";
    return fault;
  }
  DetectorReport verdict(TimePoint sent, DetectorState state, std::vector<Assessment> components,
                         std::vector<FaultReport> active = {}) {
    DetectorReport report;
    report.origin = origin(sent, 3);
    report.detector = name_ + ".detector";
    report.state = state;
    if (state == DetectorState::kMuted) report.muted_reason = "on ground";
    report.components = std::move(components);
    report.active = std::move(active);
    return report;
  }

 private:
  std::string name_;
  std::int64_t session_;
  std::map<int, std::int64_t> next_seq_;
};

/// Moves a model tick by tick.
class Bench {
 public:
  explicit Bench(HealthConfig config = {}) : model{std::move(config)} { (void)model.tick(now); }

  /// One tick.
  const HealthSnapshot& step() {
    now += Duration{kTickPeriod_us};
    if (auto next = model.tick(now)) snapshot = std::move(*next);
    return snapshot;
  }
  /// Until the health as of `time` is known.
  const HealthSnapshot& run_to(TimePoint time) {
    while (now < time + Duration{kTickPeriod_us}) step();
    return snapshot;
  }

  [[nodiscard]] const ComponentHealth* component(const std::string& name) const {
    for (const ComponentHealth& component : snapshot.components) {
      if (component.component == name) return &component;
    }
    return nullptr;
  }
  [[nodiscard]] const ProcessHealth* process(const std::string& name) const {
    for (const ProcessHealth& process : snapshot.processes) {
      if (process.process == name) return &process;
    }
    return nullptr;
  }

  HealthModel model;
  TimePoint now{from_us(kStart_us)};
  HealthSnapshot snapshot;
};

}  // namespace airworthy::health
