// The unbalance monitor where nobody tells the speeds of the rotors: commands only.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <random>

#include "core/detectors/unbalance/power_fallback.h"
#include "core/detectors/unbalance/rotor_unbalance_monitor.h"
#include "tests/support/allocation_guard.h"

namespace airworthy {
namespace {

using Complex = std::complex<double>;
using Transition = FaultLifeCycle::Transition;
using Reason = UnbalanceNotJudged;
constexpr std::size_t kN = 4;
constexpr double kSlowest_rad_s = 100.0;
constexpr double kFastest_rad_s = 900.0;

TimePoint at(double time_s) { return from_us(std::llround((1000.0 + time_s) * 1e6)); }

UnbalanceParams params_with_baseline() {
  UnbalanceParams params;
  params.vehicle.mass_kg = 0.69;
  params.vehicle.thrust_coefficient_N_s2 = 7.64e-6;
  params.vehicle.propeller_radius_m = 0.1;
  params.vehicle.speed_min_rad_s = kSlowest_rad_s;
  params.vehicle.speed_max_rad_s = kFastest_rad_s;
  params.vehicle.rotor_count = kN;
  for (std::size_t i = 0; i < kN; ++i) params.vehicle.rotor[i].spin = i < 2 ? -1 : 1;
  params.has_baseline = true;
  params.baseline_m_s2 = {0.2, 0.3, 0.1, 0.4};
  params.baseline_sigma_m_s2.fill(0.05);
  return params;
}

/// Flies a vehicle whose rotors turn as commanded but for errors of 2 % that last for 0.3 s.
struct Flight {
  explicit Flight(const UnbalanceParams& params = params_with_baseline())
      : hover_rad_s{UnbalanceMonitor::hover_speed_rad_s(params.vehicle)}, monitor{params} {
    monitor.on_phase(Phase::kInFlight);
  }

  void fly(double duration_s) {
    const double end_s = time_s + duration_s;
    for (; time_s < end_s - 1e-9; time_s += kStep_s) step();
  }

  void step() {
    std::array<double, kN> command{};
    Complex circle = noise_m_s2 * Complex{normal(random), normal(random)};  // x + j·y
    for (std::size_t i = 0; i < kN; ++i) {
      const double spin = i < 2 ? -1.0 : 1.0;
      const double commanded = hover_rad_s + offset_rad_s[i] +
                               wander_rad_s * std::sin((0.5 + 0.2 * static_cast<double>(i)) * time_s);
      command[i] = (commanded - kSlowest_rad_s) / (kFastest_rad_s - kSlowest_rad_s);
      error[i] +=
          -kStep_s / kErrorLasts_s * error[i] + std::sqrt(2.0 * kStep_s / kErrorLasts_s) * normal(random);
      const double speed = commanded * (1.0 + 0.02 * error[i]);
      phase[i] += speed * kStep_s;
      const double ratio = speed / hover_rad_s;
      const double half = 0.5 * speed * window_s;
      const double passed = half > 0.0 ? std::sin(half) / half : 1.0;
      circle += ratio * ratio * passed * (natural[i] + damage[i]) * std::polar(1.0, spin * phase[i]);
    }
    if (has_commands && time_s >= next_command_s) {
      monitor.on_commands(at(time_s), command);
      next_command_s = time_s + 0.02;
    }
    if (!monitor.on_accel(at(time_s), circle.real(), circle.imag(), window_s)) return;
    for (std::size_t i = 0; i < kN; ++i) {
      if (monitor.rotors()[i].transition == Transition::kRaise) blamed |= 1U << i;
    }
  }

  [[nodiscard]] const RotorUnbalance& rotor(std::size_t index) const { return monitor.rotors()[index]; }

  static constexpr double kStep_s = 0.002;
  static constexpr double kErrorLasts_s = 0.3;
  double hover_rad_s;
  RotorUnbalanceMonitor<kN> monitor;
  std::array<double, kN> natural{0.2, 0.3, 0.1, 0.4};
  std::array<double, kN> damage{};
  std::array<double, kN> offset_rad_s{-45.0, 30.0, 60.0, -30.0};
  double wander_rad_s = 15.0;
  double noise_m_s2 = 0.3;
  double window_s = 0.0;
  bool has_commands = true;
  double time_s = 0.0;
  double next_command_s = 0.0;
  std::array<double, kN> error{};
  std::array<double, kN> phase{};
  std::mt19937 random{9};
  std::normal_distribution<double> normal;
  std::uint32_t blamed = 0;
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
  flight.wander_rad_s = 0.0;
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
  flight.monitor.on_commands(at(flight.time_s + 3600.0), std::array{0.5, 0.5, 0.5, 0.5});
  flight.fly(2.0);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMuted);
  flight.has_commands = true;
  flight.fly(1.0);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMonitoring) << "those that follow are right again";
}

TEST(UnbalanceByPower, AnOlderCommandIsIgnored) {
  PowerFallback<kN> fallback{params_with_baseline().vehicle, SignalPowerParams{}, {}, 1e-6};
  const std::array command{0.5, 0.5, 0.5, 0.5};
  fallback.on_accel(at(10.0), 0.0, 0.0);
  fallback.on_commands(at(10.0), command);
  fallback.on_commands(at(9.2), command);
  EXPECT_TRUE(fallback.has_fresh_commands(at(10.1)));
  EXPECT_FALSE(fallback.has_fresh_commands(at(10.6)));
}

TEST(UnbalanceByPower, ACommandOfTheFutureAheadOfAllInertialDataDoesNoHarm) {
  Flight flight;
  flight.monitor.on_commands(at(3600.0), std::array{0.5, 0.5, 0.5, 0.5});
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
