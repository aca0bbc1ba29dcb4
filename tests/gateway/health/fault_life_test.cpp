#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/gateway/health/health_bench.h"

namespace airworthy::health {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr auto kMonitoring = DetectorState::kMonitoring;
constexpr auto kRaise = FaultPhase::kRaise;
constexpr auto kUpdate = FaultPhase::kUpdate;
constexpr auto kClear = FaultPhase::kClear;
constexpr auto kCaution = Severity::kCaution;
constexpr auto kWarning = Severity::kWarning;
const std::vector<Assessment> kLooks{{"rotor 2", true, ""}};

class FaultLifeTest : public ::testing::Test {
 protected:
  /// What was added so far takes effect.
  void settle() {
    bench.step();
    bench.step();
  }
  TimePoint soon() { return bench.now + Duration{++micro}; }

  Bench bench;
  Speaker response{"airworthy-response"};
  std::int64_t micro{};
};

TEST_F(FaultLifeTest, RaiseUpdateClear) {
  bench.model.add(response.fault(soon(), 1, kRaise, kCaution, "rotor 2"));
  settle();
  ASSERT_THAT(bench.snapshot.faults, SizeIs(1));
  bench.model.add(response.fault(soon(), 1, kUpdate, kWarning, "rotor 2"));
  settle();
  ASSERT_THAT(bench.snapshot.faults, SizeIs(1));
  EXPECT_EQ(bench.snapshot.faults[0].report.severity, kWarning);
  bench.model.add(response.fault(soon(), 1, kClear, kWarning, "rotor 2"));
  settle();
  EXPECT_THAT(bench.snapshot.faults, IsEmpty());
}

TEST_F(FaultLifeTest, DuplicatesChangeNothing) {
  const FaultReport raise = response.fault(soon(), 1, kRaise, kWarning, "rotor 2");
  const FaultReport clear = response.fault(soon(), 1, kClear, kWarning, "rotor 2");
  for (int i = 0; i < 3; ++i) bench.model.add(raise);
  settle();
  EXPECT_THAT(bench.snapshot.faults, SizeIs(1));
  for (int i = 0; i < 3; ++i) bench.model.add(clear);
  settle();
  EXPECT_THAT(bench.snapshot.faults, IsEmpty());
  bench.model.add(raise);  // overtaken by its clear
  settle();
  EXPECT_THAT(bench.snapshot.faults, IsEmpty());
}

TEST_F(FaultLifeTest, AClearThatOvertookItsRaiseIsRemembered) {
  const FaultReport raise = response.fault(soon(), 1, kRaise, kWarning, "rotor 2");
  bench.model.add(response.fault(soon(), 1, kClear, kWarning, "rotor 2"));
  settle();
  bench.model.add(raise);
  settle();
  EXPECT_THAT(bench.snapshot.faults, IsEmpty());
}

TEST_F(FaultLifeTest, AnUpdateOvertakenByANewerOneDoesNotCount) {
  const FaultReport raise = response.fault(soon(), 1, kRaise, kCaution, "rotor 2");
  const FaultReport first = response.fault(soon(), 1, kUpdate, kCaution, "rotor 2");
  const FaultReport second = response.fault(soon(), 1, kUpdate, kWarning, "rotor 2");
  bench.model.add(raise);
  bench.model.add(second);
  settle();
  bench.model.add(first);
  settle();
  EXPECT_EQ(bench.snapshot.faults.at(0).report.severity, kWarning);
}

TEST_F(FaultLifeTest, EventsOfOneInstantFollowTheirNumbers) {
  const TimePoint sent = soon();  // a process on the tick clock stamps many messages alike
  const FaultReport raise = response.fault(sent, 1, kRaise, kWarning, "rotor 2");
  const FaultReport clear = response.fault(sent, 1, kClear, kWarning, "rotor 2");
  bench.model.add(clear);
  bench.model.add(raise);
  settle();
  EXPECT_THAT(bench.snapshot.faults, IsEmpty());
}

TEST_F(FaultLifeTest, ALostRaiseIsHealedByTheStatus) {
  const FaultReport lost = response.fault(soon(), 1, kRaise, kWarning, "rotor 2");
  bench.model.add(response.verdict(soon(), kMonitoring, kLooks, {lost}));
  settle();
  ASSERT_THAT(bench.snapshot.faults, SizeIs(1));
  EXPECT_EQ(bench.snapshot.faults[0].report.detected, lost.detected);
  EXPECT_EQ(bench.model.counters().raised_by_status, 1);
  bench.model.add(lost);
  settle();
  EXPECT_THAT(bench.snapshot.faults, SizeIs(1)) << "the late event is the same fault";
}

TEST_F(FaultLifeTest, ALostClearIsHealedByTheStatus) {
  bench.model.add(response.fault(soon(), 1, kRaise, kWarning, "rotor 2"));
  settle();
  bench.model.add(response.verdict(soon(), kMonitoring, kLooks));
  settle();
  EXPECT_THAT(bench.snapshot.faults, IsEmpty());
  EXPECT_EQ(bench.component("rotor 2")->status, Status::kOk);
  EXPECT_EQ(bench.model.counters().cleared_by_status, 1);
}

TEST_F(FaultLifeTest, AStatusSentBeforeTheRaiseDoesNotClear) {
  const DetectorReport before = response.verdict(soon(), kMonitoring, kLooks);
  bench.model.add(response.fault(soon(), 1, kRaise, kWarning, "rotor 2"));
  settle();
  bench.model.add(before);
  settle();
  EXPECT_THAT(bench.snapshot.faults, SizeIs(1));
}

TEST_F(FaultLifeTest, ARaiseThatComesAfterAStatusWithoutItIsTooLate) {
  const FaultReport late = response.fault(soon(), 1, kRaise, kWarning, "rotor 2");
  bench.model.add(response.verdict(soon(), kMonitoring, kLooks));
  settle();
  bench.model.add(late);
  settle();
  EXPECT_THAT(bench.snapshot.faults, IsEmpty());
}

TEST_F(FaultLifeTest, AStatusOfAnotherDetectorOfTheProcessDoesNotClear) {
  bench.model.add(response.fault(soon(), 1, kRaise, kWarning, "rotor 2"));
  DetectorReport other = response.verdict(soon(), kMonitoring, kLooks);
  other.detector = "another";
  bench.model.add(other);
  settle();
  EXPECT_THAT(bench.snapshot.faults, SizeIs(1));
}

TEST_F(FaultLifeTest, ACutListProvesNothing) {
  bench.model.add(response.fault(soon(), 1, kRaise, kWarning, "rotor 2"));
  std::vector<FaultReport> many;
  for (int i = 2; i < 80; ++i) {
    many.push_back(response.fault(soon(), i, kRaise, Severity::kAdvisory, "rotor 3"));
  }
  bench.model.add(response.verdict(soon(), kMonitoring, kLooks, many));
  settle();
  EXPECT_EQ(bench.model.counters().cut_lists, 1);
  EXPECT_EQ(bench.snapshot.faults.front().report.number, 1);
  EXPECT_THAT(bench.snapshot.faults, SizeIs(1 + 64));
}

TEST_F(FaultLifeTest, ALatchedFaultIsClearedByItsEventOnly) {
  bench.model.add(response.fault(soon(), 1, kRaise, kWarning, "rotor 2", true));
  settle();
  bench.model.add(response.verdict(soon(), kMonitoring, kLooks));
  settle();
  EXPECT_THAT(bench.snapshot.faults, SizeIs(1));
  bench.model.add(response.fault(soon(), 1, kClear, kWarning, "rotor 2", true));
  settle();
  EXPECT_THAT(bench.snapshot.faults, IsEmpty());
}

TEST_F(FaultLifeTest, AfterARestartAFaultIsUnconfirmedUntilJudgedAnew) {
  bench.model.add(response.sign(soon()));
  bench.model.add(response.fault(soon(), 1, kRaise, kWarning, "rotor 2"));
  settle();
  EXPECT_EQ(bench.snapshot.faults.at(0).unconfirmed, "");

  response.restart(2);
  bench.model.add(response.sign(soon()));
  settle();
  EXPECT_THAT(bench.snapshot.faults.at(0).unconfirmed, HasSubstr("restarted"));
  EXPECT_EQ(bench.component("rotor 2")->status, Status::kFailed) << "a restart heals no rotor";
  EXPECT_THAT(bench.component("rotor 2")->reasons.at(0), HasSubstr("unconfirmed"));

  bench.model.add(response.verdict(soon(), DetectorState::kConverging, kLooks));
  settle();
  EXPECT_THAT(bench.snapshot.faults, SizeIs(1));
  bench.model.add(response.verdict(soon(), kMonitoring, {{"rotor 2", false, "not excited"}}));
  settle();
  EXPECT_THAT(bench.snapshot.faults, SizeIs(1));
  bench.model.add(response.verdict(soon(), kMonitoring, {{"rotor 1", true, ""}}));
  settle();
  EXPECT_THAT(bench.snapshot.faults, SizeIs(1)) << "another rotor";
  bench.model.add(response.verdict(soon(), kMonitoring, kLooks));
  settle();
  EXPECT_THAT(bench.snapshot.faults, IsEmpty());
  EXPECT_EQ(bench.component("rotor 2")->status, Status::kOk);
}

TEST_F(FaultLifeTest, AfterARestartALatchedFaultStays) {
  bench.model.add(response.sign(soon()));
  bench.model.add(response.fault(soon(), 1, kRaise, kWarning, "rotor 2", true));
  settle();
  response.restart(2);
  bench.model.add(response.sign(soon()));
  bench.model.add(response.verdict(soon(), kMonitoring, kLooks));
  settle();
  ASSERT_THAT(bench.snapshot.faults, SizeIs(1));
  EXPECT_THAT(bench.snapshot.faults[0].unconfirmed, HasSubstr("latched"));
}

TEST_F(FaultLifeTest, FoundAgainAfterARestartItIsOneFault) {
  bench.model.add(response.sign(soon()));
  bench.model.add(response.fault(soon(), 7, kRaise, kWarning, "rotor 2", true));
  settle();
  response.restart(2);
  const FaultReport again = response.fault(soon(), 1, kRaise, kWarning, "rotor 2", true);
  bench.model.add(again);
  bench.model.add(response.verdict(soon(), kMonitoring, kLooks, {again}));
  settle();
  ASSERT_THAT(bench.snapshot.faults, SizeIs(1));
  EXPECT_EQ(bench.snapshot.faults[0].report.origin.session, 2);
  EXPECT_EQ(bench.snapshot.faults[0].unconfirmed, "");
}

TEST_F(FaultLifeTest, AFaultOfAMissingDetectorStaysAndSaysSo) {
  bench.model.add(response.sign(soon()));
  bench.model.add(response.fault(soon(), 1, kRaise, kWarning, "rotor 2"));
  bench.run_to(at_s(3));
  ASSERT_THAT(bench.snapshot.faults, SizeIs(1));
  EXPECT_EQ(bench.snapshot.faults[0].unconfirmed, "airworthy-response is missing");
  EXPECT_EQ(bench.component("rotor 2")->status, Status::kFailed);
}

TEST_F(FaultLifeTest, AGatewayRestartedInMidFaultKnowsAllWithinASecond) {
  Bench before;
  std::optional<Bench> after;  // starts when the other has run for 10 s
  Speaker mavlink{"airworthy-mavlink", 5};
  FaultReport fault;
  const auto tell = [&](const Input& input) {
    before.model.add(input);
    if (after) after->model.add(input);
  };
  for (int ms = 0; ms < 11'000; ms += 10) {
    const TimePoint t = at_s(ms * 1e-3);
    if (ms % 50 == 0 && ms > 0) {
      before.step();
      if (after) after->step();
    }
    if (ms == 10'000) {
      after.emplace();
      after->now = t;
      (void)after->model.tick(t);  // later than the tick of its making
    }
    if (ms == 4'010) {
      fault = response.fault(t, 1, kRaise, kWarning, "rotor 2");
      tell(fault);
    }
    if (ms % 200 == 10) tell(response.sign(t));
    if (ms % 200 == 110) tell(mavlink.sign(t));
    if (ms % 1000 == 310) tell(mavlink.link(t, true, 0.01));
    if (ms % 500 == 490) {
      const std::vector<Assessment> looks{{"rotor 1", true, ""}, {"rotor 2", true, ""}};
      const bool raised = ms >= 4'010;
      tell(response.verdict(t, kMonitoring, looks, raised ? std::vector{fault} : std::vector<FaultReport>{}));
    }
  }
  ASSERT_EQ(before.snapshot.time, after->snapshot.time);
  EXPECT_EQ(after->component("rotor 1")->status, Status::kOk);
  EXPECT_EQ(after->component("rotor 2")->status, Status::kFailed);
  EXPECT_EQ(after->component("rotor 2")->since, at_s(4.01));
  EXPECT_EQ(after->component("rotor 2")->since, before.component("rotor 2")->since);
  EXPECT_EQ(after->component("rotor 2")->reasons, before.component("rotor 2")->reasons);
  EXPECT_EQ(after->snapshot.root_cause, before.snapshot.root_cause);
  EXPECT_EQ(after->snapshot.links.at(0).status, LinkStatus::kOk);
  EXPECT_EQ(after->process("airworthy-mavlink")->status, ProcessStatus::kRunning);
}

TEST_F(FaultLifeTest, AWarningFindsRoomInAFullTable) {
  HealthConfig config;
  config.limits.active_faults = 4;
  Bench small{config};
  for (int i = 1; i <= 6; ++i) {
    small.model.add(
        response.fault(at_s(0.001 * i), i, kRaise, Severity::kAdvisory, "rotor " + std::to_string(i)));
  }
  small.model.add(response.fault(at_s(0.01), 7, kRaise, kWarning, "engine"));
  small.run_to(at_s(0.2));
  EXPECT_THAT(small.snapshot.faults, SizeIs(4));
  EXPECT_EQ(small.snapshot.faults.front().report.component, "engine");
  EXPECT_EQ(small.model.counters().refused_table_full, 2);
  EXPECT_EQ(small.model.counters().evicted_faults, 1);
}

TEST_F(FaultLifeTest, ADetectionDateThatMeansNothingIsReplaced) {
  FaultReport fault = response.fault(soon(), 1, kRaise, kWarning, "rotor 2");
  fault.detected = at_s(1e6);
  bench.model.add(fault);
  settle();
  EXPECT_LE(bench.component("rotor 2")->since, bench.now);
}

}  // namespace
}  // namespace airworthy::health
