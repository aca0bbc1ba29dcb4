#include "core/estimators/effectiveness/rotor_speed_predictor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/support/allocation_guard.h"

namespace airworthy {
namespace {

using Predictor = RotorSpeedPredictor<double, 4>;
using Telemetry = Predictor::Telemetry;

constexpr double kLag_s = 0.02;

TimePoint at(double time_s) { return from_us(1'000'000) + Duration{std::llround(time_s * 1e6)}; }

RotorSpeedParams<double> params() {
  return {.rotor_count = 3,
          .time_constant_s = kLag_s,
          .speed_min_rad_s = 100.0,
          .speed_max_rad_s = 1100.0,
          .command_latency = Duration{4'000},
          .telemetry_latency = Duration{10'000}};
}

/// Steady state of a first-order lag driven by 600 + 200·sin(ωt).
double lagged(double time_s, double rate_rad_s) {
  const double gain = 1.0 / std::hypot(1.0, rate_rad_s * kLag_s);
  return 600.0 + 200.0 * gain * std::sin(rate_rad_s * time_s - std::atan(rate_rad_s * kLag_s));
}

TEST(RotorSpeedPredictor, FollowsTheMotorBetweenLateReports) {
  constexpr double kRate_rad_s = 15.0;
  Predictor predictor{params()};
  double worst = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.002 * i;
    if (i % 5 == 0) {
      const double ratio = 0.5 + 0.2 * std::sin(kRate_rad_s * t);
      predictor.on_command(at(t), std::array{ratio, 0.5, 0.5});
      // What the motor turned at 10 ms ago, answering commands of 4 ms before that.
      predictor.on_speed(at(t), std::array{lagged(t - 0.014, kRate_rad_s), 600.0, 600.0});
    }
    // Up to the present, 4 ms before the newest command reaches the motor.
    ASSERT_TRUE(predictor.advance(at(t - 0.006)) || i < 5);
    if (i > 500) worst = std::max(worst, std::abs(predictor.speed(0) - lagged(t - 0.010, kRate_rad_s)));
  }
  EXPECT_LT(worst, 4.0) << "of an amplitude of 190 rad/s; held reports would be 60 rad/s off";
  EXPECT_NEAR(predictor.speed(1), 600.0, 1e-6);
  EXPECT_EQ(predictor.staleness(), Duration{0});
  EXPECT_TRUE(predictor.uses_commands());
}

TEST(RotorSpeedPredictor, LearnsTheScaleOfASaggingBattery) {
  Predictor predictor{params()};
  for (int i = 0; i < 5000; ++i) {
    const double t = 0.002 * i;
    if (i % 5 == 0) {
      predictor.on_command(at(t), std::array{0.5, 0.5, 0.5});
      predictor.on_speed(at(t), std::array{540.0, 600.0, 630.0});
    }
    static_cast<void>(predictor.advance(at(t)));
  }
  EXPECT_NEAR(predictor.speed(0), 540.0, 1.0);
  EXPECT_NEAR(predictor.scale(0), 0.9, 0.005);
  EXPECT_NEAR(predictor.scale(2), 1.05, 0.005);
}

// MAVLink reports four rotors in one message and the rest in the next, with one time of the device.
TEST(RotorSpeedPredictor, GroupsOfRotorsWithOneStampAreOneReport) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  Predictor whole{params()};
  Predictor grouped{params()};
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.002 * i;
    if (i % 5 == 0) {
      const std::array speeds{540.0 + std::sin(3.0 * t), 600.0 + 5.0 * std::sin(t), 630.0 + std::cos(t)};
      for (Predictor* predictor : {&whole, &grouped}) {
        predictor->on_command(at(t), std::array{0.5, 0.5, 0.5});
        static_cast<void>(predictor->advance(at(t)));
      }
      whole.on_speed(at(t), speeds);
      grouped.on_speed(at(t), std::array{speeds[0], speeds[1], kNone});
      // What is known already may be used before the other group comes.
      static_cast<void>(grouped.advance(at(t)));
      grouped.on_speed(at(t), std::array{kNone, kNone, speeds[2]});
    }
    for (Predictor* predictor : {&whole, &grouped}) static_cast<void>(predictor->advance(at(t + 0.001)));
  }
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(grouped.telemetry(i, at(4.0)), Telemetry::kGood) << i;
    EXPECT_NEAR(grouped.speed(i), whole.speed(i), 0.5) << i;
    EXPECT_NEAR(grouped.scale(i), whole.scale(i), 2e-3) << i;
  }
  EXPECT_EQ(grouped.refused_messages(), 0);
  grouped.on_speed(at(3.99), std::array{540.0, 600.0, 630.0});
  grouped.on_speed(at(3.99), std::array{540.0, 600.0, 630.0});
  EXPECT_GT(grouped.refused_messages(), 0) << "a duplicate adds nothing";
}

TEST(RotorSpeedPredictor, WithoutCommandsInterpolatesReports) {
  Predictor predictor{params()};
  for (int i = 0; i < 20; ++i) predictor.on_speed(at(0.01 * i), std::array{600.0 + i, 600.0, 600.0});
  ASSERT_TRUE(predictor.advance(at(0.125)));
  EXPECT_NEAR(predictor.speed(0), 613.5, 1e-9)
      << "halfway between the reports of 0.12 and 0.13 s, sent 10 ms later";
  ASSERT_TRUE(predictor.advance(at(0.2)));
  EXPECT_EQ(predictor.speed(0), 619.0);
  EXPECT_EQ(predictor.staleness(), Duration{20'000});
}

TEST(RotorSpeedPredictor, RefusesWhatIsNoSpeed) {
  Predictor predictor{params()};
  const double nan = std::nan("");
  for (int i = 0; i < 10; ++i) predictor.on_speed(at(0.01 * i), std::array{600.0, 600.0, nan});
  EXPECT_EQ(predictor.telemetry(0, at(0.1)), Telemetry::kGood);
  EXPECT_EQ(predictor.telemetry(2, at(0.1)), Telemetry::kMissing);
  EXPECT_EQ(predictor.telemetry(0, at(1.0)), Telemetry::kMissing);
  predictor.on_speed(at(0.1), std::array{5000.0, 600.0, 600.0});  // another unit
  predictor.on_speed(at(0.11), std::array{10.0, 600.0, 600.0});   // a spike
  EXPECT_EQ(predictor.refused_speeds(), 2);
  predictor.on_speed(at(0.11), std::array{600.0, 600.0, 600.0});  // a duplicate
  predictor.on_speed(at(0.05), std::array{600.0, 600.0, 600.0});  // late
  predictor.on_command(at(0.1), std::array{0.5, nan, 0.5});
  EXPECT_EQ(predictor.refused_messages(), 3);
  // Three reports in a row that agree are no spike: a motor may stop, or run free.
  for (int i = 12; i < 15; ++i) predictor.on_speed(at(0.01 * i), std::array{10.0, 600.0, 600.0});
  ASSERT_TRUE(predictor.advance(at(0.2)));
  EXPECT_EQ(predictor.speed(0), 10.0);
}

TEST(RotorSpeedPredictor, NoticesFrozenAndImplausibleTelemetry) {
  Predictor predictor{params()};
  for (int i = 0; i < 60; ++i) {
    const double alive = 600.0 + i % 3;
    predictor.on_speed(at(0.02 * i), std::array{600.0, alive, i % 2 == 0 ? alive : 9000.0});
  }
  EXPECT_EQ(predictor.telemetry(0, at(1.2)), Telemetry::kFrozen);
  EXPECT_EQ(predictor.telemetry(1, at(1.2)), Telemetry::kGood);
  EXPECT_EQ(predictor.telemetry(2, at(1.2)), Telemetry::kImplausible);
}

TEST(RotorSpeedPredictor, WithoutReportsFollowsTheCommandsThroughTheLag) {
  Predictor predictor{params()};
  EXPECT_FALSE(predictor.advance(at(0.0)));
  double worst = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.002 * i;
    // A motor answers 4 ms after the stamp.
    const double ratio = 0.5 + 0.2 * std::sin(15.0 * t);
    predictor.on_command(at(t), std::array{ratio, 0.5, 0.3});
    ASSERT_TRUE(predictor.advance(at(t)));
    if (i > 500) worst = std::max(worst, std::abs(predictor.speed(0) - lagged(t - 0.004, 15.0)));
  }
  EXPECT_EQ(predictor.source(), SpeedSource::kCommands);
  EXPECT_LT(worst, 1.0);
  EXPECT_NEAR(predictor.speed(2), 400.0, 1e-6);
  EXPECT_EQ(predictor.gap_sigma(1), 0.0) << "a command that never changes is known between its messages";
  EXPECT_FALSE(predictor.advance(at(4.3))) << "commands of 0.3 s ago say nothing any more";
}

TEST(RotorSpeedPredictor, GapsBetweenCommandsAreAsUncertainAsTheyWander) {
  Predictor predictor{params()};
  std::mt19937 random{5};
  std::normal_distribution<double> normal;
  // A random walk of 100 rad/s per square root of a second, told ten times a second.
  double ratio = 0.5;
  double squares = 0.0;
  for (int i = 0; i < 3000; ++i) {
    predictor.on_command(at(0.1 * i), std::array{ratio, 0.5, 0.5});
    ASSERT_TRUE(predictor.advance(at(0.1 * i)));
    if (i >= 1000) squares += predictor.gap_sigma(0) * predictor.gap_sigma(0);
    ratio = std::clamp(ratio + 0.1 * std::sqrt(0.1) * normal(random), 0.3, 0.7);
  }
  // Less at the limits of the walk.
  EXPECT_NEAR(std::sqrt(squares / 2000.0), 100.0 * std::sqrt(0.1 / 6.0), 3.0);
  static_cast<void>(predictor.advance(at(299.9 + 0.05)));
  const double held = predictor.gap_sigma(0);
  EXPECT_GT(held, 0.0);
}

TEST(RotorSpeedPredictor, ReportsThatStopLeaveTheCommands) {
  Predictor predictor{params()};
  const auto fly = [&predictor](double from_s, double until_s, auto speeds_at) {
    for (int i = static_cast<int>(from_s * 100.0); i < static_cast<int>(until_s * 100.0); ++i) {
      predictor.on_command(at(0.01 * i), std::array{0.5, 0.5, 0.5});
      speeds_at(0.01 * i);
      static_cast<void>(predictor.advance(at(0.01 * i)));
    }
  };
  const double nan = std::nan("");
  fly(0.0, 4.0, [&](double t) { predictor.on_speed(at(t), std::array{540.0 + std::sin(t), 600.0, 630.0}); });
  EXPECT_EQ(predictor.source(), SpeedSource::kTelemetryAndCommands);
  EXPECT_FALSE(predictor.is_overdue(0, at(4.0)));
  EXPECT_TRUE(predictor.is_overdue(0, at(4.02)));
  // One that is silent while others report is missing: its motor may stand.
  fly(4.0, 5.0, [&](double t) { predictor.on_speed(at(t), std::array{nan, 600.0 + std::sin(t), 630.0}); });
  EXPECT_EQ(predictor.source(), SpeedSource::kTelemetryAndCommands);
  EXPECT_EQ(predictor.telemetry(0, at(5.0)), Telemetry::kMissing);
  // What is refused is still heard: no reason to go on without it.
  fly(5.0, 6.0, [&](double t) { predictor.on_speed(at(t), std::array{nan, 9000.0, 9000.0}); });
  EXPECT_EQ(predictor.source(), SpeedSource::kTelemetryAndCommands);
  fly(6.0, 7.0, [](double) {});
  EXPECT_EQ(predictor.source(), SpeedSource::kCommands);
  EXPECT_NEAR(predictor.speed(2), 630.0, 3.0) << "with the scale that the reports had taught";
  fly(7.0, 8.0, [&](double t) { predictor.on_speed(at(t), std::array{540.0, 600.0 + std::sin(t), 630.0}); });
  EXPECT_EQ(predictor.source(), SpeedSource::kTelemetryAndCommands);
}

TEST(RotorSpeedPredictor, GapsAreAsUncertainAsTheScaledCommands) {
  const auto gap_with_scale = [](double scale) {
    Predictor predictor{params()};
    for (int i = 0; i < 1000; ++i) {
      predictor.on_command(at(0.01 * i), std::array{0.5 + 0.01 * (i % 2), 0.5, 0.5});
      if (i < 500)
        predictor.on_speed(at(0.01 * i), std::array{scale * (605.0 + 0.1 * (i % 3)), 600.0, 600.0});
      static_cast<void>(predictor.advance(at(0.01 * i)));
    }
    EXPECT_EQ(predictor.source(), SpeedSource::kCommands);
    return predictor.gap_sigma(0);
  };
  EXPECT_NEAR(gap_with_scale(0.8) / gap_with_scale(1.0), 0.8, 0.01);
}

TEST(RotorSpeedPredictor, OneStampFromTheFarFutureHealsWithTheNextMessage) {
  Predictor predictor{params()};
  const auto fly = [&predictor](double from_s, double until_s) {
    for (int i = static_cast<int>(from_s * 100.0); i < static_cast<int>(until_s * 100.0); ++i) {
      predictor.on_command(at(0.01 * i), std::array{0.5, 0.5, 0.5});
      predictor.on_speed(at(0.01 * i), std::array{540.0 + std::sin(0.1 * i), 600.0, 630.0});
      static_cast<void>(predictor.advance(at(0.01 * i)));
    }
  };
  fly(0.0, 1.0);
  predictor.on_command(at(5000.0), std::array{0.5, 0.5, 0.5});
  predictor.on_speed(at(5000.0), std::array{540.0, 600.0, 630.0});
  ASSERT_TRUE(predictor.advance(at(1.0)));
  fly(1.01, 5.0);
  EXPECT_EQ(predictor.refused_messages(), 0);
  EXPECT_EQ(predictor.source(), SpeedSource::kTelemetryAndCommands);
  EXPECT_EQ(predictor.telemetry(0, at(5.0)), Telemetry::kGood);
  EXPECT_EQ(predictor.known_until(), at(4.99) + Duration{4'000});
  EXPECT_NEAR(predictor.speed(0), 540.0, 1.5);
  EXPECT_NEAR(predictor.command_interval_s(), 0.01, 1e-4);
  EXPECT_TRUE(predictor.is_overdue(0, at(5.02)));
  // One that was only held up for long is still none.
  predictor.on_command(at(4.0), std::array{0.9, 0.9, 0.9});
  predictor.on_speed(at(4.0), std::array{900.0, 900.0, 900.0});
  EXPECT_EQ(predictor.refused_messages(), 2);
}

TEST(RotorSpeedPredictor, RemembersATenthOfASecondHoweverOftenItIsAsked) {
  constexpr double kRate_rad_s = 15.0;
  for (const double samples_per_s : {100.0, 500.0, 1000.0, 8000.0}) {
    Predictor predictor{params()};
    const int samples = static_cast<int>(samples_per_s);
    int commands = 0;
    double now_s = 0.0;
    for (int i = 0; i < samples; ++i) {
      now_s = i / samples_per_s;
      for (; 0.01 * commands <= now_s; ++commands) {
        const double t = 0.01 * commands;
        predictor.on_command(at(t), std::array{0.5 + 0.2 * std::sin(kRate_rad_s * (t + 0.004)), 0.5, 0.5});
      }
      ASSERT_TRUE(predictor.advance(at(now_s)));
    }
    const double newest = predictor.speed(0);
    EXPECT_EQ(predictor.speed_at(0, at(now_s)), newest);
    for (const double ago_s : {0.03, 0.06, 0.1, 0.12}) {
      EXPECT_NEAR(predictor.speed_at(0, at(now_s - ago_s)), lagged(now_s - ago_s, kRate_rad_s), 6.0)
          << ago_s << " s ago, " << samples_per_s << " times a second";
    }
  }
}

TEST(RotorSpeedPredictor, UsesNoHeap) {
  const test::AllocationGuard guard;
  Predictor predictor{params()};
  for (int i = 0; i < 100; ++i) {
    predictor.on_command(at(0.01 * i), std::array{0.5, 0.5, 0.5});
    predictor.on_speed(at(0.01 * i), std::array{600.0, 600.0, 600.0});
    static_cast<void>(predictor.advance(at(0.01 * i)));
  }
  EXPECT_EQ(guard.allocations(), 0U);
}

}  // namespace
}  // namespace airworthy
