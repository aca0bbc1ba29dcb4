#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/gateway/health/health_bench.h"

namespace airworthy::health {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr auto kMonitoring = DetectorState::kMonitoring;
constexpr auto kRaise = FaultPhase::kRaise;
const std::string kLink = "link serial:/dev/ttyAMA0:921600";

/// A driver with a link, and a detector that lives on its data.
class RootCauseTest : public ::testing::Test {
 protected:
  explicit RootCauseTest(HealthConfig config = {}) : bench{std::move(config)} {}

  /// Everybody speaks every 100 ms; what driver and detector say of themselves is in the members.
  void run_for(double seconds) {
    const TimePoint end = bench.now + from_seconds(seconds);
    while (bench.now < end) {
      if (mavlink_lives) {
        bench.model.add(mavlink.sign(bench.now + Duration{1}));
        bench.model.add(mavlink.link(bench.now + Duration{2}, connected, data_age_s, detail));
      }
      if (response_lives) {
        bench.model.add(response.sign(bench.now + Duration{3}));
        bench.model.add(response.verdict(bench.now + Duration{4}, kMonitoring,
                                         {{"rotor 1", !stale, stale ? "input stale" : ""}}, active));
      }
      bench.step();
      bench.step();
    }
  }
  void raise(Severity severity, const std::string& component) {
    FaultReport fault = response.fault(bench.now + Duration{1}, static_cast<std::int64_t>(active.size()) + 1,
                                       kRaise, severity, component);
    fault.onset = bench.now;
    active.push_back(fault);
    bench.model.add(fault);
  }

  Bench bench;
  Speaker mavlink{"airworthy-mavlink"};
  Speaker response{"airworthy-response"};
  bool mavlink_lives{true};
  bool response_lives{true};
  bool connected{true};
  double data_age_s{0.01};
  std::string detail;
  bool stale{};
  std::vector<FaultReport> active;
};

TEST_F(RootCauseTest, AllWell) {
  run_for(1);
  EXPECT_EQ(bench.snapshot.status, Status::kOk);
  EXPECT_EQ(bench.snapshot.root_cause, "");
  EXPECT_EQ(bench.snapshot.advice, "");
}

TEST_F(RootCauseTest, ALinkThatIsDownExplainsTheUnknowns) {
  run_for(1);
  connected = false;
  detail = "No such file or directory";
  stale = true;
  run_for(1);
  EXPECT_EQ(bench.snapshot.links.at(0).status, LinkStatus::kDown);
  EXPECT_EQ(bench.snapshot.links.at(0).detail, "No such file or directory");
  EXPECT_EQ(bench.component("rotor 1")->status, Status::kUnknown);
  EXPECT_EQ(bench.snapshot.root_cause, kLink);
  EXPECT_EQ(bench.snapshot.status, Status::kDegraded);
  EXPECT_THAT(bench.snapshot.advice, HasSubstr(kLink));
}

TEST_F(RootCauseTest, ASilentLinkExplainsTheUnknowns) {
  run_for(1);
  data_age_s = 2.5;
  stale = true;
  run_for(0.2);
  EXPECT_EQ(bench.snapshot.links.at(0).status, LinkStatus::kSilent);
  EXPECT_EQ(bench.snapshot.root_cause, kLink);
}

TEST_F(RootCauseTest, ALinkThatNeverSpokeIsSilentOnlyAfterAWhile) {
  data_age_s = kNaN;
  run_for(1);
  EXPECT_EQ(bench.snapshot.links.at(0).status, LinkStatus::kUnknown);
  run_for(2);
  EXPECT_EQ(bench.snapshot.links.at(0).status, LinkStatus::kSilent);
}

TEST_F(RootCauseTest, AMissingDriverExplainsItsLinkAndTheUnknowns) {
  run_for(1);
  mavlink_lives = false;
  stale = true;
  run_for(1.5);
  EXPECT_EQ(bench.snapshot.root_cause, "process airworthy-mavlink");
  EXPECT_EQ(bench.snapshot.links.at(0).status, LinkStatus::kUnknown);
  EXPECT_EQ(bench.snapshot.links.at(0).detail, "airworthy-mavlink is missing");
  EXPECT_EQ(bench.component("rotor 1")->status, Status::kUnknown);
}

TEST_F(RootCauseTest, ADriverThatStopsReportingItsLinkLeavesItUnknown) {
  run_for(1);
  const TimePoint last = bench.now;
  while (bench.now - last < Duration{3'500'000}) {
    bench.model.add(mavlink.sign(bench.now + Duration{1}));
    bench.step();
  }
  EXPECT_EQ(bench.snapshot.links.at(0).status, LinkStatus::kUnknown);
  EXPECT_EQ(bench.snapshot.links.at(0).detail, "airworthy-mavlink does not report this link any more");
}

TEST_F(RootCauseTest, TheWorstFaultThenTheEarliest) {
  run_for(1);
  raise(Severity::kCaution, "rotor 4");
  run_for(0.2);
  raise(Severity::kWarning, "rotor 3");
  run_for(0.2);
  raise(Severity::kWarning, "rotor 2");
  run_for(0.2);
  EXPECT_EQ(bench.snapshot.root_cause, "rotor 3");
}

TEST_F(RootCauseTest, ALinkLostBeforeTheFaultIsTheCause) {
  run_for(1);
  connected = false;
  run_for(1);
  raise(Severity::kCaution, "engine");  // an effect of frozen data
  run_for(0.2);
  EXPECT_EQ(bench.snapshot.root_cause, kLink);
  EXPECT_EQ(bench.component("engine")->status, Status::kDegraded) << "listed all the same";
}

TEST_F(RootCauseTest, AFaultBeforeTheLinkWasLostIsTheCause) {
  run_for(1);
  raise(Severity::kWarning, "rotor 2");
  run_for(1);
  connected = false;  // the crash tore it off
  run_for(1);
  EXPECT_EQ(bench.snapshot.root_cause, "rotor 2");
  EXPECT_EQ(bench.snapshot.advice, "Land now.");
}

TEST_F(RootCauseTest, AFaultLongAfterTheLossIsACauseOfItsOwn) {
  run_for(1);
  connected = false;
  run_for(10);
  raise(Severity::kWarning, "rotor 2");
  run_for(0.2);
  EXPECT_EQ(bench.snapshot.root_cause, "rotor 2");
}

TEST_F(RootCauseTest, AnAdvisoryYieldsToALoss) {
  run_for(1);
  raise(Severity::kAdvisory, "rotor 2");
  run_for(1);
  connected = false;
  run_for(1);
  EXPECT_EQ(bench.snapshot.root_cause, kLink);
}

TEST_F(RootCauseTest, TheEarliestLossIsTheCauseOfTheLater) {
  run_for(1);
  connected = false;
  stale = true;
  run_for(1);
  response_lives = false;
  run_for(1.5);
  EXPECT_EQ(bench.snapshot.root_cause, kLink);
  EXPECT_THAT(bench.component("rotor 1")->reasons, ElementsAre("airworthy-response is missing"));
}

class KnownFeedsTest : public RootCauseTest {
 protected:
  KnownFeedsTest() : RootCauseTest{config()} {}
  static HealthConfig config() {
    HealthConfig config;
    config.feeds["airworthy-mavlink"] = {"airworthy-limits"};
    return config;
  }
};

TEST_F(KnownFeedsTest, ALinkExplainsOnlyWhatItFeeds) {
  run_for(1);
  connected = false;
  run_for(1);
  raise(Severity::kWarning, "rotor 2");  // by airworthy-response, which lives on another driver
  run_for(0.2);
  EXPECT_EQ(bench.snapshot.root_cause, "rotor 2");
}

}  // namespace
}  // namespace airworthy::health
