#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/gateway/health/health_bench.h"

namespace airworthy::health {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr auto kMonitoring = DetectorState::kMonitoring;

/// A detector process that reports about the rotors.
class ComponentHealthTest : public ::testing::Test {
 protected:
  void settle() {
    bench.step();
    bench.step();
  }
  void report(DetectorState state, std::vector<Assessment> components, std::vector<FaultReport> active = {}) {
    bench.model.add(response.sign(bench.now + Duration{1}));
    bench.model.add(
        response.verdict(bench.now + Duration{9}, state, std::move(components), std::move(active)));
    settle();
  }

  Bench bench;
  Speaker response{"airworthy-response"};
};

TEST_F(ComponentHealthTest, NothingHeardIsUnknown) {
  bench.run_to(at_s(1));
  EXPECT_EQ(bench.snapshot.status, Status::kUnknown);
  EXPECT_THAT(bench.snapshot.components, IsEmpty());
}

TEST_F(ComponentHealthTest, JudgedWithoutAFaultIsOk) {
  report(kMonitoring, {{"rotor 1", true, ""}});
  ASSERT_NE(bench.component("rotor 1"), nullptr);
  EXPECT_EQ(bench.component("rotor 1")->status, Status::kOk);
  EXPECT_THAT(bench.component("rotor 1")->reasons, IsEmpty());
  EXPECT_EQ(bench.component("rotor 1")->advice, "");
  EXPECT_EQ(bench.snapshot.status, Status::kOk);
  EXPECT_EQ(bench.snapshot.root_cause, "");
}

TEST_F(ComponentHealthTest, WhereNobodyLooksItIsUnknownWithTheReason) {
  report(DetectorState::kConverging, {{"rotor 1", true, ""}});
  EXPECT_EQ(bench.component("rotor 1")->status, Status::kUnknown);
  EXPECT_THAT(bench.component("rotor 1")->reasons, ElementsAre("airworthy-response.detector is converging"));
  EXPECT_EQ(bench.snapshot.status, Status::kUnknown);
  report(DetectorState::kInitialising, {{"rotor 1", true, ""}});
  EXPECT_THAT(bench.component("rotor 1")->reasons,
              ElementsAre("airworthy-response.detector is initialising"));
  report(DetectorState::kMuted, {{"rotor 1", true, ""}});
  EXPECT_THAT(bench.component("rotor 1")->reasons,
              ElementsAre("airworthy-response.detector is muted: on ground"));
  report(kMonitoring, {{"rotor 1", false, "input stale"}, {"rotor 2", true, ""}});
  EXPECT_EQ(bench.component("rotor 1")->status, Status::kUnknown);
  EXPECT_THAT(bench.component("rotor 1")->reasons, ElementsAre("airworthy-response.detector: input stale"));
  EXPECT_EQ(bench.component("rotor 2")->status, Status::kOk);
  EXPECT_EQ(bench.snapshot.status, Status::kUnknown) << "one unknown part makes no healthy vehicle";
}

TEST_F(ComponentHealthTest, OneOfTwoDetectorsIsEnoughToBeOk) {
  Speaker limits{"airworthy-limits"};
  report(DetectorState::kConverging, {{"rotor 1", true, ""}});
  bench.model.add(limits.verdict(bench.now + Duration{1}, kMonitoring, {{"rotor 1", true, ""}}));
  settle();
  EXPECT_EQ(bench.component("rotor 1")->status, Status::kOk);
}

TEST_F(ComponentHealthTest, SilenceIsNeverHealth) {
  report(kMonitoring, {{"rotor 1", true, ""}});
  ASSERT_EQ(bench.component("rotor 1")->status, Status::kOk);
  const TimePoint silent = bench.now;
  while (bench.component("rotor 1")->status == Status::kOk) {
    bench.step();
    ASSERT_LT(bench.now - silent, Duration{1'000'000});
  }
  EXPECT_EQ(bench.component("rotor 1")->status, Status::kUnknown);
  EXPECT_THAT(bench.component("rotor 1")->reasons, ElementsAre("airworthy-response is missing"));
}

TEST_F(ComponentHealthTest, ADetectorThatHangsInALivingProcessIsFound) {
  report(kMonitoring, {{"rotor 1", true, ""}});
  const TimePoint hung = bench.now;
  while (bench.component("rotor 1")->status == Status::kOk) {
    bench.model.add(response.sign(bench.now + Duration{1}));
    bench.step();
    ASSERT_LT(bench.now - hung, Duration{1'700'000});
  }
  EXPECT_THAT(bench.component("rotor 1")->reasons,
              ElementsAre("airworthy-response.detector does not report any more"));
  EXPECT_GT(bench.now - hung, Duration{1'400'000});
}

TEST_F(ComponentHealthTest, ADetectorThatWasStoppedOnPurposeSaysSo) {
  report(kMonitoring, {{"rotor 1", true, ""}});
  bench.model.add(response.sign(bench.now + Duration{1}, ProcessState::kStopping));
  settle();
  EXPECT_EQ(bench.component("rotor 1")->status, Status::kUnknown);
  EXPECT_THAT(bench.component("rotor 1")->reasons, ElementsAre("airworthy-response was stopped"));
}

TEST_F(ComponentHealthTest, ARestartedProcessMustJudgeAnew) {
  report(kMonitoring, {{"rotor 1", true, ""}, {"rotor 2", true, ""}});
  response.restart(2);
  bench.model.add(response.sign(bench.now + Duration{1}));
  settle();
  EXPECT_EQ(bench.component("rotor 1")->status, Status::kUnknown);
  EXPECT_THAT(bench.component("rotor 1")->reasons,
              ElementsAre("airworthy-response restarted and has not judged it yet"));
  report(kMonitoring, {{"rotor 1", true, ""}});
  EXPECT_EQ(bench.component("rotor 1")->status, Status::kOk);
  EXPECT_EQ(bench.component("rotor 2"), nullptr) << "no longer one of its components";
}

TEST_F(ComponentHealthTest, SeverityDecidesStatusAndAdvice) {
  struct Case {
    Severity severity;
    Status status;
    const char* advice;
  };
  std::int64_t number = 1;
  for (const Case& c : {Case{Severity::kAdvisory, Status::kDegraded, "Check after landing."},
                        Case{Severity::kCaution, Status::kDegraded, "Return."},
                        Case{Severity::kWarning, Status::kFailed, "Land now."}}) {
    const TimePoint sent = bench.now + Duration{2};
    bench.model.add(response.sign(sent));
    bench.model.add(response.fault(sent, number++, FaultPhase::kRaise, c.severity, "rotor 2"));
    settle();
    EXPECT_EQ(bench.component("rotor 2")->status, c.status);
    EXPECT_EQ(bench.component("rotor 2")->advice, c.advice);
    EXPECT_EQ(bench.snapshot.status, c.status);
    EXPECT_EQ(bench.snapshot.advice, c.advice);
    EXPECT_EQ(bench.snapshot.root_cause, "rotor 2");
  }
  EXPECT_EQ(bench.snapshot.faults.front().report.severity, Severity::kWarning) << "worst first";
}

TEST_F(ComponentHealthTest, SinceIsTheDetectionAndThenTheEscalation) {
  const TimePoint raised = bench.now + Duration{2};
  bench.model.add(response.fault(raised, 1, FaultPhase::kRaise, Severity::kCaution, "rotor 2"));
  settle();
  EXPECT_EQ(bench.component("rotor 2")->since, raised);
  bench.run_to(at_s(1));
  EXPECT_EQ(bench.component("rotor 2")->since, raised);
  FaultReport update =
      response.fault(bench.now + Duration{2}, 1, FaultPhase::kUpdate, Severity::kWarning, "rotor 2");
  update.detected = raised;
  bench.model.add(update);
  settle();
  EXPECT_EQ(bench.component("rotor 2")->status, Status::kFailed);
  EXPECT_EQ(bench.component("rotor 2")->since, bench.snapshot.time);
}

TEST_F(ComponentHealthTest, AgreeingDetectorsMakeOneEntryWithSeveralReasons) {
  Speaker unbalance{"airworthy-unbalance"};
  bench.model.add(
      response.fault(bench.now + Duration{1}, 1, FaultPhase::kRaise, Severity::kWarning, "rotor 2"));
  bench.model.add(
      unbalance.fault(bench.now + Duration{2}, 1, FaultPhase::kRaise, Severity::kCaution, "rotor 2"));
  settle();
  EXPECT_EQ(bench.snapshot.components.size(), 1U);
  EXPECT_THAT(bench.component("rotor 2")->reasons,
              ElementsAre(HasSubstr("airworthy-response"), HasSubstr("airworthy-unbalance")));
  EXPECT_EQ(bench.component("rotor 2")->status, Status::kFailed);
}

TEST_F(ComponentHealthTest, ACandidateIsNotCalledHealthy) {
  FaultReport fault =
      response.fault(bench.now + Duration{1}, 1, FaultPhase::kRaise, Severity::kCaution, "rotor 2");
  fault.candidates = {"rotor 2", "rotor 3"};
  bench.model.add(fault);
  report(kMonitoring, {{"rotor 1", true, ""}, {"rotor 2", true, ""}, {"rotor 3", true, ""}}, {fault});
  EXPECT_EQ(bench.component("rotor 1")->status, Status::kOk);
  EXPECT_EQ(bench.component("rotor 2")->status, Status::kDegraded);
  EXPECT_EQ(bench.component("rotor 3")->status, Status::kUnknown);
  EXPECT_THAT(bench.component("rotor 3")->reasons, ElementsAre(HasSubstr("cannot tell them apart")));
}

TEST_F(ComponentHealthTest, TellsAChangeOnceAndAtOnce) {
  report(kMonitoring, {{"rotor 1", true, ""}});
  bench.step();
  EXPECT_FALSE(bench.snapshot.changed);
  const FaultReport raise =
      response.fault(bench.now + Duration{1}, 1, FaultPhase::kRaise, Severity::kWarning, "rotor 1");
  bench.model.add(raise);
  bench.step();
  EXPECT_FALSE(bench.snapshot.changed) << "the first tick after it only closes the period it came in";
  bench.step();
  EXPECT_TRUE(bench.snapshot.changed);
  bench.step();
  EXPECT_FALSE(bench.snapshot.changed);
  FaultReport update = raise;
  update.phase = FaultPhase::kUpdate;
  update.origin = response.origin(bench.now + Duration{1}, 2);
  update.magnitude = 0.3;
  bench.model.add(update);
  settle();
  EXPECT_FALSE(bench.snapshot.changed) << "a magnitude waits for the next regular publication";
  EXPECT_EQ(bench.snapshot.faults.front().report.magnitude, 0.3);
}

}  // namespace
}  // namespace airworthy::health
