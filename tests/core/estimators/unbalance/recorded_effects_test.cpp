// Three things that recorded flights have and ideal signals have not: rotor speeds stamped with the very time of the
// samples, motor controllers whose clocks are off, and motion far stronger than the vibration of a rotor.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/estimators/unbalance/order_tracker.h"

namespace airworthy {
namespace {

using Tracker = OrderTracker<double, 4>;
constexpr double kDt_s = 0.002;
constexpr double kHover_rad_s = 800.0;

TimePoint at(int step) { return TimePoint{from_seconds(kDt_s * step)}; }

TEST(SpeedTrack, AReportOfThisVeryMomentIsAsFineAsTheReportsAreClose) {
  SpeedTrack<double> track;
  ASSERT_TRUE(track.add(at(0), 700.0));
  ASSERT_TRUE(track.add(at(10), 720.0));
  const auto value = track.at(at(10));
  ASSERT_TRUE(value.has_value());
  EXPECT_DOUBLE_EQ(value->speed_rad_s, 720.0);
  EXPECT_DOUBLE_EQ(value->spacing_s, 0.02) << "not 0: the speed between the reports is not known better";
}

/// Four rotors apart from each other; the third is out of balance by 2 m/s² and, like the others, turns faster than
/// it reports by `error_ratio`. `motion_m_s2` of 30 Hz shakes the vehicle beside.
double amplitude_found(Tracker& tracker, double error_ratio, double motion_m_s2, double seconds) {
  double phase = 0.0;
  const int steps = static_cast<int>(seconds / kDt_s);
  for (int k = 0; k < steps; ++k) {
    const double t = kDt_s * k;
    const double swing = 15.0 * std::sin(2.0 * t);
    const std::array<double, 4> speed{760.0 - swing, 790.0 + swing, 820.0 + swing, 850.0 - swing};
    phase += (1.0 + error_ratio) * speed[2] * kDt_s;
    const double share = speed[2] * speed[2] / (kHover_rad_s * kHover_rad_s);
    const double motion = motion_m_s2 * std::sin(2.0 * std::numbers::pi * 30.0 * t);
    tracker.on_speeds(at(k), speed);
    static_cast<void>(tracker.on_accel(at(k), 2.0 * share * std::cos(phase) + motion,
                                       2.0 * share * std::sin(phase) - motion, 0.0));
  }
  return tracker.turning_m_s2(2, 1).magnitude();
}

TEST(OrderTrackerClocks, AClockHalfAPercentOffIsFollowedFromFarAndAmplitudeKept) {
  for (const double error_ratio : {-0.005, 0.003, 0.008}) {
    Tracker tracker{{.reference_speed_rad_s = kHover_rad_s, .most_speed_error_ratio = 0.01}};
    const double amplitude = amplitude_found(tracker, error_ratio, 0.0, 12.0);
    EXPECT_NEAR(tracker.speed_error_ratio(2), error_ratio, 0.0003) << error_ratio;
    EXPECT_NEAR(amplitude, 2.0, 0.2) << error_ratio;
  }
}

TEST(OrderTrackerClocks, TheErrorStaysWithinWhatItMayBe) {
  Tracker tracker{{.reference_speed_rad_s = kHover_rad_s, .most_speed_error_ratio = 0.002}};
  tracker.start_speed_error(2, 0.001);
  amplitude_found(tracker, 0.008, 0.0, 12.0);
  EXPECT_NEAR(tracker.speed_error_ratio(2), 0.003, 1e-12);
  for (const std::size_t rotor : {0U, 1U, 3U}) EXPECT_LE(std::abs(tracker.speed_error_ratio(rotor)), 0.002);
}

TEST(OrderTrackerClocks, AnExactClockIsLeftAlone) {
  Tracker tracker{{.reference_speed_rad_s = kHover_rad_s, .most_speed_error_ratio = 0.01}};
  EXPECT_NEAR(amplitude_found(tracker, 0.0, 0.0, 6.0), 2.0, 0.1);
  EXPECT_NEAR(tracker.speed_error_ratio(2), 0.0, 1e-4);
}

TEST(OrderTrackerMotion, MotionFarBelowTheRotorsAddsLittleNoise) {
  constexpr double kHighPass_rad_s = kHover_rad_s / 3.0;
  // Of 1 m/s² at 30 Hz the two poles at 800/3 rad/s = 42 Hz leave 1/(1 + (42/30)²) = 0.34.
  Tracker still{{.reference_speed_rad_s = kHover_rad_s, .high_pass_rad_s = kHighPass_rad_s}};
  Tracker moved{{.reference_speed_rad_s = kHover_rad_s, .high_pass_rad_s = kHighPass_rad_s}};
  EXPECT_NEAR(amplitude_found(still, 0.0, 0.0, 6.0), 2.0, 0.1);
  EXPECT_NEAR(amplitude_found(moved, 0.0, 1.0, 6.0), 2.0, 0.2);
  const double added_m_s2 = std::sqrt(moved.noise_variance_m2_s4() - still.noise_variance_m2_s4());
  EXPECT_LT(added_m_s2, 0.4 / std::numbers::sqrt2);
}

}  // namespace
}  // namespace airworthy
