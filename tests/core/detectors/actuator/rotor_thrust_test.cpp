#include "core/detectors/actuator/rotor_thrust.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace airworthy::actuator {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Multirotor vehicle() {
  Multirotor v;
  v.mass_kg = 2.0;
  v.thrust_coefficient_N_s2 = 1e-5;
  v.propeller_inertia_kg_m2 = 1e-4;
  v.motor_time_constant_s = 0.05;
  v.speed_min_rad_s = 100;
  v.speed_max_rad_s = 900;
  v.rotor_count = 3;
  v.rotor[0].spin = 1;
  v.rotor[1].spin = -1;
  v.rotor[2].spin = 1;
  return v;
}

TimePoint at(double s) { return TimePoint{} + from_seconds(s); }

TEST(RotorThrust, FollowsCommandsWithTheMotorsLag) {
  RotorThrust thrust{vehicle(), InputSource::kAuto};
  thrust.advance(at(0), 0.0);
  EXPECT_FALSE(thrust.is_known());
  thrust.on_commands(at(0), std::array{0.0, 0.0, 0.0});
  thrust.on_commands(at(0), std::array{1.0, 0.5, kNan});  // not all known: no command
  thrust.on_commands(at(0), std::array{1.0, 0.5, 0.0});
  for (int i = 1; i <= 50; ++i) thrust.advance(at(0.001 * i), 0.001);
  ASSERT_TRUE(thrust.is_known());
  EXPECT_NEAR(thrust.speed_rad_s(0), 900 - 800 * std::exp(-1.0), 1e-6);
  EXPECT_NEAR(thrust.speed_rad_s(1), 500 - 400 * std::exp(-1.0), 1e-6);
  EXPECT_DOUBLE_EQ(thrust.speed_rad_s(2), 100);
  const double speed = thrust.speed_rad_s(0);
  EXPECT_DOUBLE_EQ(thrust.specific_thrust_m_s2(0), 1e-5 * speed * speed / 2.0);
  thrust.advance(at(0.6), 0.001);
  EXPECT_FALSE(thrust.is_known());
}

TEST(RotorThrust, SpeedsCorrectCommandsSlowlyAndNotBeyondAFifth) {
  RotorThrust thrust{vehicle(), InputSource::kAuto};
  double after_a_tenth = 0;
  for (int i = 0; i <= 20'000; ++i) {
    thrust.on_commands(at(0.001 * i), std::array{0.5, 0.5, 0.5});
    thrust.on_speeds(at(0.001 * i), std::array{450.0, 0.0, 500.0});
    thrust.advance(at(0.001 * i), 0.001);
    if (i == 100) after_a_tenth = thrust.speed_rad_s(0);
  }
  EXPECT_NEAR(after_a_tenth, 500 - 50 * (1 - std::exp(-0.05)), 0.1);
  EXPECT_NEAR(thrust.speed_rad_s(0), 450.0, 0.1);
  EXPECT_NEAR(thrust.speed_rad_s(1), 400.0, 1e-6);  // a motor that stands still stays a loss
  EXPECT_NEAR(thrust.speed_rad_s(2), 500.0, 1e-6);
}

TEST(RotorThrust, SpeedsAloneAreTheSpeeds) {
  RotorThrust thrust{vehicle(), InputSource::kSpeed};
  for (int i = 0; i <= 100; ++i) {
    thrust.on_commands(at(0.01 * i), std::array{1.0, 1.0, 1.0});
    thrust.on_speeds(at(0.01 * i), std::array{-450.0, 300.0 + i, 500.0});  // signed
    thrust.on_speeds(at(0.01 * i), std::array{kNan, kNan, 1e9});           // not reported, not a speed
    thrust.advance(at(0.01 * i), 0.01);
    ASSERT_EQ(thrust.speed_rad_s(0), 450.0);
    ASSERT_EQ(thrust.speed_rad_s(1), 300.0 + i);
    ASSERT_EQ(thrust.speed_rad_s(2), 500.0);
  }
  EXPECT_TRUE(thrust.is_known());
  EXPECT_TRUE(thrust.is_prompt());
}

TEST(RotorThrust, ARotorThatDoesNotReportIsUnknownWithoutCommandsAndNotCorrectedWithThem) {
  RotorThrust speeds{vehicle(), InputSource::kSpeed};
  RotorThrust both{vehicle(), InputSource::kAuto};
  for (int i = 0; i <= 1000; ++i) {
    for (RotorThrust* thrust : {&speeds, &both}) {
      thrust->on_commands(at(0.01 * i), std::array{0.5, 0.5, 0.5});
      thrust->on_speeds(at(0.01 * i), std::array{500.0, kNan, i < 500 ? 500.0 : kNan});
      thrust->advance(at(0.01 * i), 0.01);
      ASSERT_NEAR(thrust->speed_rad_s(0), 500.0, 1e-9);
    }
    ASSERT_FALSE(speeds.is_known());
    ASSERT_TRUE(speeds.is_too_slow());
    ASSERT_NEAR(both.speed_rad_s(1), 500.0, 1e-9);
    ASSERT_NEAR(both.speed_rad_s(2), 500.0, 1e-9);
    ASSERT_TRUE(both.is_known());
  }
}

/// Inertial samples at 500 Hz, and inputs that come every `period_s` and arrive `late_s` after their stamp.
struct Inputs {
  double command_period_s = 0.0;  ///< 0 = none
  double speed_period_s = 0.0;
  double late_s = 0.0;

  void run(RotorThrust& thrust, double duration_s = 10.0) const {
    const auto is_due = [](int step, double period_s) {
      return period_s > 0.0 && step % static_cast<int>(std::lround(period_s * 500.0)) == 0;
    };
    for (int i = 0; i < static_cast<int>(duration_s * 500.0); ++i) {
      const TimePoint stamp = at(0.002 * i - late_s);
      if (is_due(i, command_period_s)) thrust.on_commands(stamp, std::array{0.5, 0.5, 0.5});
      if (is_due(i, speed_period_s)) thrust.on_speeds(stamp, std::array{450.0, 500.0, 500.0});
      thrust.advance(at(0.002 * i), 0.002);
    }
  }
};

TEST(RotorThrust, TellsWhetherItsInputIsPromptSlowOrTooSlow) {
  struct Case {
    Inputs inputs;
    bool is_known;
    bool is_prompt;
    double delay_s;  ///< that unknown_s2() is of; 0 = none
    double prompt_s;
  };
  for (const auto& [inputs, is_known, is_prompt, delay_s, prompt_s] :
       {Case{{0.004, 0.0, 0.0}, true, true, 0.0, 0.0}, Case{{0.020, 0.0, 0.0}, true, true, 0.0, 0.0},
        Case{{0.050, 0.0, 0.0}, true, false, 0.050, 0.03}, Case{{0.100, 0.0, 0.0}, true, false, 0.1, 0.03},
        Case{{0.130, 0.0, 0.0}, false, false, 0.0, 0.0}, Case{{0.020, 0.0, 0.02}, true, false, 0.038, 0.03},
        Case{{0.0, 0.010, 0.0}, true, true, 0.0, 0.0}, Case{{0.0, 0.010, 0.02}, true, false, 0.028, 0.015},
        Case{{0.0, 0.050, 0.0}, true, false, 0.050, 0.015},
        Case{{0.0, 0.100, 0.0}, false, false, 0.0, 0.0}}) {
    RotorThrust thrust{vehicle(), InputSource::kAuto};
    inputs.run(thrust);
    SCOPED_TRACE(::testing::Message()
                 << inputs.command_period_s << ' ' << inputs.speed_period_s << ' ' << inputs.late_s);
    EXPECT_EQ(thrust.is_known(), is_known);
    EXPECT_EQ(thrust.is_too_slow(), !is_known);
    EXPECT_EQ(thrust.is_prompt(), is_prompt);
    EXPECT_NEAR(thrust.unknown_s2(), delay_s * delay_s - prompt_s * prompt_s, 2e-5);
  }
}

TEST(RotorThrust, SpeedsReplaceCommandsThatComeTooSeldom) {
  RotorThrust thrust{vehicle(), InputSource::kAuto};
  Inputs{.command_period_s = 0.1, .speed_period_s = 0.01}.run(thrust);
  EXPECT_TRUE(thrust.is_prompt());
  EXPECT_EQ(thrust.speed_rad_s(0), 450.0);
  RotorThrust slower{vehicle(), InputSource::kAuto};
  Inputs{.command_period_s = 0.05, .speed_period_s = 0.05}.run(slower);  // the commands are less too slow
  EXPECT_NEAR(slower.unknown_s2(), 0.05 * 0.05 - 0.03 * 0.03, 1e-9);
  EXPECT_GT(slower.speed_rad_s(0), 450.0);
}

TEST(RotorThrust, InputThatStopsIsHeldForAQuarterOfASecond) {
  RotorThrust thrust{vehicle(), InputSource::kAuto};
  Inputs{.command_period_s = 0.004}.run(thrust, 1.0);
  thrust.advance(at(1.24), 0.1);
  EXPECT_TRUE(thrust.is_known());
  thrust.advance(at(1.26), 0.1);
  EXPECT_FALSE(thrust.is_known());
  EXPECT_TRUE(thrust.is_too_slow());
  thrust.advance(at(1.6), 0.1);
  EXPECT_FALSE(thrust.is_too_slow());
}

TEST(RotorThrust, CountsWhatItRefuses) {
  RotorThrust thrust{vehicle(), InputSource::kAuto};
  thrust.on_commands(at(1), std::array{0.5, 0.5, 0.5});
  thrust.on_speeds(at(1), std::array{500.0, 500.0, 500.0});
  EXPECT_EQ(thrust.refused_messages(), 0);
  thrust.on_commands(at(1), std::array{0.9, kNan, 0.9});
  thrust.on_commands(at(1), std::array{0.9, 0.9});
  thrust.on_commands(at(0.5), std::array{0.9, 0.9, 0.9});
  thrust.on_speeds(at(1), std::array{900.0, 900.0, 900.0, 900.0});
  thrust.on_speeds(at(0.5), std::array{900.0, 900.0, 900.0});
  EXPECT_EQ(thrust.refused_messages(), 5);
  EXPECT_EQ(thrust.refused_speeds(), 0);
  thrust.on_speeds(at(1), std::array{kNan, std::numeric_limits<double>::infinity(), 1e9});
  EXPECT_EQ(thrust.refused_speeds(), 2);  // a rotor that did not report is no mistake
  thrust.advance(at(1), 0.001);
  EXPECT_DOUBLE_EQ(thrust.speed_rad_s(0), 500.0);
}

TEST(RotorThrust, AnInputFromTheFutureIsNone) {
  RotorThrust thrust{vehicle(), InputSource::kAuto};
  thrust.on_commands(at(10), std::array{0.5, 0.5, 0.5});
  thrust.advance(at(9.6), 0.001);
  EXPECT_TRUE(thrust.is_known());
  thrust.advance(at(9.4), 0.001);
  EXPECT_FALSE(thrust.is_known());
}

TEST(RotorThrust, OneStampFromTheFarFutureHealsWithTheNextInput) {
  RotorThrust thrust{vehicle(), InputSource::kAuto};
  thrust.on_commands(at(1), std::array{0.5, 0.5, 0.5});
  thrust.on_commands(at(5000), std::array{0.5, 0.5, 0.5});
  thrust.on_speeds(at(5000), std::array{500.0, 500.0, 500.0});
  thrust.advance(at(1.01), 0.01);
  EXPECT_FALSE(thrust.is_known());
  thrust.on_commands(at(1.02), std::array{0.5, 0.5, 0.5});
  thrust.advance(at(1.02), 0.01);
  EXPECT_TRUE(thrust.is_known());
  thrust.on_speeds(at(1.03), std::array{450.0, 500.0, 500.0});
  thrust.advance(at(1.03), 0.01);
  EXPECT_LT(thrust.speed_rad_s(0), 500.0);
  EXPECT_EQ(thrust.refused_messages(), 0);
  thrust.on_commands(at(1.01), std::array{0.9, 0.9, 0.9});  // and order counts again
  EXPECT_EQ(thrust.refused_messages(), 1);
}

TEST(RotorThrust, SpinningUpTakesTorque) {
  RotorThrust thrust{vehicle(), InputSource::kCommand};
  thrust.on_commands(at(0), std::array{0.0, 0.0, 0.0});
  thrust.advance(at(0), 0.001);
  EXPECT_DOUBLE_EQ(thrust.angular_momentum_N_m_s(), 1e-4 * (100 - 100 + 100));
  thrust.on_commands(at(0), std::array{0.5, 0.0, 0.0});
  thrust.advance(at(0.0001), 0.0001);
  EXPECT_NEAR(thrust.spin_up_torque_N_m(), 1e-4 * 400 / 0.05, 1e-3);  // J·Δω/τ at the beginning
}

TEST(RotorThrust, AJumpBetweenTwoInputsLeavesItsImpulseUncertain) {
  RotorThrust thrust{vehicle(), InputSource::kCommand};
  thrust.on_commands(at(0), std::array{0.0, 0.5, 0.5});
  thrust.on_commands(at(0.02), std::array{0.5, 0.5, 0.5});
  const RotorThrust::Missed all = thrust.take_missed();
  EXPECT_NEAR(all.period_s, 0.02, 1e-9);
  const auto& missed = all.impulse_m_s;
  EXPECT_NEAR(missed[0], 0.5 * 0.02 * 1e-5 / 2.0 * (500.0 * 500 - 100 * 100), 1e-12);
  EXPECT_EQ(missed[1], 0.0);
  EXPECT_EQ(thrust.take_missed().impulse_m_s[0], 0.0);
}

}  // namespace
}  // namespace airworthy::actuator
