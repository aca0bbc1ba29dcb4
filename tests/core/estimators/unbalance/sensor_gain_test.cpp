#include "core/estimators/unbalance/sensor_gain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

namespace airworthy {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

TEST(SensorGain, IsOneWhereNothingIsKnown) {
  const SensorGain<double> gain{SensorGainParams{}};
  for (const double speed : {0.0, 500.0, 1500.0}) EXPECT_EQ(gain.power(speed), 1.0);
}

// The transfer function itself: ω_c²/(s² + √2·ω_c·s + ω_c²) at s = jω.
TEST(SensorGain, IsThatOfAButterworthFilter) {
  const double cutoff_Hz = 180.0;
  const SensorGain<double> gain{{.filter_cutoff_Hz = cutoff_Hz}};
  for (const double speed : {10.0, 100.0, 300.0, 600.0, 900.0, 1200.0, 1520.0, 3000.0}) {
    const std::complex<double> s{0.0, speed};
    const double c = kTwoPi * cutoff_Hz;
    const double expected = std::norm(c * c / (s * s + std::numbers::sqrt2 * c * s + c * c));
    EXPECT_NEAR(gain.power(speed), expected, 1e-12);
  }
  EXPECT_NEAR(gain.power(kTwoPi * cutoff_Hz), 0.5, 1e-12);
}

// The mean of many samples of a rotating unit vector, across the switch to 1 at small angles.
TEST(SensorGain, IsThatOfAnAverage) {
  const double window_s = 0.005;
  const SensorGain<double> gain{{.averaging_window_s = window_s}};
  for (const double speed : {0.01, 0.3999, 0.4001, 5.0, 300.0, 502.0, 1256.6, 1520.0}) {
    constexpr int kParts = 20000;
    std::complex<double> sum;
    for (int i = 0; i < kParts; ++i) sum += std::polar(1.0 / kParts, speed * window_s * (i + 0.5) / kParts);
    EXPECT_NEAR(gain.power(speed), std::norm(sum), 1e-6) << speed;
  }
}

}  // namespace
}  // namespace airworthy
