#include "core/detectors/effectiveness/effectiveness_monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/allocation_guard.h"
#include "tests/support/hovering_quad.h"

namespace airworthy::effectiveness {
namespace {

constexpr double kStep_s = 0.002;

EffectivenessParams params() {
  EffectivenessParams result;
  result.vehicle = test::HoveringQuad::described();
  result.vehicle.propeller_radius_m = 0.07;
  result.vehicle.motor_time_constant_s = 0.02;
  result.vehicle.speed_min_rad_s = 100.0;
  result.vehicle.speed_max_rad_s = 1300.0;
  result.effectiveness = EffectivenessMatrix<double>::of(result.vehicle);
  result.speeds = {
      .rotor_count = 4, .time_constant_s = 0.02, .speed_min_rad_s = 100.0, .speed_max_rad_s = 1300.0};
  result.mapping_is_known = true;
  return result;
}

/// Hover of a body that answers exactly as described, with white noise of the sensors.
class Hover : public test::HoveringQuad {
 public:
  explicit Hover(const EffectivenessParams& given = params())
      : HoveringQuad{17}, monitor{given}, imu_position_m_{given.vehicle.imu_position_m} {
    under_way_.reserve(64);
  }

  EffectivenessMonitor monitor;
  std::array<double, 3> push_m_s2{};
  Phase phase = Phase::kInFlight;
  Duration inertial_late{0};  ///< how much later than the speeds the inertial data are stamped
  Duration reports_late{0};   ///< how long the reports are on their way
  int report_every = 1;       ///< so many steps
  bool sends_commands = false;
  bool frozen_gyro = false;
  bool frozen_accel = false;
  bool holds = false;  ///< every inertial sample comes twice
  double step_s = kStep_s;
  std::optional<LossEvent> event;

  void jump(double seconds) { time_s_ += seconds; }

  void fly(double seconds) {
    for (double t = 0.0; t < seconds && !event; t += step_s) {
      time_s_ += step_s;
      tell_speeds(step_body());
      if (event) return;
      measure();
      event = monitor.on_imu(now() + inertial_late, accel_m_s2_, gyro_rad_s_, phase);
    }
  }

  /// The body moves on, and no inertial sample arrives.
  void fly_unmeasured(double seconds) {
    for (double t = 0.0; t < seconds && !event; t += step_s) {
      time_s_ += step_s;
      tell_speeds(step_body());
    }
  }

  [[nodiscard]] TimePoint now() const { return from_us(1'000'000 + std::llround(time_s_ * 1e6)); }

 private:
  struct Report {
    TimePoint stamp;
    std::array<double, 4> speed_rad_s;
  };

  /// One step; the speeds as measured.
  std::array<double, 4> step_body() {
    std::array<double, 4> speed{};
    step(step_s, [&](std::size_t i, double speed_rad_s) { speed[i] = speed_rad_s + noise(0.5); });
    return speed;
  }

  void tell_speeds(const std::array<double, 4>& speed_rad_s) {
    if (sends_commands) {
      std::array<double, 4> command{};
      for (std::size_t i = 0; i < 4; ++i) command[i] = (speed_rad_s[i] - 100.0) / 1200.0;
      event = monitor.on_commands(now(), command);
      if (event) return;
    }
    if (steps_++ % report_every == 0) under_way_.push_back({now(), speed_rad_s});
    while (!event && !under_way_.empty() && now() - under_way_.front().stamp >= reports_late) {
      event = monitor.on_speeds(under_way_.front().stamp, under_way_.front().speed_rad_s);
      under_way_.erase(under_way_.begin());
    }
  }

  void measure() {
    if (holds && steps_ % 2 == 0) return;
    const std::array accel{push_m_s2[0] + noise(0.3), push_m_s2[1] + noise(0.3),
                           push_m_s2[2] + measured_vertical_m_s2()};
    const auto gyro = measured_rates_rad_s();
    if (!frozen_gyro) gyro_rad_s_ = gyro;
    if (frozen_accel) return;
    accel_m_s2_ = accel;
    const auto turning = turning_rad_s2();
    accel_m_s2_[0] += turning[1] * imu_position_m_[2];
    accel_m_s2_[1] -= turning[0] * imu_position_m_[2];
  }

  std::array<double, 3> imu_position_m_;
  std::array<double, 3> accel_m_s2_{};
  std::array<double, 3> gyro_rad_s_{};
  std::vector<Report> under_way_;
  int steps_ = 0;
  double time_s_ = 0.0;
};

/// Takes all its thrust from a rotor, counted from 0, which must be named within `seconds`. Returns the delay.
Duration lose_propeller(Hover& hover, std::size_t rotor, double seconds) {
  EXPECT_FALSE(hover.event) << "before the loss";
  hover.effectiveness[rotor] = 0.0;
  const TimePoint onset = hover.now();
  hover.fly(seconds);
  EXPECT_TRUE(hover.event);
  if (!hover.event) return Duration::max();
  EXPECT_EQ(hover.event->rotor, rotor);
  return hover.event->decided - onset;
}

TEST(EffectivenessMonitor, FindsEachRotorAndLatches) {
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    Hover hover;
    hover.fly(5.0);
    ASSERT_FALSE(hover.event);
    ASSERT_EQ(hover.monitor.muted(), Muted::kNot);
    hover.effectiveness[rotor] = 0.0;
    const TimePoint onset = hover.now();
    hover.fly(0.2);
    ASSERT_TRUE(hover.event);
    EXPECT_EQ(hover.event->rotor, rotor);
    EXPECT_EQ(hover.event->kind, LossKind::kPropellerLost);
    EXPECT_LT(hover.event->decided - onset, Duration{20'000});
    EXPECT_LE(std::abs((hover.event->onset - onset).count()), 4'000);
    EXPECT_EQ(hover.monitor.lost_rotor(), rotor);
    EXPECT_EQ(hover.monitor.muted(), Muted::kRotorLost);
    hover.event.reset();
    hover.fly(1.0);
    EXPECT_FALSE(hover.event) << "said once";
  }
}

TEST(EffectivenessMonitor, ReadsWhatIsLeftAndThenWhatIsLost) {
  Hover hover;
  hover.fly(5.0);
  hover.effectiveness[1] = 0.6;
  hover.fly(1.0);
  ASSERT_TRUE(hover.event);
  EXPECT_EQ(hover.event->kind, LossKind::kPartialLoss);
  EXPECT_NEAR(hover.event->effectiveness, 0.6, 4.0 * hover.event->sigma + 0.02);
  hover.event.reset();
  hover.fly(3.0);
  EXPECT_FALSE(hover.event) << "the model now expects it";
  hover.effectiveness[1] = 0.0;
  hover.fly(1.0);
  ASSERT_TRUE(hover.event);
  EXPECT_EQ(hover.event->rotor, 1U);
  EXPECT_EQ(hover.event->kind, LossKind::kPropellerLost);
}

TEST(EffectivenessMonitor, ASuddenExcessIsNobodysFault) {
  Hover hover;
  hover.fly(5.0);
  hover.effectiveness[2] = 1.4;
  hover.fly(3.0);
  EXPECT_FALSE(hover.event);
  EXPECT_GT(hover.monitor.impossible_gains(), 0);
  hover.effectiveness[1] = 0.0;
  hover.fly(1.0);
  ASSERT_TRUE(hover.event);
  EXPECT_EQ(hover.event->rotor, 1U);
  EXPECT_EQ(hover.event->kind, LossKind::kPropellerLost);
}

/// Everything that is said within `seconds`.
std::vector<LossEvent> said_within(Hover& hover, double seconds) {
  std::vector<LossEvent> said;
  const TimePoint end = hover.now() + Duration{std::llround(seconds * 1e6)};
  while (hover.now() < end) {
    hover.event.reset();
    hover.fly(to_seconds(end - hover.now()));
    if (hover.event) said.push_back(*hover.event);
  }
  hover.event.reset();
  return said;
}

/// In flight with a propeller on rotor i + 1 that gives half as much again, which is known.
void fly_with_known_excess(Hover& hover, std::size_t rotor) {
  hover.wander_ratio = 0.05;
  hover.effectiveness[rotor] = 1.5;
  const auto said = said_within(hover, 60.0);
  ASSERT_FALSE(said.empty());
  ASSERT_EQ(said.front().kind, LossKind::kOverEffective);
  ASSERT_EQ(said.front().rotor, rotor);
  ASSERT_TRUE(hover.monitor.slow().is_active(rotor));
}

TEST(EffectivenessMonitor, AnExcessThatGoesIsOverAndNoLoss) {
  Hover hover;
  fly_with_known_excess(hover, 2);
  hover.effectiveness[2] = 1.0;
  const auto said = said_within(hover, 3.0);
  ASSERT_FALSE(said.empty());
  for (const LossEvent& event : said) {
    EXPECT_EQ(event.kind, LossKind::kOverEffective) << event.effectiveness;
    EXPECT_EQ(event.rotor, 2U);
  }
  EXPECT_TRUE(said.back().is_over);
  EXPECT_NEAR(said.back().effectiveness, 1.0, 0.075);
  EXPECT_FALSE(hover.monitor.slow().is_active(2));
}

TEST(EffectivenessMonitor, AnExcessThatBecomesALossIsALoss) {
  Hover hover;
  fly_with_known_excess(hover, 2);
  hover.effectiveness[2] = 0.7;
  const auto said = said_within(hover, 5.0);
  ASSERT_FALSE(said.empty());
  EXPECT_EQ(said.back().kind, LossKind::kPartialLoss);
  EXPECT_NEAR(said.back().effectiveness, 0.7, 0.1);
  EXPECT_FALSE(said.back().is_over);
  EXPECT_FALSE(hover.monitor.slow().is_active(2));
}

TEST(EffectivenessMonitor, ALossThatComesBackIsNoExcess) {
  for (const double back : {1.0, 1.1}) {
    Hover hover;
    hover.fly(5.0);
    hover.effectiveness[1] = 0.7;
    ASSERT_FALSE(said_within(hover, 3.0).empty());
    hover.effectiveness[1] = back;
    const auto said = said_within(hover, 3.0);
    ASSERT_FALSE(said.empty()) << back;
    for (const LossEvent& event : said) EXPECT_EQ(event.kind, LossKind::kPartialLoss) << event.effectiveness;
    EXPECT_EQ(said.back().rotor, 1U);
    EXPECT_NEAR(said.back().effectiveness, back, 0.08);
  }
}

// A propeller may be changed on the ground; a loss stays latched.
TEST(EffectivenessMonitor, OnTheGroundNobodyGivesTooMuchAnyMore) {
  Hover hover;
  fly_with_known_excess(hover, 3);
  hover.effectiveness[1] = 0.6;
  ASSERT_FALSE(said_within(hover, 3.0).empty());
  ASSERT_GT(hover.monitor.effectiveness(3), 1.2);
  ASSERT_TRUE(hover.monitor.slow().is_active(3));
  hover.phase = Phase::kOnGround;
  hover.fly(0.1);
  EXPECT_EQ(hover.monitor.effectiveness(3), 1.0);
  EXPECT_NEAR(hover.monitor.effectiveness(1), 0.6, 0.15);
  EXPECT_TRUE(hover.monitor.slow().is_active(3)) << "to be judged in the next flight";
}

TEST(EffectivenessMonitor, AnExcessThatWasFoundSlowlyIsKnownToTheFastTest) {
  Hover hover;
  hover.wander_ratio = 0.05;
  hover.effectiveness[0] = 1.5;
  hover.fly(60.0);
  ASSERT_TRUE(hover.event);
  EXPECT_EQ(hover.event->kind, LossKind::kOverEffective);
  EXPECT_EQ(hover.event->rotor, 0U);
  EXPECT_NEAR(hover.event->effectiveness, 1.5, 0.15);
  EXPECT_EQ(hover.monitor.effectiveness(0), hover.event->effectiveness);
  hover.event.reset();
  said_within(hover, 5.0);
  hover.effectiveness[0] = 1.1;
  const auto said = said_within(hover, 5.0);
  ASSERT_FALSE(said.empty());
  for (const LossEvent& event : said) EXPECT_EQ(event.kind, LossKind::kOverEffective) << event.effectiveness;
  EXPECT_NEAR(hover.monitor.effectiveness(0), 1.1, 0.15);
}

TEST(EffectivenessMonitor, IsMutedWithAReason) {
  Hover hover;
  hover.phase = Phase::kTakeOff;
  hover.effectiveness = {1.0, 1.0, 0.0, 1.0};
  hover.fly(1.0);
  EXPECT_FALSE(hover.event);
  EXPECT_EQ(hover.monitor.muted(), Muted::kPhase);
  hover.effectiveness = {1.0, 1.0, 1.0, 1.0};
  hover.phase = Phase::kInFlight;
  hover.fly(0.2);
  EXPECT_EQ(hover.monitor.muted(), Muted::kSettling);
  hover.fly(1.0);
  EXPECT_EQ(hover.monitor.muted(), Muted::kNot);
  hover.push_m_s2 = {0.0, 8.0, 0.0};
  hover.fly(0.05);
  EXPECT_EQ(hover.monitor.muted(), Muted::kStruck);
  EXPECT_FALSE(hover.event);

  Hover slow;
  slow.step_s = 0.025;
  slow.fly(5.0);
  EXPECT_EQ(slow.monitor.muted(), Muted::kTooSlow);
}

// Leaving the ground, thrust and drag change as if a little were lost; a great loss cannot wait.
TEST(EffectivenessMonitor, SoonAfterTakeOffOnlyGreatLossesCount) {
  for (const double left : {0.7, 0.0}) {
    Hover hover;
    hover.fly(1.0);
    hover.effectiveness[1] = left;
    hover.fly(1.0);
    EXPECT_EQ(hover.event.has_value(), left == 0.0);
  }
}

TEST(EffectivenessMonitor, WhatIsOverWithinTwoSamplesIsNoLoss) {
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    Hover hover;
    hover.fly(5.0);
    hover.effectiveness[rotor] = 0.0;
    hover.fly(2.0 * kStep_s);
    hover.effectiveness[rotor] = 1.0;
    hover.fly(1.0);
    EXPECT_FALSE(hover.event) << rotor;
  }
}

// What the body did meanwhile is unknown.
TEST(EffectivenessMonitor, AfterAGapTheMotionStartsAnew) {
  Hover hover;
  hover.wander_ratio = 0.1;
  hover.fly(5.0);
  for (int gap = 0; gap < 100 && !hover.event; ++gap) {
    hover.fly_unmeasured(0.3);
    hover.fly(0.5);
  }
  lose_propeller(hover, 1, 0.2);
}

// The body turns faster within a step than it is measured: what counts is that the model follows.
TEST(EffectivenessMonitor, FindsALossInSeldomSamples) {
  for (const double step_s : {0.01, 0.015, 0.019}) {
    Hover hover;
    hover.step_s = step_s;
    hover.fly(8.0);
    ASSERT_FALSE(hover.event);
    ASSERT_EQ(hover.monitor.muted(), Muted::kNot) << step_s;
    EXPECT_LT(lose_propeller(hover, 3, 0.5), Duration{60'000}) << step_s;
  }
}

TEST(EffectivenessMonitor, RotorsThatHardlyLiftAreNotJudged) {
  Hover hover;
  hover.fly(5.0);
  double judged_s = hover.monitor.judged_s();
  const double time_s = to_seconds(hover.now().time_since_epoch());
  for (int i = 1; i <= 100; ++i) {
    const TimePoint time = from_us(std::llround((time_s + i * kStep_s) * 1e6));
    static_cast<void>(hover.monitor.on_speeds(time, std::array{110.0 + 0.1 * (i % 3), 110.0, 110.0, 110.0}));
    const double noise = 1e-4 * (i % 2);
    EXPECT_FALSE(hover.monitor.on_imu(time, {0.0, 0.0, -0.3 + noise}, {noise, 0.0, 0.0}, Phase::kInFlight));
  }
  EXPECT_EQ(hover.monitor.muted(), Muted::kNoThrust);
  EXPECT_LT(hover.monitor.judged_s() - judged_s, 0.1);
}

TEST(EffectivenessMonitor, ShowsWhatBecameOfEverySample) {
  Hover hover;
  struct Seen {
    double judged_s = 0.0;
    double muted_s = 0.0;
  } seen;
  hover.monitor.observe_judgement(
      [](void* context, const EffectivenessMonitor::Judgement& judgement) {
        auto& sums = *static_cast<Seen*>(context);
        (judgement.muted == Muted::kNot ? sums.judged_s : sums.muted_s) +=
            to_seconds(judgement.time - judgement.from);
      },
      &seen);
  hover.fly(3.0);
  EXPECT_NEAR(seen.judged_s, hover.monitor.judged_s(), 0.01);
  EXPECT_NEAR(seen.judged_s + seen.muted_s, 3.0, 0.01);
  EXPECT_NEAR(seen.muted_s, 0.5, 0.01) << "settling";
}

TEST(EffectivenessMonitor, ShowsWhatBecameOfASampleByItsOwnStamp) {
  EffectivenessParams described = params();
  described.learns_inertial_delay = true;
  Hover hover{described};
  hover.wander_ratio = 0.05;
  hover.inertial_late = Duration{30'000};
  EffectivenessMonitor::Judgement last{};
  hover.monitor.observe_judgement(
      [](void* context, const EffectivenessMonitor::Judgement& judgement) {
        *static_cast<EffectivenessMonitor::Judgement*>(context) = judgement;
      },
      &last);
  hover.fly(20.0);
  ASSERT_GT(hover.monitor.inertial_delay(), Duration{10'000});
  EXPECT_EQ(last.muted, Muted::kNot);
  const Duration waiting = hover.now() + hover.inertial_late - last.time;
  EXPECT_LT(waiting, hover.monitor.inertial_delay());
  EXPECT_EQ(waiting % Duration{2'000}, Duration{0}) << "a stamp that was given";
  EXPECT_EQ(last.time - last.from, Duration{2'000});
}

TEST(EffectivenessMonitor, ABlowIsNoLoss) {
  Hover hover;
  hover.fly(5.0);
  // Rates of a body that was hit: within one sample more than all rotors together give.
  const double time_s = to_seconds(hover.now().time_since_epoch());
  for (int i = 1; i <= 10; ++i) {
    const TimePoint time = from_us(std::llround((time_s + i * kStep_s) * 1e6));
    static_cast<void>(hover.monitor.on_speeds(time, std::array{640.0, 640.0, 640.0, 640.0}));
    EXPECT_FALSE(hover.monitor.on_imu(time, {0.0, 0.0, 5.0}, {3.0 * i, -3.0 * i, 0.0}, Phase::kInFlight));
  }
}

TEST(EffectivenessMonitor, RefusesWhatIsNoNumberAndTimesThatGoBack) {
  Hover hover;
  hover.fly(1.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(hover.monitor.on_imu(hover.now() + Duration{2'000}, {0.0, nan, -9.8}, {}, Phase::kInFlight));
  EXPECT_EQ(hover.monitor.samples_dropped(), 1);
  EXPECT_FALSE(hover.monitor.on_imu(hover.now(), {0.0, 0.0, -9.8}, {}, Phase::kInFlight));
  EXPECT_EQ(hover.monitor.times_gone_back(), 1);
  hover.fly(3.0);
  EXPECT_EQ(hover.monitor.muted(), Muted::kNot);
  EXPECT_FALSE(hover.event);
}

TEST(EffectivenessMonitor, AClockThatJumpsForwardBlamesNobody) {
  for (const double seconds : {0.3, 5.0, 3600.0}) {
    SCOPED_TRACE(seconds);
    Hover hover;
    hover.fly(10.0);
    hover.jump(seconds);
    hover.fly(10.0);
    EXPECT_FALSE(hover.event) << seconds;
    EXPECT_EQ(hover.monitor.muted(), Muted::kNot) << seconds;
    lose_propeller(hover, 1, 0.2);
  }
}

TEST(EffectivenessMonitor, AfterARepairEveryRotorIsJudgedAgain) {
  for (const double left : {0.0, 0.5}) {
    Hover hover;
    hover.fly(5.0);
    hover.effectiveness[1] = left;
    ASSERT_FALSE(said_within(hover, 2.0).empty());
    hover.phase = Phase::kOnGround;
    hover.effectiveness[1] = 1.0;
    hover.settle();
    hover.fly(9.0);
    EXPECT_NEAR(hover.monitor.effectiveness(1), left, 0.1) << "not yet";
    hover.fly(2.0);
    EXPECT_EQ(hover.monitor.effectiveness(1), 1.0);
    EXPECT_FALSE(hover.monitor.lost_rotor());
    hover.phase = Phase::kInFlight;
    EXPECT_TRUE(said_within(hover, 5.0).empty());
    ASSERT_EQ(hover.monitor.muted(), Muted::kNot);
    hover.effectiveness[3] = 0.0;
    const auto said = said_within(hover, 1.0);
    ASSERT_EQ(said.size(), 1U);
    EXPECT_EQ(said.front().rotor, 3U);
    EXPECT_EQ(said.front().kind, LossKind::kPropellerLost);
  }
}

// A gyroscope that repeats its last value while the body turns on: nobody has lost anything.
TEST(EffectivenessMonitor, AnInertialUnitThatRepeatsItselfIsNoMeasurement) {
  for (const bool is_gyro : {true, false}) {
    Hover hover;
    hover.wander_ratio = 0.05;
    hover.fly(5.0);
    ASSERT_EQ(hover.monitor.muted(), Muted::kNot);
    hover.frozen_gyro = is_gyro;
    hover.frozen_accel = !is_gyro;
    hover.fly(0.1);
    EXPECT_EQ(hover.monitor.muted(), Muted::kFrozen);
    EXPECT_EQ(hover.monitor.samples_repeated() > 40, is_gyro);
    hover.frozen_gyro = hover.frozen_accel = false;
    hover.fly(5.0);
    EXPECT_FALSE(hover.event) << "rotor " << hover.event->rotor + 1;
    EXPECT_EQ(hover.monitor.muted(), Muted::kNot);
    lose_propeller(hover, 1, 0.2);
  }
}

// Every second sample twice, as where a driver polls faster than the sensor measures.
TEST(EffectivenessMonitor, HeldSamplesDoNotHinder) {
  Hover hover;
  hover.holds = true;
  hover.fly(5.0);
  EXPECT_FALSE(hover.event);
  EXPECT_EQ(hover.monitor.muted(), Muted::kNot);
  EXPECT_LT(lose_propeller(hover, 3, 0.2), Duration{25'000});
}

TEST(EffectivenessMonitor, WhatNoSensorMeasuresIsRefusedAndForgotten) {
  for (const double value : {201.0, 1e200, -1e200}) {
    SCOPED_TRACE(value);
    Hover hover;
    hover.fly(5.0);
    hover.jump(kStep_s);
    EXPECT_FALSE(
        hover.monitor.on_imu(hover.now(), {0.0, 0.0, -9.8}, {value, value, value}, Phase::kInFlight));
    EXPECT_FALSE(hover.monitor.on_imu(hover.now(), {2001.0, 0.0, -9.8}, {}, Phase::kInFlight));
    EXPECT_EQ(hover.monitor.samples_dropped(), 2);
    hover.fly(3.0);
    EXPECT_FALSE(hover.event);
    EXPECT_EQ(hover.monitor.muted(), Muted::kNot);
    EXPECT_NEAR(hover.monitor.gyro_sigma(0), 0.02, 0.01);
    lose_propeller(hover, 1, 0.2);
  }
}

TEST(EffectivenessMonitor, OneStampOfTheFutureIsForgotten) {
  Hover hover;
  hover.fly(5.0);
  const TimePoint before = hover.now();
  EXPECT_FALSE(hover.monitor.on_imu(hover.now() + std::chrono::hours{1}, {0.01, 0.0, -9.8}, {0.01, 0.0, 0.0},
                                    Phase::kInFlight));
  hover.fly(4.0);
  EXPECT_FALSE(hover.event);
  EXPECT_EQ(hover.monitor.stamps_restarted(), 1);
  EXPECT_EQ(hover.monitor.newest_sample(), hover.now());
  EXPECT_GT(hover.monitor.newest_sample(), before);
  EXPECT_EQ(hover.monitor.muted(), Muted::kNot);
  lose_propeller(hover, 2, 0.2);
}

// Stamped when it was measured, telemetry may be on its way for longer than its interval: no rotor is silent for that.
TEST(EffectivenessMonitor, LateReportsAreNoSilence) {
  for (const int late_ms : {0, 15, 25, 60}) {
    Hover hover;
    hover.reports_late = Duration{1'000 * late_ms};
    hover.sends_commands = true;
    hover.fly(5.0);
    ASSERT_FALSE(hover.event) << late_ms;
    EXPECT_LT(lose_propeller(hover, 1, 0.3), Duration{25'000}) << late_ms;
  }
}

TEST(EffectivenessMonitor, WithoutCommandsReportsMustBeFrequentAndInTime) {
  Hover late;
  late.reports_late = Duration{40'000};
  late.fly(5.0);
  EXPECT_EQ(late.monitor.muted(), Muted::kSpeedsLate);
  Hover seldom;
  seldom.report_every = 25;  // 50 ms
  seldom.fly(5.0);
  EXPECT_EQ(seldom.monitor.muted(), Muted::kSpeedsLate);
  seldom.sends_commands = true;
  seldom.fly(5.0);
  EXPECT_EQ(seldom.monitor.muted(), Muted::kNot);
}

// The accelerometer hangs far below the centre of mass: when a rotor stops, the body turns it sideways.
TEST(EffectivenessMonitor, AnAccelerometerBesideTheCentreOfMassFeelsNoPush) {
  EffectivenessParams described = params();
  described.vehicle.imu_position_m = {0.0, 0.0, -0.08};
  Hover hover{described};
  hover.fly(5.0);
  EXPECT_LT(lose_propeller(hover, 1, 0.3), Duration{25'000});
}

TEST(EffectivenessMonitor, UsesNoHeap) {
  Hover hover;
  const test::AllocationGuard guard;
  hover.fly(2.0);
  EXPECT_EQ(guard.allocations(), 0U);
}

}  // namespace
}  // namespace airworthy::effectiveness
