#include "core/estimators/unbalance/motor_lag.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace airworthy {
namespace {

TEST(MotorLag, FollowsAStepAsTheSolutionDoesWhateverTheSteps) {
  MotorLag<double, 3> lag{0.015};
  lag.step({100.0, 100.0, 100.0}, 0.0);
  double time_s = 0.0;
  for (const double dt_s : {0.002, 0.002, 0.01, 0.0, 0.001, 0.05}) {
    time_s += dt_s;
    const auto& speed = lag.step({200.0, 100.0, 50.0}, dt_s);
    EXPECT_NEAR(speed[0], 200.0 - 100.0 * std::exp(-time_s / 0.015), 1e-10);
    EXPECT_EQ(speed[1], 100.0);
    EXPECT_NEAR(speed[2], 50.0 + 50.0 * std::exp(-time_s / 0.015), 1e-10);
  }
}

TEST(MotorLag, WithoutLagSpeedIsTheCommand) {
  MotorLag<float, 3> lag{0.0F};
  lag.step({1.0F, 2.0F, 3.0F}, 0.002F);
  EXPECT_EQ(lag.step({4.0F, 5.0F, 6.0F}, 0.002F), (MotorLag<float, 3>::Rotors{4.0F, 5.0F, 6.0F}));
}

TEST(MotorLag, WhatIsNoNumberIsNoCommand) {
  MotorLag<double, 3> lag{0.015};
  const auto before = lag.step({100.0, 200.0, 300.0}, 0.002);
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(lag.step({kNaN, kNaN, kNaN}, 0.002), before);
  EXPECT_EQ(lag.step({1.0, 1.0, 1.0}, kNaN), before);
  EXPECT_EQ(lag.step({1.0, 1.0, 1.0}, -1.0), before);
}

}  // namespace
}  // namespace airworthy
