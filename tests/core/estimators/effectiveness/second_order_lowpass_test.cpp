#include "core/estimators/effectiveness/second_order_lowpass.h"

#include <gtest/gtest.h>

#include <cmath>

namespace airworthy {
namespace {

constexpr double kFrequency_rad_s = 50.0;
constexpr double kDamping = 0.55;

/// Unit step of ωn²/(s² + 2ζωn·s + ωn²), textbook form.
double step_response(double t) {
  const double root = std::sqrt(1.0 - kDamping * kDamping);
  const double damped = kFrequency_rad_s * root;
  return 1.0 - std::exp(-kDamping * kFrequency_rad_s * t) *
                   (std::cos(damped * t) + kDamping / root * std::sin(damped * t));
}

double worst_error(double dt_s) {
  SecondOrderLowpass<double> filter{kFrequency_rad_s, kDamping};
  filter.start(0.0);
  // The trapezoidal rule sees an input that rises linearly within the first step: half a step of delay.
  double worst = 0.0;
  for (int i = 1; i * dt_s < 0.3; ++i) {
    worst = std::max(worst, std::abs(filter.step(1.0, dt_s) - step_response((i - 0.5) * dt_s)));
  }
  return worst;
}

TEST(SecondOrderLowpass, FollowsTheClosedFormStepResponse) {
  EXPECT_LT(worst_error(0.002), 0.005);
  // Second order: ten times finer steps, a hundred times smaller error.
  EXPECT_LT(worst_error(0.0002), 0.02 * worst_error(0.002));
}

TEST(SecondOrderLowpass, DelaysARampByTwoZetaOverOmega) {
  SecondOrderLowpass<double> filter{kFrequency_rad_s, kDamping};
  filter.start(0.0);
  double t = 0.0;
  for (int i = 0; i < 1000; ++i) filter.step(t += 0.002, 0.002);
  EXPECT_NEAR(t - filter.value(), 2.0 * kDamping / kFrequency_rad_s, 1e-9);
}

TEST(SecondOrderLowpass, StartsInEquilibriumAndSurvivesALongStep) {
  SecondOrderLowpass<double> filter{kFrequency_rad_s, kDamping};
  filter.start(3.0);
  EXPECT_EQ(filter.step(3.0, 0.002), 3.0);
  for (int i = 0; i < 200; ++i) filter.step(-1.0, 0.1);
  EXPECT_NEAR(filter.value(), -1.0, 1e-6);
}

}  // namespace
}  // namespace airworthy
