#include "core/estimators/attitude_propagator.h"

#include <gtest/gtest.h>

#include <cmath>

namespace airworthy {
namespace {

constexpr double kStep_s = 0.01;

TimePoint at(int step) { return from_us(1'000'000 + step * 10'000); }

TEST(AttitudePropagator, CoordinatedTurnHoldsItsBank) {
  // Steady turn at bank φ and level pitch: q = Ω sin φ, r = Ω cos φ, p = 0 keep φ and θ constant.
  AttitudePropagator<double> attitude;
  const double bank = 0.6;
  const double turn_rate = 0.3;
  attitude.measure(at(0), bank, 0.0);
  for (int i = 1; i <= 500; ++i) {
    attitude.step(at(i), kStep_s, 0.0, turn_rate * std::sin(bank), turn_rate * std::cos(bank));
  }
  EXPECT_NEAR(attitude.roll_rad(), bank, 1e-9);
  EXPECT_NEAR(attitude.pitch_rad(), 0.0, 1e-9);
}

TEST(AttitudePropagator, IntegratesARoll) {
  AttitudePropagator<double> attitude;
  attitude.measure(at(0), -0.5, 0.0);
  for (int i = 1; i <= 100; ++i) attitude.step(at(i), kStep_s, 1.0, 0.0, 0.0);
  EXPECT_NEAR(attitude.roll_rad(), 0.5, 1e-9);
}

TEST(AttitudePropagator, CarriesAMeasurementFromItsOwnTime) {
  AttitudePropagator<double> attitude;
  attitude.measure(at(0), 0.0, 0.0);
  attitude.step(at(10), 0.1, 1.0, 0.0, 0.0);
  attitude.measure(at(16), 0.5, 0.0);  // 40 ms before the next rate sample
  attitude.step(at(20), 0.1, 1.0, 0.0, 0.0);
  EXPECT_NEAR(attitude.roll_rad(), 0.54, 1e-9);
}

TEST(AttitudePropagator, IgnoresWhatIsNotFinite) {
  AttitudePropagator<double> attitude;
  attitude.measure(at(0), std::nan(""), 0.0);
  EXPECT_FALSE(attitude.valid());
  attitude.measure(at(0), 0.1, 0.2);
  attitude.measure(at(1), 0.3, HUGE_VAL);
  EXPECT_EQ(attitude.roll_rad(), 0.1);
}

TEST(AttitudePropagator, StraightUpDoesNotExplode) {
  AttitudePropagator<double> attitude;
  attitude.measure(at(0), 0.0, 1.57079632);
  for (int i = 1; i <= 1000; ++i) attitude.step(at(i), kStep_s, 0.1, 0.1, 0.1);
  EXPECT_TRUE(std::isfinite(attitude.roll_rad()));
  EXPECT_LT(std::abs(attitude.roll_rad()), 30.0);
}

}  // namespace
}  // namespace airworthy
