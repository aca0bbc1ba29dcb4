#include "core/detectors/unbalance/rotor_unbalance_monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/allocation_guard.h"
#include "tests/support/unbalanced_quad.h"

namespace airworthy {
namespace {

using Reason = UnbalanceNotJudged;
constexpr std::size_t kN = test::UnbalancedQuad::kN;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

UnbalanceParams params_with_baseline() {
  UnbalanceParams params = test::UnbalancedQuad::with_baseline();
  params.most_speed_error_ratio = 0.002;  // as with a calibration
  return params;
}

struct Flight : test::UnbalancedQuad {
  explicit Flight(const UnbalanceParams& params = params_with_baseline()) : UnbalancedQuad{params} {}
};

TEST(RotorUnbalanceMonitor, IsSilentAboutAHealthyVehicle) {
  Flight flight;
  flight.fly(60.0);
  EXPECT_EQ(flight.blamed, 0U);
  EXPECT_FALSE(flight.is_ambiguous);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMonitoring);
  for (std::size_t i = 0; i < kN; ++i) {
    EXPECT_EQ(flight.reason(i), Reason::kJudged);
    EXPECT_NEAR(flight.rotor(i).amplitude_m_s2, flight.natural[i], 0.15);
  }
}

TEST(RotorUnbalanceMonitor, BlamesEachRotorForItsOwnDamage) {
  for (std::size_t rotor = 0; rotor < kN; ++rotor) {
    Flight flight;
    flight.fly(10.0);
    ASSERT_EQ(flight.blamed, 0U);
    flight.damage[rotor] = 1.2;
    flight.fly(5.0);
    EXPECT_EQ(flight.blamed, 1U << rotor);
    EXPECT_LT(flight.found_s, 12.5);
    const RotorUnbalance& found = flight.rotor(rotor);
    EXPECT_NEAR(found.growth_m_s2, 1.2, 0.2);
    EXPECT_GE(found.test_ratio, 1.0);
    EXPECT_GT(found.onset, Flight::at(10.0));
    EXPECT_LE(found.onset, Flight::at(flight.found_s));
  }
}

TEST(RotorUnbalanceMonitor, TwoDamagedRotorsAreBothBlamed) {
  Flight flight;
  flight.damage = {0.0, 1.5, 1.5, 0.0};
  flight.fly(6.0);
  EXPECT_EQ(flight.blamed, 0b0110U);
}

// But for three periods of judging: the tracker meets large damage with a new start.
TEST(RotorUnbalanceMonitor, MoreDamageIsNeverFoundLater) {
  const double start_s = 3.0 * to_seconds(UnbalanceMonitor::kPeriod);
  double before_s = std::numeric_limits<double>::infinity();
  int found = 0;
  for (const double size : {0.2, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 4.0, 8.0, 16.0, 40.0}) {
    Flight flight;  // the same noise each time
    flight.fly(3.0);
    flight.damage[2] = size;
    flight.fly(6.0);
    EXPECT_EQ(flight.blamed & ~0b0100U, 0U) << size;
    if (flight.blamed == 0U) {
      EXPECT_EQ(found, 0) << size << " is not found but less was";
      continue;
    }
    ++found;
    EXPECT_LE(flight.found_s, before_s + start_s) << size;
    before_s = std::min(before_s, flight.found_s);
  }
  EXPECT_GE(found, 8);
}

TEST(RotorUnbalanceMonitor, WithoutABaselineAnUsualUnbalanceIsNoGrowth) {
  UnbalanceParams params = params_with_baseline();
  params.has_baseline = false;
  Flight flight{params};
  flight.fly(20.0);
  EXPECT_EQ(flight.blamed, 0U);
  flight.damage[0] = 1.5;
  flight.fly(5.0);
  EXPECT_EQ(flight.blamed, 0b0001U);
}

// However large: a prior that is narrow beside the amplitude would let both seem known.
TEST(RotorUnbalanceMonitor, OfTwoRotorsOfOneSpeedNobodyIsBlamedAndBothAreNamed) {
  for (const double size : {2.0, 10.0, 30.0}) {
    for (const std::size_t damaged : {2U, 3U}) {
      Flight flight;
      flight.offset_rad_s[3] = flight.offset_rad_s[2];
      flight.wander_rate_rad_s[3] = flight.wander_rate_rad_s[2];
      flight.damage[damaged] = size;
      flight.fly(20.0);
      EXPECT_EQ(flight.blamed, 0U) << size;
      EXPECT_EQ(flight.reason(2), Reason::kConfounded);
      EXPECT_EQ(flight.reason(3), Reason::kConfounded);
      EXPECT_EQ(flight.rotor(2).confounded_with, 0b1000U);
      EXPECT_EQ(flight.rotor(3).confounded_with, 0b0100U);
      EXPECT_EQ(flight.reason(0), Reason::kJudged);
      EXPECT_TRUE(flight.is_ambiguous) << size;
      EXPECT_EQ(flight.candidates, 0b1100U) << size;
    }
  }
}

TEST(RotorUnbalanceMonitor, InAStillHoverNobodyIsBlamed) {
  Flight flight;
  flight.offset_rad_s.fill(0.0);
  flight.wander_rad_s.fill(0.0);
  flight.damage[1] = 8.0;
  flight.fly(60.0);
  EXPECT_EQ(flight.blamed, 0U);
  for (std::size_t i = 0; i < kN; ++i) {
    EXPECT_EQ(flight.reason(i), Reason::kConfounded);
    EXPECT_EQ(flight.rotor(i).confounded_with, 0b1111U & ~(1U << i));
  }
  // One of those that turn its way.
  EXPECT_TRUE(flight.is_ambiguous);
  EXPECT_EQ(flight.candidates, 0b0011U);
}

TEST(RotorUnbalanceMonitor, OfARotorThatWasNeverReadNoIntervalIsGiven) {
  Flight flight;
  flight.offset_rad_s.fill(0.0);
  flight.wander_rad_s.fill(0.0);
  flight.damage[1] = 2.0;
  flight.fly(20.0);
  for (std::size_t i = 0; i < kN; ++i) {
    ASSERT_EQ(flight.reason(i), Reason::kConfounded);
    const RotorUnbalance& rotor = flight.rotor(i);
    EXPECT_TRUE(std::isnan(rotor.reading.low_kg_m));
    EXPECT_TRUE(std::isnan(rotor.reading.high_kg_m));
    // What is read is what is felt at the moment, with all the doubt of it.
    const double kg_m = UnbalanceMonitor::kg_m_per_m_s2(params_with_baseline(), i);
    EXPECT_EQ(rotor.reading.growth_kg_m, kg_m * rotor.growth_m_s2);
    EXPECT_GT(rotor.reading.sigma_kg_m, kg_m * rotor.sigma_m_s2);
  }
}

TEST(RotorUnbalanceMonitor, OfARotorThatIsJudgedNoMoreNoIntervalIsGiven) {
  Flight flight;
  EXPECT_TRUE(std::isnan(flight.rotor(1).reading.low_kg_m));
  flight.fly(5.0);
  EXPECT_FALSE(std::isnan(flight.rotor(1).reading.low_kg_m));
  flight.monitor.on_phase(Phase::kOnGround);
  flight.fly(1.0);
  EXPECT_TRUE(std::isnan(flight.rotor(1).reading.low_kg_m));
  EXPECT_TRUE(std::isnan(flight.rotor(1).reading.high_kg_m));
}

TEST(RotorUnbalanceMonitor, InAStillHoverBaselinesThatHappenToPointOneWayAreNoUnbalance) {
  UnbalanceParams params = params_with_baseline();
  params.baseline_m_s2 = {2.0, 2.0, 0.1, 0.4};
  Flight flight{params};
  flight.natural = {2.0, 2.0, 0.1, 0.4};
  flight.offset_rad_s.fill(0.0);
  flight.wander_rad_s.fill(0.0);
  flight.fly(60.0);
  EXPECT_EQ(flight.blamed, 0U);
  EXPECT_FALSE(flight.is_ambiguous);
}

TEST(RotorUnbalanceMonitor, ReadsAMassAndSaysHowSureItIs) {
  UnbalanceParams params = params_with_baseline();
  params.vehicle.inertia_kg_m2 = {0.0045, 0.0045, 0.0076};
  params.vehicle.imu_position_m = {0.01, 0.005, 0.01};
  params.vehicle.rotor[1].position_m = {-0.117, -0.117, -0.02};
  Flight flight{params};
  flight.damage[1] = 2.0;
  flight.fly(20.0);
  const UnbalanceReading& reading = flight.rotor(1).reading;
  // Felt 2 m/s² where the accelerometer is.
  const double truth = 2.0 * UnbalanceMonitor::kg_m_per_m_s2(params, 1);
  EXPECT_NE(truth, 2.0 * UnbalanceMonitor::kg_m_per_m_s2(params));
  EXPECT_NEAR(reading.growth_kg_m, truth, 0.05 * truth);
  EXPECT_GT(reading.sigma_kg_m, 0.25 * reading.growth_kg_m) << "the response is not measured";
  EXPECT_LT(reading.low_kg_m, truth / 1.4);
  EXPECT_GT(reading.high_kg_m, truth * 1.4);

  // A propeller that shakes less than it did has lost what it grew.
  Flight mended{params};
  mended.natural[3] = 0.0;
  mended.fly(20.0);
  const UnbalanceReading& less = mended.rotor(3).reading;
  EXPECT_LT(less.growth_kg_m, 0.0);
  EXPECT_LT(less.low_kg_m, less.growth_kg_m);
  EXPECT_GT(less.high_kg_m, less.growth_kg_m);

  params.response_sigma_ratio.fill(0.03);
  Flight measured{params};
  measured.damage[1] = 2.0;
  measured.fly(20.0);
  EXPECT_LT(measured.rotor(1).reading.sigma_kg_m, 0.1 * truth);
  EXPECT_LT(measured.rotor(1).reading.low_kg_m, truth);
  EXPECT_GT(measured.rotor(1).reading.high_kg_m, truth);
}

TEST(RotorUnbalanceMonitor, AResponseThatMayBeNextToNothingLeavesTheMassOpen) {
  UnbalanceParams params = params_with_baseline();
  params.response_sigma_ratio.fill(0.6);
  Flight flight{params};
  flight.damage[1] = 2.0;
  flight.fly(20.0);
  const UnbalanceReading& reading = flight.rotor(1).reading;
  EXPECT_EQ(reading.high_kg_m, std::numeric_limits<double>::infinity());
  EXPECT_GT(reading.sigma_kg_m, 0.6 * reading.growth_kg_m);
  EXPECT_GT(reading.low_kg_m, 0.0);
  EXPECT_LT(reading.low_kg_m, reading.growth_kg_m / 2.2);

  Flight mended{params};
  mended.natural[3] = 0.0;
  mended.fly(20.0);
  EXPECT_EQ(mended.rotor(3).reading.low_kg_m, -std::numeric_limits<double>::infinity());
}

TEST(RotorUnbalanceMonitor, WhatWasFoundStaysFoundInAStillHover) {
  Flight flight;
  flight.damage[1] = 3.0;
  flight.fly(5.0);
  ASSERT_EQ(flight.blamed, 0b0010U);
  flight.offset_rad_s.fill(0.0);
  flight.wander_rad_s.fill(0.0);
  flight.fly(60.0);
  EXPECT_EQ(flight.blamed, 0b0010U);
  EXPECT_EQ(flight.cleared, 0U);
  EXPECT_FALSE(flight.is_ambiguous);
}

TEST(RotorUnbalanceMonitor, AFaultThatHealsIsClearedAfterItsTime) {
  Flight flight;
  flight.damage[1] = 2.0;
  flight.fly(5.0);
  ASSERT_EQ(flight.blamed, 0b0010U);
  flight.damage[1] = 0.0;
  flight.fly(8.0);
  EXPECT_EQ(flight.cleared, 0U);
  flight.fly(15.0);
  EXPECT_EQ(flight.cleared, 0b0010U);
}

TEST(RotorUnbalanceMonitor, IsMutedUnlessItFlies) {
  for (const Phase phase :
       {Phase::kUnknown, Phase::kOnGround, Phase::kTakeOff, Phase::kLanding, Phase::kContact}) {
    Flight flight;
    flight.damage[1] = 5.0;
    flight.monitor.on_phase(phase);
    flight.fly(5.0);
    EXPECT_EQ(flight.blamed, 0U);
    EXPECT_EQ(flight.monitor.state(), DetectorState::kMuted);
    EXPECT_EQ(flight.reason(1), Reason::kNotFlying);
    flight.monitor.on_phase(Phase::kInFlight);
    flight.fly(5.0);
    EXPECT_EQ(flight.blamed, 0b0010U);
    EXPECT_GT(flight.updates, 0);
    flight.updates = 0;
    flight.monitor.on_phase(phase);  // after the landing it is known still, and nothing new
    flight.fly(30.0);
    EXPECT_EQ(flight.updates, 0);
    EXPECT_EQ(flight.cleared, 0U);
  }
}

TEST(RotorUnbalanceMonitor, FrozenSpeedsAreImplausible) {
  Flight flight;
  flight.damage[1] = 5.0;
  flight.is_frozen[0] = true;
  flight.fly(10.0);
  EXPECT_EQ(flight.blamed, 0U);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMuted);
  for (std::size_t i = 0; i < kN; ++i) EXPECT_EQ(flight.reason(i), Reason::kSpeedImplausible);
}

TEST(RotorUnbalanceMonitor, ElectricalSpeedsAreImplausible) {
  Flight flight;
  flight.damage[1] = 5.0;
  flight.telemetry_factor.fill(7.0);
  flight.fly(10.0);
  EXPECT_EQ(flight.blamed, 0U);
  for (std::size_t i = 0; i < kN; ++i) EXPECT_EQ(flight.reason(i), Reason::kSpeedImplausible);
}

TEST(RotorUnbalanceMonitor, OneRotorWithElectricalSpeedIsImplausible) {
  Flight flight;
  flight.damage[1] = 5.0;
  flight.telemetry_factor[2] = 7.0;
  flight.fly(10.0);
  EXPECT_EQ(flight.blamed, 0U);
  EXPECT_EQ(flight.reason(1), Reason::kSpeedImplausible);
}

TEST(RotorUnbalanceMonitor, ARotorWithoutSpeedLeavesAllUnjudged) {
  Flight flight;
  flight.fly(5.0);
  flight.telemetry_factor[2] = kNaN;
  flight.damage[1] = 5.0;
  flight.fly(5.0);
  EXPECT_EQ(flight.blamed, 0U);
  EXPECT_EQ(flight.reason(1), Reason::kSpeedUnknown);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMuted);
  flight.telemetry_factor[2] = 1.0;
  flight.fly(5.0);
  EXPECT_EQ(flight.blamed, 0b0010U);
}

// 200 Hz averages of 5 ms leave a sixth of 242 Hz: unfit where the noise hides the rest, and only there.
TEST(RotorUnbalanceMonitor, AveragedInertialDataIsUnfitWhereItTrulyIs) {
  UnbalanceParams small = params_with_baseline();
  small.vehicle.mass_kg = 0.039;
  small.vehicle.thrust_coefficient_N_s2 = 4.14e-8;
  for (const bool averages : {false, true}) {
    for (const double noise_m_s2 : {0.02, 3.0}) {
      Flight flight{small};
      flight.noise_m_s2 = noise_m_s2;
      flight.telemetry_noise = 0.001;
      if (averages) flight.window_s = flight.dt_s = 0.005;
      flight.fly(5.0);
      EXPECT_EQ(flight.blamed, 0U);
      EXPECT_EQ(flight.reason(1) == Reason::kUnfitInertialData, averages && noise_m_s2 > 1.0)
          << averages << ", " << noise_m_s2;
      if (noise_m_s2 < 1.0) {
        EXPECT_EQ(flight.reason(1), Reason::kJudged) << averages;
      }
    }
  }
  Flight large;  // 75 Hz passes nearly whole
  large.window_s = large.dt_s = 0.005;
  large.damage[3] = 1.2;
  large.fly(6.0);
  EXPECT_EQ(large.blamed, 0b1000U);
}

TEST(RotorUnbalanceMonitor, TellsAVibrationThatIsNoRotorsFromDamage) {
  Flight flight;
  flight.fly(5.0);
  flight.foreign_m_s2 = 5.0;
  flight.fly(20.0);
  EXPECT_EQ(flight.blamed, 0U);
}

TEST(RotorUnbalanceMonitor, RefusesSpeedsOfAnotherNumberOfRotors) {
  RotorUnbalanceMonitor<kN> monitor{params_with_baseline()};
  monitor.on_phase(Phase::kInFlight);
  const std::array<double, 6> six{470.0, 471.0, 472.0, 473.0, 474.0, 475.0};
  for (int k = 0; k < 1000; ++k) {
    monitor.on_speeds(Flight::at(0.002 * k), six);
    (void)monitor.on_accel(Flight::at(0.002 * k), 1.0, 0.0, 0.0);
  }
  EXPECT_EQ(monitor.rotors()[0].reason, Reason::kSpeedUnknown);
}

TEST(RotorUnbalanceMonitor, NotANumberBlamesNobodyAndIsCounted) {
  Flight flight;
  flight.fly(5.0);
  for (int k = 0; k < 100; ++k) {
    (void)flight.monitor.on_accel(Flight::at(flight.time_s), kNaN, 0.0, 0.0);
    (void)flight.monitor.on_accel(Flight::at(flight.time_s), 0.0, HUGE_VAL, 0.0);
    flight.fly(0.002);
  }
  EXPECT_EQ(flight.blamed, 0U);
  EXPECT_EQ(flight.monitor.innovation().samples_refused, 200);
  EXPECT_TRUE(std::isfinite(flight.rotor(0).amplitude_m_s2));
}

TEST(RotorUnbalanceMonitor, AClockThatJumpsForwardBlamesNobody) {
  for (const double seconds : {0.3, 5.0, 3600.0}) {
    Flight flight;
    flight.fly(20.0);
    flight.time_s += seconds;
    flight.next_report_s = flight.time_s;
    flight.fly(20.0);
    EXPECT_EQ(flight.blamed, 0U) << seconds;
    EXPECT_FALSE(flight.is_ambiguous) << seconds;
    flight.damage[2] = 3.0;
    flight.fly(20.0);
    EXPECT_EQ(flight.blamed, 1U << 2) << seconds;
  }
}

TEST(RotorUnbalanceMonitor, KnowsTheMassOfAnAmplitude) {
  const UnbalanceParams params = params_with_baseline();
  // 40 mg at 0.1 m: m·r·ω²/M.
  const double speed2 = 0.69 * 9.81 / (4.0 * 7.64e-6);
  EXPECT_NEAR(UnbalanceMonitor::kg_m_per_m_s2(params) * (40e-6 * 0.1 * speed2 / 0.69), 40e-6 * 0.1, 1e-12);
}

TEST(RotorUnbalanceMonitor, UsesNoHeap) {
  Flight flight;
  flight.damage[1] = 2.0;
  flight.fly(1.0);
  const test::AllocationGuard guard;
  flight.fly(3.0);
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_EQ(flight.blamed, 0b0010U);
}

}  // namespace
}  // namespace airworthy
