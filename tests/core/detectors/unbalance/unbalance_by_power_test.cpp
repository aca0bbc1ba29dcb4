// The unbalance monitor where nobody tells the speeds of the rotors: commands only.
#include <gtest/gtest.h>

#include <cmath>

#include "core/detectors/unbalance/power_fallback.h"
#include "tests/support/allocation_guard.h"
#include "tests/support/unbalanced_quad.h"

namespace airworthy {
namespace {

using Reason = UnbalanceNotJudged;
constexpr std::size_t kN = test::UnbalancedQuad::kN;

UnbalanceParams params_with_baseline() {
  UnbalanceParams params = test::UnbalancedQuad::with_baseline();
  params.vehicle.propeller_radius_m = 0.1;
  params.vehicle.speed_min_rad_s = 100.0;
  params.vehicle.speed_max_rad_s = 900.0;
  return params;
}

/// Rotors turn as commanded but for errors of 2 %.
struct Flight : test::UnbalancedQuad {
  explicit Flight(const UnbalanceParams& params = params_with_baseline()) : UnbalancedQuad{params} {
    has_speeds = false;
    has_commands = true;
    speed_error_ratio = 0.02;
    offset_rad_s = {-45.0, 30.0, 60.0, -30.0};
    wander_rad_s.fill(15.0);
    wander_rate_rad_s = {0.5, 0.7, 0.9, 1.1};
    noise_m_s2 = 0.3;
  }
};

TEST(UnbalanceByPower, NamesTheRightRotorAndNobodyOfAHealthyVehicle) {
  Flight healthy;
  healthy.fly(40.0);
  EXPECT_EQ(healthy.blamed, 0U);
  for (std::size_t damaged = 0; damaged < kN; ++damaged) {
    Flight flight;
    flight.damage[damaged] = 2.0;
    flight.fly(40.0);
    EXPECT_EQ(flight.blamed, 1U << damaged);
    EXPECT_EQ(flight.monitor.state(), DetectorState::kMonitoring);
    const RotorUnbalance& rotor = flight.rotor(damaged);
    EXPECT_TRUE(rotor.by_power);
    EXPECT_EQ(rotor.reason, Reason::kJudged);
    EXPECT_NEAR(rotor.growth_m_s2, 2.0, 0.5);
    EXPECT_EQ(rotor.log_odds, 0.0) << "no hypotheses were tested";
    EXPECT_EQ(rotor.against_m_s2, 0.0);
    EXPECT_LT(rotor.reading.low_kg_m, rotor.reading.growth_kg_m);
    EXPECT_GT(rotor.reading.high_kg_m, rotor.reading.growth_kg_m);
  }
}

TEST(UnbalanceByPower, OfRotorsOfOneSpeedAndSenseNobodyIsNamedAndEitherIsConfounded) {
  Flight flight;
  flight.offset_rad_s.fill(0.0);
  flight.wander_rad_s.fill(0.0);
  flight.damage[2] = 3.0;
  flight.fly(40.0);
  EXPECT_EQ(flight.blamed, 0U);
  constexpr std::array<std::uint32_t, kN> kOther{0b0010, 0b0001, 0b1000, 0b0100};
  for (std::size_t i = 0; i < kN; ++i) {
    ASSERT_TRUE(flight.rotor(i).by_power);
    EXPECT_EQ(flight.rotor(i).reason, Reason::kConfounded);
    EXPECT_EQ(flight.rotor(i).confounded_with, kOther[i]);
    EXPECT_TRUE(std::isnan(flight.rotor(i).reading.low_kg_m));
  }
}

TEST(UnbalanceByPower, WithoutABaselineGrowthIsTheWholeUnbalance) {
  UnbalanceParams params = params_with_baseline();
  params.has_baseline = false;
  params.baseline_m_s2.fill(0.0);
  Flight flight{params};
  flight.damage[1] = 2.0;
  flight.fly(40.0);
  EXPECT_EQ(flight.blamed, 0b0010U);
  EXPECT_EQ(flight.rotor(1).growth_m_s2, flight.rotor(1).amplitude_m_s2);
  EXPECT_NEAR(flight.rotor(1).growth_m_s2, 2.3, 0.5);
}

TEST(UnbalanceByPower, ACalibratedPowerMeansTheSameWhateverIsUsual) {
  Flight healthy;
  healthy.natural = {1.5, 0.3, 1.0, 0.4};
  healthy.fly(40.0);
  const UnbalancePowers powers = healthy.monitor.powers();
  EXPECT_GT(powers.learned_s, 20.0);
  EXPECT_NEAR(powers.m2_s4[0], 1.5 * 1.5, 0.8);
  for (const double usual_m_s2 : {0.2, 0.5, 2.0}) {
    UnbalanceParams params = params_with_baseline();
    params.baseline_power_m2_s4 = powers.m2_s4;
    params.usual_m_s2 = usual_m_s2;
    Flight flight{params};
    flight.natural = healthy.natural;
    flight.fly(40.0);
    EXPECT_EQ(flight.blamed, 0U) << usual_m_s2;
    EXPECT_NEAR(flight.rotor(0).growth_m_s2, 0.0, 0.3) << usual_m_s2;
  }
}

TEST(UnbalanceByPower, CommandsThatStopLeaveAllUnjudged) {
  Flight flight;
  flight.fly(20.0);
  ASSERT_EQ(flight.monitor.state(), DetectorState::kMonitoring);
  flight.has_commands = false;
  flight.damage[1] = 3.0;
  flight.fly(10.0);
  EXPECT_EQ(flight.blamed, 0U);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMuted);
  for (std::size_t i = 0; i < kN; ++i) EXPECT_EQ(flight.rotor(i).reason, Reason::kSpeedUnknown);
}

// 0.8 s of each 1.2 s; a growth must last for a whole one.
TEST(UnbalanceByPower, TimesInWhichNobodyAsksDoNotCountAsGrowth) {
  Flight flight;
  flight.damage[1] = 3.0;
  for (int k = 0; k < 80; ++k) {
    flight.has_commands = true;
    flight.fly(0.3);
    flight.has_commands = false;
    flight.fly(0.9);
  }
  EXPECT_EQ(flight.blamed, 0U);
  flight.has_commands = true;
  flight.fly(20.0);
  EXPECT_EQ(flight.blamed, 0b0010U);
}

TEST(UnbalanceByPower, ACommandOfTheFutureIsNotFresh) {
  Flight flight;
  flight.fly(10.0);
  flight.has_commands = false;
  flight.monitor.on_commands(Flight::at(flight.time_s + 3600.0), std::array{0.5, 0.5, 0.5, 0.5});
  flight.fly(2.0);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMuted);
  flight.has_commands = true;
  flight.fly(1.0);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMonitoring) << "those that follow are right again";
}

TEST(UnbalanceByPower, AnOlderCommandIsIgnored) {
  PowerFallback<kN> fallback{params_with_baseline().vehicle, SignalPowerParams{}, {}, 1e-6};
  const std::array command{0.5, 0.5, 0.5, 0.5};
  fallback.on_accel(Flight::at(10.0), 0.0, 0.0);
  fallback.on_commands(Flight::at(10.0), command);
  fallback.on_commands(Flight::at(9.2), command);
  EXPECT_TRUE(fallback.has_fresh_commands(Flight::at(10.1)));
  EXPECT_FALSE(fallback.has_fresh_commands(Flight::at(10.6)));
}

TEST(UnbalanceByPower, ACommandOfTheFutureAheadOfAllInertialDataDoesNoHarm) {
  Flight flight;
  flight.monitor.on_commands(Flight::at(3600.0), std::array{0.5, 0.5, 0.5, 0.5});
  flight.fly(10.0);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMonitoring);
}

TEST(UnbalanceByPower, WhatAveragingTakesAwayIsGivenBack) {
  Flight flight;
  flight.window_s = 0.005;  // leaves 79 % at hover speed
  flight.damage[1] = 3.0;
  flight.fly(40.0);
  Flight raw;
  raw.damage[1] = 3.0;
  raw.fly(40.0);
  EXPECT_NEAR(flight.rotor(1).amplitude_m_s2, raw.rotor(1).amplitude_m_s2,
              0.05 * raw.rotor(1).amplitude_m_s2);
}

TEST(UnbalanceByPower, UsesNoHeap) {
  Flight flight;
  flight.damage[1] = 2.0;
  flight.fly(6.0);
  const test::AllocationGuard guard;
  flight.fly(20.0);
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_EQ(flight.blamed, 0b0010U);
}

}  // namespace
}  // namespace airworthy
