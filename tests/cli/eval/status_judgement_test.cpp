#include "cli/eval/status_judgement.h"

#include <gtest/gtest.h>

#include "runtime/detector/fault_reporter.h"

namespace airworthy::eval {
namespace {

/// A status at that many half seconds; an empty reason is a component that is judged.
detector_status_t status(int half_seconds, const std::vector<std::pair<std::string, std::string>>& components,
                         const std::string& muted_reason = "") {
  detector_status_t status;
  status.header.time_us = 1'000'000 + 500'000L * half_seconds;
  status.muted_reason = muted_reason;
  for (const auto& [component, reason] : components)
    status.components.push_back(rt::assessment(component, reason, {}));
  return status;
}

TEST(StatusJudgement, TimeIsJudgedOnlyBetweenTwoThatSaySo) {
  StatusJudgement judgement;
  EXPECT_FALSE(judgement.whole().has_any());
  judgement.on_status(status(0, {{"engine", "converging"}}));
  EXPECT_FALSE(judgement.whole().has_any());
  judgement.on_status(status(1, {{"engine", ""}}));
  judgement.on_status(status(2, {{"engine", ""}}));
  judgement.on_status(status(3, {{"engine", "attitude data stale"}}));
  EXPECT_DOUBLE_EQ(judgement.whole().judged_s(), 0.5);
  ASSERT_EQ(judgement.whole().muted().size(), 2U);
  EXPECT_EQ(judgement.whole().muted()[0].why, "converging");
  EXPECT_EQ(judgement.whole().muted()[1].why, "attitude data stale");
}

TEST(StatusJudgement, OneComponentIsEnoughAndEachHasItsOwn) {
  StatusJudgement judgement;
  for (int i = 0; i <= 4; ++i)
    judgement.on_status(status(i, {{"engine", ""}, {"roll control", i < 2 ? "converging" : ""}}));
  EXPECT_DOUBLE_EQ(judgement.whole().judged_s(), 2.0);
  EXPECT_DOUBLE_EQ(judgement.components().at("engine").judged_s(), 2.0);
  EXPECT_DOUBLE_EQ(judgement.components().at("roll control").judged_s(), 1.0);
}

TEST(StatusJudgement, TwoChannelsOfOneComponentAreCountedOnce) {
  StatusJudgement judgement;
  for (int i = 0; i <= 2; ++i)
    judgement.on_status(status(i, {{"roll control", "converging"}, {"roll control", ""}}));
  EXPECT_DOUBLE_EQ(judgement.components().at("roll control").judged_s(), 1.0);
  EXPECT_DOUBLE_EQ(judgement.components().at("roll control").muted_s(), 0.0);
}

TEST(StatusJudgement, SaysWhyAndThatNobodySaidWhy) {
  StatusJudgement judgement;
  judgement.on_status(status(0, {{"rotor 1", "frozen"}}, "on ground"));
  judgement.on_status(status(1, {{"rotor 1", "frozen"}}, "on ground"));
  EXPECT_EQ(judgement.whole().main_cause(), "on ground");
  StatusJudgement untold;
  untold.on_status(status(0, {}));
  untold.on_status(status(1, {}));
  EXPECT_EQ(untold.whole().main_cause(), "the detector does not say why");
  EXPECT_EQ(untold.whole().judged_s(), 0.0);
}

TEST(StatusJudgement, KeepsTheCountersOfMessagesThatDoNotFit) {
  StatusJudgement judgement;
  detector_status_t one = status(0, {});
  one.counters = {{"samples_refused", 3}, {"speeds.wrong_rotor_count", 7}, {"commands.wrong_rotor_count", 0}};
  judgement.on_status(one);
  EXPECT_EQ(judgement.misfits(), "speeds.wrong_rotor_count 7");
}

}  // namespace
}  // namespace airworthy::eval
