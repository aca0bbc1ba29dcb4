#include "cli/calibrate/motor_lag_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace airworthy::calibrate {
namespace {

struct Rotor {
  Series command;
  Series speed;
};

/// A rotor that follows random steps of its command with this lag, reported this much later.
Rotor rotor_with(double lag_s, double delay_s, double step_ratio, std::uint32_t seed) {
  std::mt19937 random{seed};
  std::normal_distribution<double> normal;
  Rotor rotor;
  double command = 0.5;
  double x = command;
  constexpr double kDt_s = 0.002;
  for (int k = 0; k < 20'000; ++k) {
    const double time_s = 10.0 + kDt_s * k;
    if (k % 40 == 0) command = 0.5 + step_ratio * normal(random);
    if (k % 5 == 0) {
      rotor.command.time_s.push_back(time_s);
      rotor.command.value.push_back(command);
      rotor.speed.time_s.push_back(time_s + delay_s);
      rotor.speed.value.push_back(2000.0 + 8000.0 * x + 15.0 * normal(random));
    }
    x += (1.0 - std::exp(-kDt_s / lag_s)) * (command - x);
  }
  return rotor;
}

TEST(MotorLagFit, FindsLagAndDelay) {
  for (const double lag_s : {0.015, 0.03, 0.06}) {
    const Rotor a = rotor_with(lag_s, 0.012, 0.05, 1);
    const Rotor b = rotor_with(lag_s, 0.012, 0.05, 2);
    const auto fit = fit_motor_lag({a.command, b.command}, {a.speed, b.speed});
    ASSERT_TRUE(fit.has_value()) << lag_s;
    EXPECT_NEAR(fit->time_constant_s, lag_s, 0.15 * lag_s);
    EXPECT_NEAR(fit->delay_s, 0.012, 0.0041);
    EXPECT_LT(fit->residual_ratio, 0.01);
  }
}

TEST(MotorLagFit, SaysNothingOfCommandsThatHardlyChange) {
  const Rotor still = rotor_with(0.03, 0.012, 1e-4, 3);
  EXPECT_FALSE(fit_motor_lag({still.command}, {still.speed}).has_value());
  EXPECT_FALSE(fit_motor_lag({Series{}}, {still.speed}).has_value()) << "no commands in the log";
  EXPECT_FALSE(fit_motor_lag({}, {}).has_value());
}

}  // namespace
}  // namespace airworthy::calibrate
