// A hostile or broken network may send anything: no crash, no undefined behaviour, bounded memory.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/gateway/health/health_bench.h"

namespace airworthy::health {
namespace {

class Chaos {
 public:
  explicit Chaos(std::uint64_t seed) : random_{seed} {}

  int pick(int n) { return std::uniform_int_distribution<int>{0, n - 1}(random_); }
  std::int64_t number() {
    switch (pick(4)) {
      case 0:
        return std::numeric_limits<std::int64_t>::min();
      case 1:
        return std::numeric_limits<std::int64_t>::max();
      case 2:
        return static_cast<std::int64_t>(random_());
      default:
        return pick(100);
    }
  }
  TimePoint time(TimePoint now) {
    return pick(3) == 0 ? from_us(number()) : now + Duration{pick(100'000) - 50'000};
  }
  double real() {
    switch (pick(5)) {
      case 0:
        return kNaN;
      case 1:
        return std::numeric_limits<double>::infinity();
      case 2:
        return -1e300;
      default:
        return 0.1 * pick(100);
    }
  }
  std::string text(int kinds) {
    if (pick(20) == 0) return {};
    if (pick(50) == 0) return std::string(static_cast<std::size_t>(pick(5000)), static_cast<char>(pick(256)));
    return "name-" + std::to_string(pick(kinds));
  }
  Origin origin(TimePoint now) { return {text(2000), number(), number(), time(now), time(now)}; }
  FaultReport fault(TimePoint now) {
    FaultReport fault;
    fault.origin = origin(now);
    fault.number = number();
    fault.phase = static_cast<FaultPhase>(1 + pick(3));
    fault.detector = text(50);
    fault.component = text(2000);
    fault.fault_kind = text(5);
    fault.severity = static_cast<Severity>(1 + pick(3));
    fault.latched = pick(2) == 0;
    fault.probability = real();
    fault.magnitude = real();
    fault.magnitude_sigma = real();
    fault.onset = time(now);
    fault.detected = time(now);
    fault.candidates.assign(static_cast<std::size_t>(pick(20)), text(100));
    fault.evidence.assign(static_cast<std::size_t>(pick(20)), {text(10), real(), text(10)});
    return fault;
  }
  Input input(TimePoint now) {
    switch (pick(4)) {
      case 0:
        return ProcessSign{origin(now), static_cast<ProcessState>(pick(4)), text(100)};
      case 1:
        return LinkReport{origin(now), text(500), pick(2) == 0, text(100), real()};
      case 2:
        return fault(now);
      default:
        break;
    }
    DetectorReport report;
    report.origin = origin(now);
    report.detector = text(50);
    report.state = static_cast<DetectorState>(pick(4));
    report.muted_reason = text(100);
    for (int i = pick(100); i > 0; --i) report.components.push_back({text(2000), pick(2) == 0, text(100)});
    for (int i = pick(5); i > 0; --i) report.active.push_back(fault(now));
    return report;
  }

 private:
  std::mt19937_64 random_;
};

TEST(Flood, AHundredThousandRandomMessages) {
  constexpr int kMessages = 100'000;
  HealthConfig config;
  config.expected_processes = {"airworthy-response"};
  const HealthLimits limits = config.limits;
  Bench bench{config};
  Chaos chaos{20260101};
  for (int i = 0; i < kMessages; ++i) {
    bench.model.add(chaos.input(bench.now));
    ASSERT_LE(bench.model.queued(), limits.queued_items);
    if (i % 200 != 0) continue;
    if (chaos.pick(50) == 0) {
      (void)bench.model.tick(chaos.time(bench.now));  // and a tick of nobody's
      continue;
    }
    const HealthSnapshot& snapshot = bench.step();
    ASSERT_LE(bench.model.faults().active_count(), limits.active_faults);
    ASSERT_LE(bench.model.faults().cleared_count(), limits.cleared_faults);
    ASSERT_LE(snapshot.processes.size(), limits.processes);
    ASSERT_LE(snapshot.links.size(), limits.links);
    ASSERT_LE(snapshot.components.size(), limits.components);
    ASSERT_LE(snapshot.faults.size(), limits.active_faults);
    for (const ComponentHealth& component : snapshot.components) {
      ASSERT_LE(component.component.size(), limits.name_bytes);
      ASSERT_LE(component.reasons.size(), limits.reasons_per_component);
    }
  }
  const HealthCounters& counters = bench.model.counters();
  EXPECT_EQ(counters.messages, kMessages);
  EXPECT_GT(counters.refused_table_full, 0);
  EXPECT_GT(counters.refused_unnamed, 0);
  EXPECT_GT(counters.refused_queue_full, 0);
  EXPECT_GT(counters.foreign_clock, 0);
  EXPECT_GT(counters.cut_lists, 0);

  // And it still does its work.
  Speaker response{"airworthy-response", 77};
  (void)bench.model.tick(bench.now);
  for (int i = 0; i < 100; ++i) {
    bench.model.add(response.sign(bench.now + Duration{1}));
    bench.step();
  }
  ASSERT_NE(bench.process("airworthy-response"), nullptr);
  EXPECT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kRunning);
}

TEST(Flood, ALoudProducerDoesNotCrowdOutAQuietOne) {
  Bench bench;
  Speaker loud{"loud"};
  Speaker quiet{"quiet"};
  for (int i = 0; i < 100'000; ++i) bench.model.add(loud.sign(bench.now + Duration{i % 1000}));
  bench.model.add(quiet.sign(bench.now + Duration{5}));
  bench.step();
  bench.step();
  EXPECT_NE(bench.process("quiet"), nullptr);
  EXPECT_GT(bench.model.counters().refused_queue_full, 90'000);
}

}  // namespace
}  // namespace airworthy::health
