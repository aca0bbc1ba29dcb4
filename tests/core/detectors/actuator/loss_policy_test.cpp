#include "core/detectors/actuator/loss_policy.h"

#include <gtest/gtest.h>

#include <limits>

namespace airworthy::actuator {
namespace {

using Transition = FaultLifeCycle::Transition;

constexpr LossPolicyParams kParams{.loss = 0.2,
                                   .probability = 0.95,
                                   .persistence = Duration{100'000},
                                   .life_cycle = {.clear_ratio = 0.5, .clear_after = Duration{1'000'000}}};

TimePoint at(double s) { return TimePoint{} + from_seconds(s); }

/// Its fault was raised.
LossPolicy raised(bool latched) {
  LossPolicyParams params = kParams;
  params.life_cycle.latched = latched;
  LossPolicy policy{params};
  for (int i = 0; i < 20; ++i) (void)policy.step(0.5, 0.05, true, at(0.01 * i));
  EXPECT_TRUE(policy.active());
  return policy;
}

TEST(LossPolicy, ProbabilityIsThatOfTheNormalDistribution) {
  EXPECT_DOUBLE_EQ(LossPolicy::exceedance(0.2, 0.1, 0.2), 0.5);
  EXPECT_NEAR(LossPolicy::exceedance(0.3, 0.1, 0.2), 0.841345, 1e-6);  // Φ(1)
  EXPECT_NEAR(LossPolicy::exceedance(0.004, 0.1, 0.2), 0.025, 1e-5);   // Φ(−1.96)
}

TEST(LossPolicy, RaisesWhatLastsAndTellsWhenItBegan) {
  LossPolicy policy{kParams};
  EXPECT_EQ(policy.step(0.0, 0.05, true, at(0.0)), Transition::kNone);
  EXPECT_EQ(policy.step(0.25, 0.05, true, at(0.1)), Transition::kNone);  // Φ(1): more probable than not
  EXPECT_EQ(policy.step(0.4, 0.05, true, at(0.2)), Transition::kNone);
  EXPECT_EQ(policy.step(0.4, 0.05, true, at(0.25)), Transition::kNone);
  EXPECT_EQ(policy.step(0.4, 0.05, true, at(0.31)), Transition::kRaise);
  EXPECT_EQ(policy.onset(), at(0.0));
}

TEST(LossPolicy, ForgetsWhatDoesNotLast) {
  LossPolicy policy{kParams};
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(policy.step(i % 9 == 8 ? 0.0 : 0.5, 0.05, true, at(0.01 * i)), Transition::kNone);
  }
}

TEST(LossPolicy, RaisesNothingThatItMayNotAndNothingUncertain) {
  LossPolicy policy{kParams};
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(policy.step(0.9, 0.05, false, at(0.01 * i)), Transition::kNone);
    EXPECT_EQ(policy.step(0.9, 0.9, true, at(0.01 * i + 0.005)), Transition::kNone);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(policy.step(nan, 0.1, true, at(0.01 * i + 0.006)), Transition::kNone);
  }
}

TEST(LossPolicy, ClearsWithHysteresisUnlessLatched) {
  for (const bool latched : {false, true}) {
    LossPolicy policy = raised(latched);
    bool cleared = false;
    for (int i = 0; i < 300; ++i) {
      // Φ(0.2) is above 0.5 · 0.95 for the first second, Φ(−2) below.
      const double gamma = i < 100 ? 0.22 : 0.0;
      const bool clears = policy.step(gamma, 0.1, true, at(1.0 + 0.01 * i)) == Transition::kClear;
      EXPECT_FALSE(clears && i <= 100);
      cleared = cleared || clears;
    }
    EXPECT_EQ(cleared, !latched);
  }
}

TEST(LossPolicy, RearmedItRaisesALatchedFaultAgainAndKeepsOneThatCanClear) {
  for (const bool latched : {false, true}) {
    LossPolicy policy = raised(latched);
    policy.pause(at(10.0));
    policy.rearm();
    EXPECT_EQ(policy.active(), !latched);
    int raised = 0;
    for (int i = 0; i < 20; ++i)
      raised += policy.step(0.5, 0.05, true, at(20.0 + 0.01 * i)) == Transition::kRaise ? 1 : 0;
    EXPECT_EQ(raised, latched ? 1 : 0);
    EXPECT_TRUE(policy.active());
  }
}

TEST(LossPolicy, APauseIsNoEvidence) {
  LossPolicy policy{kParams};
  (void)policy.step(0.5, 0.05, true, at(0.0));
  policy.pause(at(5.0));
  EXPECT_EQ(policy.step(0.5, 0.05, true, at(5.05)), Transition::kNone);
  EXPECT_EQ(policy.step(0.5, 0.05, true, at(5.11)), Transition::kNone);
  EXPECT_EQ(policy.step(0.5, 0.05, true, at(5.16)), Transition::kRaise);
  EXPECT_GE(policy.onset(), at(5.0));
}

}  // namespace
}  // namespace airworthy::actuator
