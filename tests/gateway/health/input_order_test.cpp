#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/gateway/health/health_bench.h"
#include "tests/gateway/health/snapshot_text.h"

namespace airworthy::health {
namespace {

struct Said {
  Input input;
  TimePoint sent{};
  TimePoint arrival{};
};

/// A busy vehicle: a driver, detectors whose faults come and go, restarts, pauses, lost and repeated
/// messages.
class Conversation {
 public:
  explicit Conversation(std::uint64_t seed) : random_{seed} {}

  std::vector<Said> run(double duration_s) {
    std::vector<Detector> detectors;
    for (int i = 0; i < 4; ++i) {
      detectors.push_back({Speaker{"detector-" + std::to_string(i)}, 1, 1, {}, 0});
    }
    Speaker driver{"driver"};
    for (int ms = 3; ms < static_cast<int>(duration_s * 1e3); ms += 10) {
      const TimePoint t = at_s(ms * 1e-3);
      for (Detector& detector : detectors) speak(detector, t);
      if (ms % 200 == 3) say(driver.sign(t), t);
      if (ms % 500 == 3) say(driver.link(t, chance(0.9), chance(0.1) ? 5.0 : 0.1), t);
    }
    return said_;
  }

 private:
  struct Detector {
    Speaker speaker;
    std::int64_t session;
    std::int64_t next_number;
    std::vector<FaultReport> active;
    int silent_steps;
  };

  bool chance(double p) { return std::uniform_real_distribution<double>{0, 1}(random_) < p; }
  int pick(int n) { return std::uniform_int_distribution<int>{0, n - 1}(random_); }
  Severity severity() { return static_cast<Severity>(1 + pick(3)); }
  void say(Input input, TimePoint sent) {
    if (!chance(0.05)) said_.push_back({std::move(input), sent, {}});  // else lost
  }

  void speak(Detector& d, TimePoint t) {
    // Some messages of an instant share its time, as they do on the tick clock.
    const TimePoint sent = chance(0.3) ? t : t + Duration{pick(5000)};
    if (chance(0.002)) {
      d.speaker.restart(++d.session);
      d.active.clear();
      d.silent_steps = 1 + pick(120);
    }
    if (d.silent_steps > 0) {
      --d.silent_steps;
      return;
    }
    if (chance(0.05)) {
      say(d.speaker.sign(sent, chance(0.1) ? ProcessState::kDegraded : ProcessState::kRunning), sent);
    }
    if (chance(0.02)) {
      const FaultReport raise = d.speaker.fault(sent, d.next_number++, FaultPhase::kRaise, severity(),
                                                "rotor " + std::to_string(pick(4)), chance(0.1));
      d.active.push_back(raise);
      say(raise, sent);
      if (chance(0.2)) say(raise, sent);
    }
    if (!d.active.empty() && chance(0.03)) change_fault(d, sent);
    if (chance(0.04)) {
      const auto state = chance(0.8) ? DetectorState::kMonitoring : static_cast<DetectorState>(pick(4));
      const std::vector<Assessment> components{{"rotor 0", true, ""},
                                               {"rotor 1", chance(0.5), "not excited"}};
      say(d.speaker.verdict(sent, state, components, d.active), sent);
    }
  }

  void change_fault(Detector& d, TimePoint sent) {
    const auto which = static_cast<std::size_t>(pick(static_cast<int>(d.active.size())));
    FaultReport& fault = d.active[which];
    const bool clear = chance(0.7);
    const FaultReport event =
        d.speaker.fault(sent, fault.number, clear ? FaultPhase::kClear : FaultPhase::kUpdate, severity(),
                        fault.component, fault.latched);
    say(event, sent);
    if (clear) {
      d.active.erase(d.active.begin() + static_cast<std::ptrdiff_t>(which));
    } else {
      fault = event;
    }
  }

  std::mt19937_64 random_;
  std::vector<Said> said_;
};

/// Delivers each message after a delay of up to a whole tick period, in whatever order that gives.
std::string story_of(std::vector<Said> said, std::uint64_t seed, double duration_s) {
  std::mt19937_64 random{seed};
  std::uniform_int_distribution<std::int64_t> delay_us{0, kTickPeriod_us - 1};
  for (Said& message : said) message.arrival = message.sent + Duration{delay_us(random)};
  std::shuffle(said.begin(), said.end(), random);
  std::stable_sort(said.begin(), said.end(),
                   [](const Said& a, const Said& b) { return a.arrival < b.arrival; });
  Bench bench;
  std::string story;
  std::size_t next = 0;
  while (bench.now < at_s(duration_s)) {
    const TimePoint tick = bench.now + Duration{kTickPeriod_us};
    // At its own time the tick comes first, or last: that must not matter either.
    const bool tick_first = random() % 2 == 0;
    while (next < said.size() && (said[next].arrival < tick || (!tick_first && said[next].arrival == tick))) {
      bench.model.add(said[next++].input);
    }
    story += text_of(bench.step());
  }
  return story;
}

TEST(InputOrder, ShufflingWithinATickPeriodChangesNothing) {
  int with_faults = 0;
  int with_restarts = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const std::vector<Said> said = Conversation{seed}.run(8.0);
    const std::string first = story_of(said, 1000 + seed, 8.0);
    if (first.find("  fault ") != std::string::npos) ++with_faults;
    if (first.find("restarted") != std::string::npos) ++with_restarts;
    for (std::uint64_t order = 1; order <= 4; ++order) {
      ASSERT_EQ(first, story_of(said, 2000 * order + seed, 8.0));
    }
  }
  EXPECT_EQ(with_faults, 24) << "the conversations must have something to say";
  EXPECT_GE(with_restarts, 12);
}

TEST(InputOrder, AMessageHasAWholeTickPeriodToArrive) {
  Speaker speaker{"p"};
  const HealthConfig config;
  InputQueue queue{config};
  HealthCounters counters;
  queue.push(speaker.sign(at_s(0.05)), counters);      // exactly at the tick before
  queue.push(speaker.sign(at_s(0.050001)), counters);  // just after it
  EXPECT_EQ(queue.take(at_s(0.05), at_s(0.10), counters).size(), 1U);
  EXPECT_EQ(queue.size(), 1U);
  EXPECT_EQ(queue.take(at_s(0.10), at_s(0.15), counters).size(), 1U);
  EXPECT_EQ(counters.foreign_clock, 0);
}

TEST(InputOrder, OneInstantIsOrderedByProducerThenKindThenNumber) {
  const HealthConfig config;
  InputQueue queue{config};
  HealthCounters counters;
  Speaker a{"a"};
  Speaker b{"b"};
  const TimePoint t = at_s(0.01);
  const FaultReport first = a.fault(t, 1, FaultPhase::kRaise, Severity::kWarning, "x");
  const FaultReport second = a.fault(t, 2, FaultPhase::kRaise, Severity::kWarning, "y");
  queue.push(b.sign(t), counters);
  queue.push(a.verdict(t, DetectorState::kMonitoring, {}), counters);
  queue.push(second, counters);
  queue.push(first, counters);
  queue.push(a.sign(t), counters);
  const auto released = queue.take(at_s(0.05), at_s(0.1), counters);
  ASSERT_EQ(released.size(), 5U);
  EXPECT_TRUE(std::holds_alternative<ProcessSign>(released[0].input));
  EXPECT_EQ(std::get<FaultReport>(released[1].input).number, 1);
  EXPECT_EQ(std::get<FaultReport>(released[2].input).number, 2);
  EXPECT_TRUE(std::holds_alternative<DetectorReport>(released[3].input));
  EXPECT_EQ(origin_of(released[4].input).producer, "b");
}

TEST(InputOrder, ForeignClocksFollowAtOnceInOrderOfArrival) {
  const HealthConfig config;
  InputQueue queue{config};
  HealthCounters counters;
  Speaker recorded{"recorded"};
  Speaker fresh{"fresh"};
  queue.push(fresh.sign(at_s(9000)), counters);
  queue.push(fresh.sign(at_s(-50)), counters);
  queue.push(recorded.sign(at_s(0.01)), counters);
  const auto released = queue.take(at_s(0.05), at_s(0.1), counters);
  ASSERT_EQ(released.size(), 3U);
  EXPECT_FALSE(released[0].foreign_clock);
  EXPECT_TRUE(released[1].foreign_clock);
  EXPECT_EQ(origin_of(released[1].input).sent, at_s(9000));
  EXPECT_EQ(counters.foreign_clock, 2);
}

TEST(InputOrder, WaitingAcrossAPauseOfTheTicksKeepsTheClockOwn) {
  const HealthConfig config;
  InputQueue queue{config};
  HealthCounters counters;
  Speaker speaker{"p"};
  queue.push(speaker.sign(at_s(5)), counters);  // sent and received while no tick came for 10 s
  EXPECT_TRUE(queue.take(at_s(0.05), at_s(10), counters).empty());
  const auto released = queue.take(at_s(10), at_s(10.05), counters);
  ASSERT_EQ(released.size(), 1U);
  EXPECT_FALSE(released[0].foreign_clock);
}

}  // namespace
}  // namespace airworthy::health
