#include "core/estimators/effectiveness/spin_regression.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/allocation_guard.h"
#include "tests/support/rotor_ring.h"

namespace airworthy {
namespace {

constexpr double kStep_s = 0.002;
constexpr double kHover_rad_s = 500.0;

Multirotor ring(std::size_t rotors) {
  Multirotor vehicle;
  vehicle.inertia_kg_m2 = {0.0045, 0.0045, 0.0076};
  vehicle.thrust_coefficient_N_s2 = 7.6e-6;
  vehicle.torque_ratio_m = 0.0135;
  vehicle.propeller_inertia_kg_m2 = 1.5e-5;
  test::put_on_ring(vehicle, rotors, 0.15);
  return vehicle;
}

/// How the body yaws when the rotors of `pattern` turn the other way than described; their speeds wander.
template <class Scalar>
SpinRegression<Scalar> flown(const Multirotor& described, std::uint32_t pattern, double seconds,
                             double wander) {
  SpinRegression<Scalar> regression{described, Scalar(kHover_rad_s * kHover_rad_s), {}};
  const std::size_t n = described.rotor_count;
  const double inertia = described.inertia_kg_m2[2];
  std::mt19937 random{7};
  std::normal_distribution normal;
  std::array<double, kMaxRotors> speed{};
  speed.fill(kHover_rad_s);
  double rate = 0.0;
  regression.start(Scalar{0});
  for (double t = 0.0; t < seconds; t += kStep_s) {
    double torque = 0.0;
    std::array<Scalar, kMaxRotors> before{};
    std::array<Scalar, kMaxRotors> now{};
    for (std::size_t i = 0; i < n; ++i) {
      before[i] = static_cast<Scalar>(speed[i]);
      const double change = kStep_s / 0.1 * (kHover_rad_s - speed[i] + wander * normal(random));
      speed[i] += change;
      now[i] = static_cast<Scalar>(speed[i]);
      const double spin = ((pattern >> i) & 1U ? -1.0 : 1.0) * described.rotor[i].spin;
      // A clockwise rotor is held back counter-clockwise, and so is the body pushed that speeds it up.
      torque -= spin * (described.torque_ratio_m * described.thrust_coefficient_N_s2 * speed[i] * speed[i] +
                        described.propeller_inertia_kg_m2 * change / kStep_s);
    }
    rate += kStep_s * torque / inertia;
    regression.step(Scalar(kStep_s), std::span{now}.first(n), std::span{before}.first(n),
                    static_cast<Scalar>(rate + 0.02 * normal(random)), {}, Scalar{0});
  }
  return regression;
}

TEST(SpinRegression, NamesEveryPattern) {
  for (const std::size_t rotors : {4U, 6U}) {
    const Multirotor vehicle = ring(rotors);
    for (const std::uint32_t pattern : {0b1U, 0b10U, 0b1000U, 0b11U, 0b101U, (1U << rotors) - 1}) {
      const auto verdict = flown<double>(vehicle, pattern, 40.0, 100.0).judge();
      ASSERT_TRUE(verdict);
      EXPECT_EQ(verdict->best, pattern) << rotors;
      EXPECT_GT(verdict->over_described, 20.0) << rotors << " " << pattern;
      EXPECT_GT(verdict->over_second, 8.0) << rotors << " " << pattern;
    }
  }
}

TEST(SpinRegression, ARightDescriptionIsBest) {
  for (const std::size_t rotors : {3U, 4U, 6U, 8U}) {
    const auto verdict = flown<double>(ring(rotors), 0, 20.0, 100.0).judge();
    ASSERT_TRUE(verdict);
    EXPECT_EQ(verdict->best, 0U) << rotors;
    EXPECT_EQ(verdict->over_described, 0.0) << rotors;
  }
}

TEST(SpinRegression, SaysLittleWithoutExcitation) {
  // Rotors of the same sense that turn alike act alike.
  const auto verdict = flown<double>(ring(4), 0b1, 1.0, 0.0).judge();
  ASSERT_TRUE(verdict);
  EXPECT_LT(verdict->over_second, 8.0);
}

TEST(SpinRegression, NeedsATorqueToJudge) {
  Multirotor vehicle = ring(4);
  vehicle.torque_ratio_m = 0.0;
  EXPECT_FALSE((SpinRegression<double>{vehicle, 1.0, {}}.judge()));
}

TEST(SpinRegression, FloatTracksDouble) {
  const auto exact = flown<double>(ring(4), 0b10, 20.0, 100.0).judge();
  const auto rounded = flown<float>(ring(4), 0b10, 20.0, 100.0).judge();
  ASSERT_TRUE(exact && rounded);
  EXPECT_EQ(exact->best, rounded->best);
  EXPECT_NEAR(exact->over_described, static_cast<double>(rounded->over_described),
              0.05 * exact->over_described);
}

TEST(SpinRegression, UsesNoHeap) {
  const Multirotor vehicle = ring(8);
  const test::AllocationGuard guard;
  static_cast<void>(flown<double>(vehicle, 0b10, 1.0, 100.0).judge());
  EXPECT_EQ(guard.allocations(), 0U);
}

}  // namespace
}  // namespace airworthy
