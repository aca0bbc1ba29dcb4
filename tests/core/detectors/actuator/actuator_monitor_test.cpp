#include "core/detectors/actuator/actuator_monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>

#include "tests/support/allocation_guard.h"
#include "tests/support/hovering_multirotor.h"

namespace airworthy::actuator {
namespace {

using test::HoveringMultirotor;
using Transition = FaultLifeCycle::Transition;

/// A vehicle and the monitor that watches it.
class Flight {
 public:
  explicit Flight(std::size_t rotors, unsigned seed = 1, InputSource source = InputSource::kCommand)
      : body{rotors, seed}, monitor{params(body.vehicle, source)} {}

  static ActuatorMonitorParams params(const Multirotor& vehicle, InputSource source) {
    ActuatorMonitorParams params;
    params.vehicle = vehicle;
    params.source = source;
    return params;
  }

  [[nodiscard]] TimePoint now() const { return TimePoint{} + from_seconds(body.time_s); }

  void fly(double seconds, Phase phase = Phase::kInFlight) {
    const int steps = static_cast<int>(std::lround(seconds / HoveringMultirotor::kStep_s));
    for (int i = 0; i < steps; ++i) {
      body.step();
      ++steps_;
      if (steps_ % command_every == 0)
        monitor.on_rotor_commands(now(), std::span{body.command_ratio}.first(body.vehicle.rotor_count));
      if (steps_ % speed_every == 0)
        monitor.on_rotor_speeds(now(), std::span{body.speed_rad_s}.first(body.vehicle.rotor_count));
      if (freeze_gyro) body.gyro_rad_s = *freeze_gyro;
      for (std::size_t axis = 0; axis < 3; ++axis) body.gyro_rad_s[axis] += spike_rad_s;
      (void)monitor.on_imu({now(), body.accel_m_s2, body.gyro_rad_s}, phase);
      for (std::size_t r = 0; r < monitor.rotors().size(); ++r) {
        if (monitor.rotors()[r].transition != Transition::kRaise) continue;
        ++raised;
        if (!named) {
          named = r;
          raised_s = body.time_s;
          verdict = monitor.rotors()[r];
        }
      }
      for (const LossVerdict& axis : monitor.axes())
        axis_raised += axis.transition == Transition::kRaise ? 1 : 0;
    }
  }

  HoveringMultirotor body;
  ActuatorMonitor monitor;
  int command_every = 2;  ///< steps
  int speed_every = 2;
  std::optional<std::array<double, 3>> freeze_gyro;
  double spike_rad_s = 0;  ///< on all axes of the gyro
  std::optional<std::size_t> named;
  LossVerdict verdict;
  double raised_s = 0;
  int raised = 0;
  int axis_raised = 0;

 private:
  int steps_ = 0;
};

TEST(ActuatorMonitor, IsSilentWhileHealthyWhateverTheNumberOfRotors) {
  for (const std::size_t rotors : {4U, 6U, 8U}) {
    Flight flight{rotors};
    flight.fly(30);
    EXPECT_EQ(flight.raised, 0) << rotors;
    EXPECT_EQ(flight.axis_raised, 0) << rotors;
    EXPECT_EQ(flight.monitor.state(), DetectorState::kMonitoring);
    EXPECT_EQ(flight.monitor.refused(), 0);
    for (const LossVerdict& rotor : flight.monitor.rotors()) {
      EXPECT_EQ(rotor.reason, NotJudged::kJudged);
      EXPECT_NEAR(rotor.test_gamma, 0.0, 0.08);
    }
  }
}

TEST(ActuatorMonitor, NamesTheRotorAndMeasuresItsLoss) {
  for (const std::size_t rotors : {4U, 6U, 8U}) {
    for (const std::size_t failed : {0U, 3U}) {
      Flight flight{rotors, 7};
      flight.fly(30);
      flight.body.loss_ratio[failed] = 0.5;
      const double onset_s = flight.body.time_s;
      flight.fly(2);
      ASSERT_TRUE(flight.named) << rotors;
      EXPECT_EQ(*flight.named, failed) << rotors;
      EXPECT_EQ(flight.verdict.candidates >> failed & 1U, 1U);
      // Four forces tell four rotors apart; of more, neighbours act nearly alike and come as candidates at first.
      EXPECT_TRUE(flight.verdict.is_isolated || rotors > 4);
      EXPECT_EQ(flight.verdict.is_isolated, flight.verdict.candidates == 1U << failed);
      EXPECT_EQ(flight.raised, 1);
      EXPECT_EQ(flight.axis_raised, 0);
      EXPECT_LT(flight.raised_s - onset_s, rotors == 4 ? 0.5 : 1.5) << rotors;
      EXPECT_NEAR(to_seconds(flight.verdict.onset - TimePoint{}), onset_s, 0.15);
    }
  }
}

TEST(ActuatorMonitor, OfAQuadrotorEveryLossIsEstimated) {
  Flight flight{4, 3};
  flight.fly(30);
  flight.body.loss_ratio[2] = 0.3;
  flight.fly(3);
  for (std::size_t i = 0; i < 4; ++i) {
    const LossVerdict& rotor = flight.monitor.rotors()[i];
    EXPECT_NEAR(rotor.gamma - rotor.baseline, i == 2 ? 0.3 : 0.0, 0.08) << i;
    EXPECT_LT(rotor.sigma, 0.12);
  }
}

// What the rotors do about yaw by spinning up is as much as by their drag here.
TEST(ActuatorMonitor, TheTorqueOfRotorsThatSpinUpIsNoDisturbance) {
  HoveringMultirotor body{4, 5};
  body.vehicle.propeller_inertia_kg_m2 = 2e-4;
  body.yaw_excitation = 0.15;
  ActuatorMonitor monitor{Flight::params(body.vehicle, InputSource::kCommand)};
  double most_rad_s2 = 0.0;
  for (int i = 0; i < 10'000; ++i) {
    body.step();
    const TimePoint now = TimePoint{} + from_seconds(body.time_s);
    monitor.on_rotor_commands(now, std::span{body.command_ratio}.first(4));
    (void)monitor.on_imu({now, body.accel_m_s2, body.gyro_rad_s}, Phase::kInFlight);
    // The damping of the body is one, and comes late.
    const double damping_rad_s2 = -0.05 / 0.035 * body.rates_rad_s[2];
    if (i < 5000) continue;
    most_rad_s2 = std::max(most_rad_s2, std::abs(monitor.axis_states()[kYaw].disturbance - damping_rad_s2));
  }
  EXPECT_LT(most_rad_s2, 2.0);  // 3.6 if the torque were left out
}

TEST(ActuatorMonitor, WhatFailsWithinTwoSecondsIsAConsequence) {
  Flight flight{4, 3};
  flight.fly(40);
  flight.body.loss_ratio[0] = 0.5;
  flight.fly(0.5);
  ASSERT_EQ(flight.named, 0U);
  const double first_s = flight.raised_s;
  flight.body.loss_ratio[1] = 0.5;
  while (flight.body.time_s < first_s + 1.99) {
    flight.fly(HoveringMultirotor::kStep_s);
    ASSERT_EQ(flight.raised + flight.axis_raised, 1) << flight.body.time_s - first_s;
  }
  flight.named.reset();
  flight.fly(2);
  EXPECT_EQ(flight.named, 1U);
  EXPECT_EQ(flight.raised, 2);
}

// σ ≥ 1.5·√q, and q falls from first_spread² with a time constant of 10 s while nothing deviates.
TEST(ActuatorMonitor, ALossMustExceedTheSpreadOfTheFlight) {
  Flight flight{4, 3};
  for (const double seconds : {4.0, 10.0, 20.0}) {
    flight.fly(seconds - flight.body.time_s);
    for (const LossVerdict& rotor : flight.monitor.rotors()) {
      EXPECT_NEAR(rotor.test_sigma, 1.5 * 0.2 * std::exp(-seconds / 20.0), 0.03) << seconds;
    }
  }
  // The same loss is a fault where the flight has been calm, and none where it still may be the wind.
  for (const double flown_s : {4.0, 60.0}) {
    Flight young{4, 3};
    young.fly(flown_s);
    young.body.loss_ratio[1] = 0.4;
    young.fly(2);
    EXPECT_EQ(young.raised, flown_s > 30.0 ? 1 : 0) << flown_s;
  }
}

// A command that jumps may have done so at any time since the one before.
TEST(ActuatorMonitor, AJumpOfTheCommandsLeavesTheRatesUncertain) {
  Flight flight{4, 3};
  flight.body.excitation = 0.0;
  flight.command_every = 10;
  flight.fly(20);
  ActuatorMonitor calm = flight.monitor;
  flight.body.step();
  const MonitorSample sample{flight.now(), flight.body.accel_m_s2, flight.body.gyro_rad_s};
  std::array<double, 4> commands{};
  std::copy_n(flight.body.command_ratio.begin(), 4, commands.begin());
  calm.on_rotor_commands(sample.time, commands);
  commands[0] += 0.2;
  flight.monitor.on_rotor_commands(sample.time, commands);
  (void)calm.on_imu(sample, Phase::kInFlight);
  (void)flight.monitor.on_imu(sample, Phase::kInFlight);
  for (const Axis axis : {kRoll, kPitch}) {
    EXPECT_GT(flight.monitor.axis_states()[axis].rate_sigma, 1.15 * calm.axis_states()[axis].rate_sigma);
  }
}

TEST(ActuatorMonitor, AMotorThatDoesNotFollowIsALossThoughItsSpeedIsKnown) {
  Flight flight{4, 3, InputSource::kAuto};
  flight.fly(30);
  flight.body.loss_ratio[1] = 0.6;
  flight.fly(1);
  ASSERT_TRUE(flight.named);
  EXPECT_EQ(*flight.named, 1U);
}

TEST(ActuatorMonitor, ARotorThatGivesMoreIsNoLoss) {
  Flight flight{4, 3};
  flight.fly(30);
  flight.body.loss_ratio[2] = -0.25;
  flight.fly(5);
  EXPECT_EQ(flight.raised, 0);
}

TEST(ActuatorMonitor, AnAxisNobodyMovesIsNotExcited) {
  Flight flight{4, 5};
  flight.body.excitation = 0.0;
  flight.fly(20);
  for (const Axis axis : {kRoll, kPitch, kYaw}) {
    EXPECT_EQ(flight.monitor.axes()[axis].reason, NotJudged::kNotExcited);
    EXPECT_GT(flight.monitor.axes()[axis].sigma, 0.2);
  }
  EXPECT_EQ(flight.monitor.axes()[kHeight].reason, NotJudged::kJudged);  // weight is always carried
}

TEST(ActuatorMonitor, AnExcitedAxisIsKnown) {
  Flight flight{4, 5};
  flight.body.excitation = 6.0;
  flight.fly(20);
  for (const Axis axis : {kRoll, kPitch}) {
    EXPECT_EQ(flight.monitor.axes()[axis].reason, NotJudged::kJudged) << flight.monitor.axes()[axis].sigma;
    EXPECT_NEAR(flight.monitor.axes()[axis].gamma, 0.0, 0.3);
  }
}

TEST(ActuatorMonitor, TheCompensatedStateFollowsTheTruth) {
  Flight flight{4, 5};
  flight.fly(30);
  flight.body.loss_ratio[0] = 0.4;
  for (int i = 0; i < 500; ++i) {
    flight.fly(0.002);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const AxisState& state = flight.monitor.axis_states()[axis];
      ASSERT_NEAR(state.rate, flight.body.rates_rad_s[axis], 0.08);
      ASSERT_LT(state.rate_sigma, 0.06);
    }
  }
}

TEST(ActuatorMonitor, JudgesNothingOutsideFlight) {
  for (const Phase phase :
       {Phase::kOnGround, Phase::kTakeOff, Phase::kLanding, Phase::kContact, Phase::kUnknown}) {
    Flight flight{4};
    flight.body.loss_ratio[0] = 0.9;
    flight.fly(5, phase);
    EXPECT_EQ(flight.raised, 0);
    EXPECT_EQ(flight.monitor.state(), DetectorState::kMuted);
    EXPECT_EQ(flight.monitor.reason(), NotJudged::kNotFlying);
    EXPECT_TRUE(std::isnan(flight.monitor.axis_states()[kRoll].rate));
    EXPECT_TRUE(std::isnan(flight.monitor.rotors()[0].gamma));
  }
}

TEST(ActuatorMonitor, AFaultOutlivesALanding) {
  Flight flight{4};
  flight.fly(30);
  flight.body.loss_ratio[0] = 0.5;
  flight.fly(2);
  ASSERT_EQ(flight.raised, 1);
  flight.fly(2, Phase::kLanding);
  flight.fly(8);
  EXPECT_EQ(flight.raised, 1);  // latched: raised before, and not again
}

TEST(ActuatorMonitor, ARepairedRotorIsForgottenOnTheGround) {
  for (const std::size_t next : {0U, 2U}) {
    Flight flight{4};
    flight.fly(30);
    flight.body.loss_ratio[0] = 0.5;
    flight.fly(2);
    ASSERT_EQ(flight.named, 0U);
    flight.fly(4, Phase::kOnGround);
    flight.body.loss_ratio[0] = 0.0;
    for (const LossVerdict& rotor : flight.monitor.rotors()) EXPECT_EQ(rotor.baseline, 0.0);
    flight.fly(30);
    EXPECT_EQ(flight.raised, 1);
    flight.named.reset();
    flight.body.loss_ratio[next] = next == 0 ? 0.6 : 0.4;
    flight.fly(2);
    EXPECT_EQ(flight.raised, 2) << next;
    EXPECT_EQ(flight.named, next);
    EXPECT_EQ(flight.axis_raised, 0);
  }
}

TEST(ActuatorMonitor, ARotorThatIsNotRepairedBlamesNoOther) {
  Flight flight{4};
  flight.fly(30);
  flight.body.loss_ratio[3] = 0.5;
  flight.fly(2);
  flight.fly(60, Phase::kOnGround);
  flight.named.reset();
  flight.fly(60);
  EXPECT_EQ(flight.named.value_or(3), 3U);
}

TEST(ActuatorMonitor, ATouchOfTheGroundForgetsNothing) {
  Flight flight{4};
  flight.body.loss_ratio[0] = 0.1;
  flight.fly(30);
  const double baseline = flight.monitor.rotors()[0].baseline;
  ASSERT_GT(baseline, 0.05);
  for (int i = 0; i < 5; ++i) {
    flight.fly(2.5, Phase::kOnGround);
    flight.fly(0.5, Phase::kTakeOff);
  }
  EXPECT_EQ(flight.monitor.rotors()[0].baseline, baseline);
}

TEST(ActuatorMonitor, AFreshBatteryIsNotJudgedByTheOldOne) {
  Flight flight{4};
  for (std::size_t i = 0; i < 4; ++i) flight.body.loss_ratio[i] = 0.2;  // all alike: less thrust per command
  flight.fly(30);
  ASSERT_EQ(flight.raised, 0);
  EXPECT_NEAR(flight.monitor.axis_states()[kHeight].commanded, 0.8 * 9.81, 0.4);
  flight.fly(4, Phase::kOnGround);
  flight.fly(HoveringMultirotor::kStep_s);
  EXPECT_NEAR(flight.monitor.axis_states()[kHeight].commanded, 9.81, 0.4);
}

TEST(ActuatorMonitor, RefusesWhatIsNoSampleAndNoticesSilence) {
  Flight flight{4};
  EXPECT_EQ(flight.monitor.state(), DetectorState::kInitialising);
  flight.fly(5);
  const MonitorSample bad{
      flight.now() + from_seconds(0.002), {std::numeric_limits<double>::quiet_NaN(), 0, 0}, {}};
  EXPECT_EQ(flight.monitor.on_imu(bad, Phase::kInFlight), UpdateStatus::kNotFinite);
  EXPECT_EQ(
      flight.monitor.on_imu({flight.now(), flight.body.accel_m_s2, flight.body.gyro_rad_s}, Phase::kInFlight),
      UpdateStatus::kTimeBackward);
  EXPECT_EQ(flight.monitor.refused(), 2);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMonitoring);
  flight.monitor.on_clock(flight.now() + from_seconds(0.6));
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMuted);
  EXPECT_EQ(flight.monitor.reason(), NotJudged::kNoInput);
}

TEST(ActuatorMonitor, WhatIsNoAttitudeOrCommandIsCountedAndBlamesNobody) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  Flight flight{4};
  flight.fly(10);
  for (int i = 0; i < 2000; ++i) {
    flight.fly(HoveringMultirotor::kStep_s);
    flight.monitor.on_attitude(0.0, kNan, 0.0);
    flight.monitor.on_rotor_commands(flight.now(), std::array{kNan, 0.5, 0.5, 0.5});
  }
  EXPECT_EQ(flight.monitor.refused_attitudes(), 2000);
  EXPECT_EQ(flight.monitor.rotor_input().refused_messages(), 2000);
  EXPECT_EQ(flight.raised + flight.axis_raised, 0);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMonitoring);
}

TEST(ActuatorMonitor, AClockThatJumpsForwardStartsTheFlightAnewAndBlamesNobody) {
  Flight flight{4};
  flight.fly(20);
  flight.body.time_s += 3600;
  flight.fly(HoveringMultirotor::kStep_s);
  EXPECT_EQ(flight.monitor.reason(), NotJudged::kNoInput);  // what is known of the rotors is an hour old
  flight.fly(1);
  EXPECT_EQ(flight.monitor.reason(), NotJudged::kConverging);
  flight.fly(20);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMonitoring);
  EXPECT_EQ(flight.raised + flight.axis_raised, 0);
}

TEST(ActuatorMonitor, ABadGyroSampleBlamesNobody) {
  for (const double spike_rad_s : {10.0, -34.0, 34.0, 199.0}) {
    for (const double duration_s : {0.002, 0.04}) {
      Flight flight{4, 3};
      flight.fly(30);
      const double gamma = flight.monitor.rotors()[0].gamma;
      flight.spike_rad_s = spike_rad_s;
      flight.fly(duration_s);
      flight.spike_rad_s = 0;
      EXPECT_EQ(flight.monitor.outliers(), std::lround(duration_s / HoveringMultirotor::kStep_s));
      EXPECT_NEAR(flight.monitor.rotors()[0].gamma, gamma, 0.05);
      flight.fly(5);
      EXPECT_EQ(flight.raised + flight.axis_raised, 0) << spike_rad_s << ' ' << duration_s;
    }
  }
}

TEST(ActuatorMonitor, BadAccelerationsAreNoForce) {
  Flight flight{4, 3};
  flight.fly(30);
  const AxisState before = flight.monitor.axis_states()[kHeight];
  for (int i = 0; i < 20; ++i) {
    flight.body.step();
    const double bad_m_s2 = i % 2 == 0 ? 1500.0 : -1500.0;
    EXPECT_EQ(
        flight.monitor.on_imu({flight.now(), {0.0, 0.0, bad_m_s2}, flight.body.gyro_rad_s}, Phase::kInFlight),
        UpdateStatus::kFused);
    EXPECT_NEAR(flight.monitor.axis_states()[kHeight].rate, before.rate, 0.2);
  }
  EXPECT_GT(flight.monitor.axis_states()[kHeight].rate_sigma, 1.5 * before.rate_sigma);
  EXPECT_EQ(flight.monitor.outliers(), 20);
}

TEST(ActuatorMonitor, RefusesWhatNoSensorGives) {
  Flight flight{4, 3};
  flight.fly(10);
  const TimePoint time = flight.now() + from_seconds(0.002);
  for (const double beyond : {1e4, -1e4, 1e200}) {
    EXPECT_EQ(flight.monitor.on_imu({time, flight.body.accel_m_s2, {0.0, 0.0, beyond}}, Phase::kInFlight),
              UpdateStatus::kOutOfRange);
    EXPECT_EQ(flight.monitor.on_imu({time, {beyond, 0.0, -9.8}, flight.body.gyro_rad_s}, Phase::kInFlight),
              UpdateStatus::kOutOfRange);
  }
  EXPECT_EQ(flight.monitor.refused(), 6);
  flight.fly(5);
  EXPECT_EQ(flight.raised + flight.axis_raised, 0);
}

TEST(ActuatorMonitor, WhatNoLossExplainsIsBlamedOnNobodyAndBounded) {
  Flight flight{4, 3};
  flight.fly(30);
  flight.body.loss_ratio[1] = 3.5;  // it pulls down
  bool is_implausible = false;
  for (int i = 0; i < 500; ++i) {
    flight.fly(HoveringMultirotor::kStep_s);
    for (const LossVerdict& rotor : flight.monitor.rotors()) {
      ASSERT_GE(std::min(rotor.gamma, rotor.test_gamma), kLeastLoss);
      ASSERT_LE(std::max(rotor.gamma, rotor.test_gamma), kMostLoss);
      is_implausible = is_implausible || rotor.reason == NotJudged::kImplausible;
    }
    for (const LossVerdict& axis : flight.monitor.axes()) ASSERT_LE(std::abs(axis.gamma), kMostLoss);
  }
  EXPECT_TRUE(is_implausible);
}

TEST(ActuatorMonitor, AGyroThatFreezesForAMomentBlamesNobody) {
  Flight flight{4, 3};
  flight.body.excitation = 4.0;
  flight.fly(30);
  for (int i = 0; i < 20; ++i) {
    flight.freeze_gyro = flight.body.gyro_rad_s;
    const double sigma_rad_s = flight.monitor.axis_states()[kRoll].rate_sigma;
    flight.fly(0.05);
    ASSERT_GT(flight.monitor.axis_states()[kRoll].rate_sigma, 1.5 * sigma_rad_s);
    ASSERT_NEAR(flight.monitor.axis_states()[kRoll].rate, flight.body.rates_rad_s[0], 0.3);
    flight.freeze_gyro.reset();
    flight.fly(0.95);
    ASSERT_EQ(flight.monitor.state(), DetectorState::kMonitoring);
  }
  EXPECT_EQ(flight.monitor.repeated(), 20 * 25);
  EXPECT_EQ(flight.raised + flight.axis_raised, 0);
}

TEST(ActuatorMonitor, AGyroThatStaysFrozenMutesAndTheFlightStartsAnewAfterIt) {
  Flight flight{4, 3};
  flight.fly(30);
  flight.freeze_gyro = flight.body.gyro_rad_s;
  flight.fly(0.06);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMuted);
  EXPECT_EQ(flight.monitor.reason(), NotJudged::kFrozen);
  EXPECT_EQ(flight.monitor.rotors()[0].reason, NotJudged::kFrozen);
  flight.fly(20);
  EXPECT_EQ(flight.monitor.reason(), NotJudged::kFrozen);
  flight.freeze_gyro.reset();
  flight.fly(1);
  EXPECT_EQ(flight.monitor.reason(), NotJudged::kConverging);
  flight.fly(25);
  EXPECT_EQ(flight.raised + flight.axis_raised, 0);
  flight.body.loss_ratio[2] = 0.6;
  flight.fly(1);
  EXPECT_EQ(flight.named, 2U);
}

TEST(ActuatorMonitor, OneStampOfTheFutureCostsTenSamplesNotAnHour) {
  Flight flight{4};
  flight.fly(20);
  flight.body.step();
  const TimePoint future = flight.now() + std::chrono::hours{1};
  EXPECT_EQ(flight.monitor.on_imu({future, flight.body.accel_m_s2, flight.body.gyro_rad_s}, Phase::kInFlight),
            UpdateStatus::kFused);
  flight.fly(9 * HoveringMultirotor::kStep_s);
  EXPECT_EQ(flight.monitor.refused(), 9);
  flight.fly(HoveringMultirotor::kStep_s);
  EXPECT_EQ(flight.monitor.refused(), 9);
  EXPECT_EQ(flight.monitor.restarts(), 1);
  EXPECT_EQ(flight.monitor.time(), flight.now());
  flight.fly(25);
  EXPECT_EQ(flight.monitor.state(), DetectorState::kMonitoring);
  EXPECT_EQ(flight.raised + flight.axis_raised, 0);
  flight.body.loss_ratio[1] = 0.6;
  flight.fly(1);
  EXPECT_EQ(flight.named, 1U);
  EXPECT_EQ(flight.monitor.outliers(), 0);
}

TEST(ActuatorMonitor, AStampOfTheFutureAsTheLastIsSilence) {
  Flight flight{4};
  flight.fly(10);
  const TimePoint future = flight.now() + std::chrono::hours{1};
  flight.monitor.on_rotor_commands(future, std::span{flight.body.command_ratio}.first(4));
  (void)flight.monitor.on_imu({future, flight.body.accel_m_s2, flight.body.gyro_rad_s}, Phase::kOnGround);
  ASSERT_EQ(flight.monitor.reason(), NotJudged::kNotFlying);
  flight.monitor.on_clock(flight.now() + from_seconds(0.05));
  EXPECT_EQ(flight.monitor.reason(), NotJudged::kNoInput);
}

TEST(ActuatorMonitor, WithoutRotorInputItSaysSo) {
  HoveringMultirotor body{4, 1};
  ActuatorMonitor monitor{Flight::params(body.vehicle, InputSource::kAuto)};
  for (int i = 0; i < 100; ++i) {
    body.step();
    (void)monitor.on_imu({TimePoint{} + from_seconds(body.time_s), body.accel_m_s2, body.gyro_rad_s},
                         Phase::kInFlight);
  }
  EXPECT_EQ(monitor.reason(), NotJudged::kNoInput);
}

TEST(ActuatorMonitor, WithSlowInputNoAxisIsJudgedAndALostRotorIsNamed) {
  for (const int every : {2, 25, 50}) {  // 4, 50 and 100 ms
    Flight flight{4, 3};
    flight.body.excitation = 6.0;
    flight.command_every = every;
    flight.fly(40);
    EXPECT_EQ(flight.raised + flight.axis_raised, 0) << every;
    EXPECT_EQ(flight.monitor.axes()[kRoll].reason,
              every == 2 ? NotJudged::kJudged : NotJudged::kInputTooSlow);
    EXPECT_EQ(flight.monitor.rotors()[0].reason, NotJudged::kJudged);
    flight.body.loss_ratio[0] = 0.9;
    flight.fly(2);
    EXPECT_EQ(flight.named, 0U) << every;
  }
}

TEST(ActuatorMonitor, InputThatIsTooSlowMutes) {
  for (const InputSource source : {InputSource::kCommand, InputSource::kSpeed, InputSource::kAuto}) {
    Flight flight{4, 3, source};
    flight.command_every = flight.speed_every = 65;  // 130 ms
    flight.body.loss_ratio[0] = 0.9;
    flight.fly(10);
    EXPECT_EQ(flight.monitor.state(), DetectorState::kMuted);
    EXPECT_EQ(flight.monitor.reason(), NotJudged::kInputTooSlow);
    EXPECT_EQ(flight.monitor.rotors()[0].reason, NotJudged::kInputTooSlow);
    EXPECT_EQ(flight.raised + flight.axis_raised, 0);
  }
}

TEST(ActuatorMonitor, TimeShiftChangesNothingAndNoHeapIsUsed) {
  HoveringMultirotor body{4, 1};
  ActuatorMonitor early{Flight::params(body.vehicle, InputSource::kCommand)};
  ActuatorMonitor late{Flight::params(body.vehicle, InputSource::kCommand)};
  const Duration shift = from_seconds(1e6);
  const test::AllocationGuard guard;
  for (int i = 0; i < 3000; ++i) {
    body.step();
    const TimePoint now = TimePoint{} + from_seconds(body.time_s);
    const auto commands = std::span{body.command_ratio}.first(4);
    early.on_rotor_commands(now, commands);
    late.on_rotor_commands(now + shift, commands);
    (void)early.on_imu({now, body.accel_m_s2, body.gyro_rad_s}, Phase::kInFlight);
    (void)late.on_imu({now + shift, body.accel_m_s2, body.gyro_rad_s}, Phase::kInFlight);
  }
  ASSERT_EQ(guard.allocations(), 0);
  EXPECT_EQ(early.state(), DetectorState::kMonitoring);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(early.rotors()[i].gamma, late.rotors()[i].gamma);
}

}  // namespace
}  // namespace airworthy::actuator
