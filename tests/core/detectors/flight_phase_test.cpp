#include "core/detectors/flight_phase.h"

#include <gtest/gtest.h>

#include <cmath>

namespace airworthy {
namespace {

constexpr double kG = 9.81;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Four rotors whose thrust over mass is 10 m/s² when all turn at 500 rad/s.
Multirotor quad() {
  Multirotor vehicle;
  vehicle.mass_kg = 1.0;
  vehicle.thrust_coefficient_N_s2 = 1e-5;
  vehicle.speed_min_rad_s = 100.0;
  vehicle.speed_max_rad_s = 900.0;
  vehicle.rotor_count = 4;
  return vehicle;
}

struct Bench {
  /// So long at this thrust (g) and felt upward force (g), at 500 Hz, rotor speeds at 100 Hz.
  void run(double duration_s, double thrust_g, double up_g, double rate_rad_s = 0.0) {
    const double speed = std::sqrt(thrust_g * kG / (4.0 * 1e-5));
    const int steps = static_cast<int>(std::lround(duration_s * 500.0));
    for (int i = 0; i < steps; ++i) {
      now_ += Duration{2000};
      if (tells_speeds_ && (to_us(now_) / 2000) % 5 == 0) {
        phase_.on_rotor_speeds(now_, std::array{speed, speed, speed, speed});
      }
      phase_.on_imu(now_, {0.0, 0.0, -up_g * kG}, {rate_rad_s, 0.0, 0.0});
    }
  }
  /// Standing, then a take-off as an autopilot does it.
  void take_off() {
    run(1.0, 0.05, 1.0);
    run(0.3, 0.7, 1.0);
    run(0.5, 1.2, 1.2);
    run(2.0, 1.0, 1.0);
  }

  FlightPhase phase_{quad()};
  TimePoint now_{Duration{1'000'000}};
  bool tells_speeds_ = true;
};

class FlightPhaseTest : public ::testing::Test, protected Bench {};

TEST_F(FlightPhaseTest, BeginsUnknownAndFindsTheGround) {
  EXPECT_EQ(phase_.phase(), Phase::kUnknown);
  run(0.1, 0.05, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kUnknown);
  run(0.4, 0.05, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kOnGround);
}

TEST_F(FlightPhaseTest, BegunInAHoverItIsInFlightWithinTwoSeconds) {
  run(1.5, 1.0, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kUnknown);
  run(1.0, 1.0, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
}

TEST_F(FlightPhaseTest, BegunInAHoverWithAReportItIsInFlightAtOnce) {
  phase_.on_report(now_, LandedReport::kInAir, 0.0);
  run(0.5, 1.0, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
}

TEST_F(FlightPhaseTest, ATakeOffKnownByReportAloneEndsInAHoverToo) {
  tells_speeds_ = false;
  phase_.on_report(now_, LandedReport::kTakingOff, 0.0);
  run(0.5, 1.0, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kTakeOff);
  tells_speeds_ = true;
  run(2.5, 1.0, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
}

TEST_F(FlightPhaseTest, ATakeOffThatWasNotSeenThroughoutEndsInAHoverToo) {
  run(1.0, 0.05, 1.0);
  run(0.3, 0.7, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kTakeOff);
  now_ += Duration{1'000'000};
  phase_.on_rotor_speeds(now_, std::array{495.0, 495.0, 495.0, 495.0});
  run(2.5, 1.0, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
}

TEST_F(FlightPhaseTest, BegunOnTheGroundWithRotorsTurningItIsNotInFlight) {
  run(10.0, 0.5, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kUnknown);
  phase_.on_report(now_, LandedReport::kInAir, 0.0);  // nor does a wrong report make it fly
  run(10.0, 0.5, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kUnknown);
  run(0.5, 0.3, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kOnGround);
}

TEST_F(FlightPhaseTest, EachTimeItsThrustWasUnknownTheFlightMustShowAnew) {
  run(3.0, 1.0, 1.0);
  ASSERT_EQ(phase_.phase(), Phase::kInFlight);
  for (int i = 0; i < 3; ++i) {
    tells_speeds_ = false;
    run(2.0, 1.0, 1.0);
    EXPECT_EQ(phase_.phase(), Phase::kUnknown);
    tells_speeds_ = true;
    run(1.5, 1.0, 1.0);
    EXPECT_EQ(phase_.phase(), Phase::kUnknown);
    run(1.0, 1.0, 1.0);
    EXPECT_EQ(phase_.phase(), Phase::kInFlight);
  }
}

TEST_F(FlightPhaseTest, TakesOffFliesAndLands) {
  run(1.0, 0.05, 1.0);
  run(0.3, 0.7, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kTakeOff);
  run(0.5, 1.2, 1.2);
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
  run(10.0, 1.0, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
  run(0.05, 0.95, 2.0);  // touch-down
  run(0.1, 0.9, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kLanding);
  run(0.3, 0.8, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kLanding);
  run(0.5, 0.05, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kOnGround);
}

TEST_F(FlightPhaseTest, StandingWithThrustBelowTheWeightIsNoFlight) {
  run(1.0, 0.05, 1.0);
  run(20.0, 0.9, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kTakeOff);
}

TEST_F(FlightPhaseTest, LearnsWhatTheVehicleFileHasWrong) {
  // 20 % heavier than the file says: the same thrust gives less.
  run(1.0, 0.05, 1.0);
  run(0.3, 0.8, 1.0);
  run(0.5, 1.45, 1.2);
  run(20.0, 1.2, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
  EXPECT_NEAR(phase_.thrust_scale() / 1e-5, 1.0 / 1.2, 0.01);
  EXPECT_NEAR(phase_.unexplained_m_s2(), 0.0, 0.1);
}

TEST_F(FlightPhaseTest, FreeFallIsFlight) {
  run(1.0, 0.0, 1.0);
  run(0.3, 0.0, 3.0);  // thrown
  run(0.3, 0.0, 0.05, 8.0);
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
}

TEST_F(FlightPhaseTest, AnImpactIsContactAndTheWreckIsOnTheGround) {
  take_off();
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
  run(0.03, 1.0, 8.0, 5.0);
  run(0.05, 0.5, 1.0, 5.0);
  EXPECT_EQ(phase_.phase(), Phase::kContact);
  run(0.5, 0.5, 4.0, 15.0);
  EXPECT_EQ(phase_.phase(), Phase::kContact);
  run(2.0, 0.0, -1.0);  // upside down
  EXPECT_EQ(phase_.phase(), Phase::kOnGround);
}

TEST_F(FlightPhaseTest, DescendingAtLowThrustIsNotOnTheGround) {
  take_off();
  run(2.0, 0.3, 0.9, 0.5);  // autorotating, the air carries: moving, so not standing
  EXPECT_NE(phase_.phase(), Phase::kOnGround);
}

TEST_F(FlightPhaseTest, AReportedLandingIsOneAndAReportAloneServesWithoutThrust) {
  take_off();
  phase_.on_report(now_, LandedReport::kLanding, -0.5);
  run(0.1, 1.0, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kLanding);
  tells_speeds_ = false;
  run(1.0, 1.0, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kLanding);
  phase_.on_report(now_, LandedReport::kInAir, 0.0);
  run(0.1, 1.0, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
  run(4.0, 1.0, 1.0);  // the report has grown old
  EXPECT_EQ(phase_.phase(), Phase::kUnknown);
}

TEST_F(FlightPhaseTest, CommandsServeWhereSpeedsAreMissing) {
  tells_speeds_ = false;
  const auto command = [&](double duration_s, double speed, double up_g) {
    const double ratio = (speed - 100.0) / 800.0;
    for (int i = 0; i < static_cast<int>(duration_s * 50.0); ++i) {
      phase_.on_rotor_commands(now_, std::array{ratio, ratio, ratio, ratio});
      run(0.02, 0.0, up_g);
    }
  };
  command(1.0, 100.0, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kOnGround);
  command(0.3, 420.0, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kTakeOff);
  command(0.6, 542.0, 1.2);
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
}

TEST_F(FlightPhaseTest, NonsenseChangesNothing) {
  take_off();
  const Phase before = phase_.phase();
  phase_.on_rotor_speeds(now_, std::array{1e5, 1e5, 1e5, 1e5});  // electrical rpm, say
  phase_.on_rotor_speeds(now_, std::array{kNaN, kNaN, kNaN, kNaN});
  phase_.on_rotor_speeds(now_, std::array{1.0, 2.0});
  phase_.on_rotor_commands(now_, std::array{kNaN, 0.5, 0.5, 0.5});
  phase_.on_imu(now_ + Duration{2000}, {kNaN, 0.0, 0.0}, {0.0, 0.0, 0.0});
  run(0.1, 1.0, 1.0);
  EXPECT_EQ(phase_.phase(), before);
  EXPECT_EQ(phase_.times_gone_back(), 0);
  phase_.on_imu(now_ - Duration{1'000'000}, {0.0, 0.0, 500.0}, {0.0, 0.0, 0.0});
  EXPECT_EQ(phase_.phase(), before);
  EXPECT_EQ(phase_.times_gone_back(), 1);
}

TEST_F(FlightPhaseTest, GoesOnAfterAnInertialStampOfTheFuture) {
  take_off();
  phase_.on_imu(now_ + std::chrono::hours{1}, {0.0, 0.0, -kG}, {0.0, 0.0, 0.0});
  run(2.5, 1.0, 1.0);
  EXPECT_EQ(phase_.restarts(), 1);
  EXPECT_EQ(phase_.times_gone_back(), 9);
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
  EXPECT_LE(phase_.since(), now_);
  run(1.0, 0.05, 1.0);
  EXPECT_EQ(phase_.phase(), Phase::kOnGround);
}

TEST_F(FlightPhaseTest, AThrustStampOfTheFutureIsNotBelievedForAnHour) {
  take_off();
  phase_.on_rotor_speeds(now_ + std::chrono::hours{1}, std::array{100.0, 100.0, 100.0, 100.0});
  for (int i = 0; i < 250; ++i) {
    run(0.01, 1.0, 1.0);
    ASSERT_TRUE(phase_.phase() == Phase::kInFlight || phase_.phase() == Phase::kUnknown);
  }
  EXPECT_EQ(phase_.restarts(), 1);
  EXPECT_EQ(phase_.phase(), Phase::kInFlight);
  EXPECT_NEAR(phase_.thrust_m_s2(), kG, 0.1);
}

TEST_F(FlightPhaseTest, AShiftOfTimeChangesNothing) {
  Bench other;
  take_off();
  other.now_ += std::chrono::hours{24 * 365};
  other.take_off();
  EXPECT_EQ(other.phase_.phase(), phase_.phase());
  EXPECT_EQ(other.phase_.thrust_scale(), phase_.thrust_scale());
}

}  // namespace
}  // namespace airworthy
