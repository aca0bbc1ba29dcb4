#include "core/detectors/response/arx_channel.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/detectors/response/response_monitor.h"
#include "tests/support/allocation_guard.h"

namespace airworthy::response {
namespace {

using Transition = FaultLifeCycle::Transition;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr Duration kStep{50'000};

ArxParams second_order() {
  ArxParams params;
  params.past_outputs = 2;
  params.past_inputs = 2;
  params.threshold_sigmas = 6.0;  // twice in 1e9 samples of normal noise
  return params;
}

FaultLifeCycleParams life_cycle() {
  FaultLifeCycleParams params;
  params.clear_ratio = 0.9;
  return params;
}

/// A damped response of the second order to a square wave, sampled 20 times a second.
class Pair {
 public:
  explicit Pair(unsigned seed) : random_{seed} {}

  double gain = 1.0;
  double input = 0;
  double output = 0;

  void step() {
    input = (count_++ / 60) % 2 == 0 ? 0.3 : -0.3;
    const double next = 1.5 * output - 0.6 * before_ + gain * 0.1 * input + 0.002 * normal_(random_);
    before_ = output;
    output = next;
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  int count_ = 0;
  double before_ = 0;
};

/// One sample and one tick at a time.
class Rig {
 public:
  explicit Rig(const ArxParams& params, unsigned seed = 1)
      : channel{params, life_cycle(), Duration{0}}, pair{seed} {}

  ChannelVerdict step() {
    now += kStep;
    pair.step();
    channel.sample(now, pair.input, pair.output);
    return tick();
  }
  ChannelVerdict tick() { return channel.step(now, now - from_us(0), false); }

  ArxChannel channel;
  Pair pair;
  TimePoint now = from_us(1'000'000);
};

// The whole method once more, in the plainest form: dense least squares, moments in two passes.
TEST(ArxChannel, EqualsThePlainReference) {
  for (const int order : {2, 6}) {
    ArxParams params = second_order();
    params.past_outputs = order;
    params.past_inputs = order + 1;
    params.prior_variance = 1e4;
    params.moments_after_samples = 10;
    Rig rig{params, 3};
    const int n = 2 * order + 2;
    Eigen::VectorXd theta = Eigen::VectorXd::Zero(n);
    Eigen::MatrixXd p = 1e4 * Eigen::MatrixXd::Identity(n, n);
    std::vector<double> inputs;
    std::vector<double> outputs;
    std::vector<double> errors;
    int settled = 0;
    bool armed = false;
    int judged = 0;
    for (int i = 0; i < 600; ++i) {
      if (i == 500) rig.pair.gain = 0.2;
      const ChannelVerdict verdict = rig.step();
      if (i >= order + 1) {
        Eigen::VectorXd x(n);
        x(0) = rig.pair.input;
        for (int j = 0; j < order; ++j) x(1 + j) = outputs[outputs.size() - 1 - static_cast<std::size_t>(j)];
        for (int j = 0; j < order + 1; ++j) {
          x(1 + order + j) = inputs[inputs.size() - 1 - static_cast<std::size_t>(j)];
        }
        const Eigen::VectorXd k = p * x / (1.0 + x.dot(p * x));
        const double e = rig.pair.output - x.dot(theta);
        theta += k * e;
        p -= k * x.transpose() * p;
        settled = (k * e).cwiseAbs().maxCoeff() < params.settled_change ? settled + 1 : 0;
        armed = armed || (i - order >= params.arm_after_samples && settled >= params.settled_samples);
        ASSERT_EQ(verdict.reason == NotJudged::kJudged, armed) << i;
        if (armed) {
          double mean = 0;
          for (std::size_t j = 10; j < errors.size(); ++j) mean += errors[j];
          const double count = static_cast<double>(errors.size()) - 10;
          mean /= count;
          double squares = 0;
          for (std::size_t j = 10; j < errors.size(); ++j) squares += (errors[j] - mean) * (errors[j] - mean);
          const double sigma = std::sqrt(squares / (count - 1));
          ASSERT_NEAR(verdict.sigma, sigma, 1e-6 * sigma) << i;
          ASSERT_NEAR(verdict.test_ratio, std::abs(e - mean) / sigma / 6.0, 1e-4) << i;
          ASSERT_EQ(verdict.observed, rig.pair.output);
          ++judged;
        }
        errors.push_back(e);
      }
      inputs.push_back(rig.pair.input);
      outputs.push_back(rig.pair.output);
    }
    EXPECT_GT(judged, 300);
  }
}

TEST(ArxChannel, SilentInHealthAndFindsALostGainAtTheNextCommand) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Rig rig{second_order(), seed};
    for (int i = 0; i < 6000; ++i) ASSERT_NE(rig.step().transition, Transition::kRaise) << seed << ' ' << i;
    rig.pair.gain = 0.0;  // 0.03 rad less per sample: 15 sigmas, at the latest
    int delay = 0;
    ChannelVerdict verdict = rig.step();
    while (verdict.transition != Transition::kRaise && ++delay < 20) verdict = rig.step();
    EXPECT_EQ(verdict.transition, Transition::kRaise) << seed;
    EXPECT_LE(delay, 2) << seed;
    EXPECT_EQ(verdict.onset, rig.now);
    EXPECT_TRUE(rig.channel.fault_active());
  }
}

TEST(ArxChannel, WhatWasFoundStaysFoundWhilePaused) {
  Rig rig{second_order()};
  for (int i = 0; i < 1000; ++i) (void)rig.step();
  rig.pair.gain = 0.0;
  while (rig.step().transition != Transition::kRaise) {
  }
  rig.pair.gain = 1.0;
  for (int i = 0; i < 60; ++i) (void)rig.step();  // 3 of the 5 s that clear it
  int updates = 0;
  for (int i = 0; i < 200; ++i) {
    rig.now += kStep;
    const ChannelVerdict verdict = rig.channel.pause(rig.now);
    EXPECT_EQ(verdict.reason, NotJudged::kPaused);
    ASSERT_NE(verdict.transition, Transition::kClear) << i;
    updates += verdict.transition == Transition::kUpdate ? 1 : 0;
  }
  EXPECT_NEAR(updates, 10, 1);
  int until_clear = 0;
  while (rig.step().transition != Transition::kClear && ++until_clear < 1000) {
  }
  EXPECT_GE(until_clear, 100) << "5 s must be healthy in one piece, and seen";
  EXPECT_LT(until_clear, 400);
}

TEST(ArxChannel, NotArmedBeforeItHasSeenEnoughOrSettled) {
  Rig rig{second_order()};
  for (int i = 0; i < 201; ++i) {
    rig.pair.gain = i == 150 ? 50.0 : 1.0;  // something violent
    EXPECT_EQ(rig.step().reason, NotJudged::kConverging) << i;
  }
  ArxParams restless = second_order();
  restless.settled_change = 1e-12;
  Rig never{restless};
  for (int i = 0; i < 2000; ++i) EXPECT_EQ(never.step().reason, NotJudged::kConverging) << i;
}

TEST(ArxChannel, TheWorstSampleBetweenTwoTicksDecides) {
  Rig rig{second_order()};
  for (int i = 0; i < 1000; ++i) (void)rig.step();
  for (const double disturbance : {0.0, 0.5, 0.0}) {
    rig.now += kStep;
    rig.pair.step();
    rig.channel.sample(rig.now, rig.pair.input, rig.pair.output + disturbance);
  }
  const ChannelVerdict verdict = rig.tick();
  EXPECT_EQ(verdict.transition, Transition::kRaise);
  EXPECT_NEAR(verdict.observed - verdict.expected, 0.5, 0.05);
  EXPECT_EQ(verdict.onset, rig.now - kStep);
}

TEST(ArxChannel, HostileSamplesChangeNothing) {
  Rig rig{second_order()};
  Rig clean{second_order()};
  for (int i = 0; i < 1000; ++i) {
    const ChannelVerdict verdict = rig.step();
    const ChannelVerdict expected = clean.step();
    ASSERT_EQ(verdict.test_ratio, expected.test_ratio) << i;
    ASSERT_EQ(verdict.expected, expected.expected) << i;
    rig.channel.sample(rig.now + Duration{10}, kNan, 0.1);
    rig.channel.sample(rig.now + Duration{20}, 0.1, HUGE_VAL);
    rig.channel.sample(rig.now - kStep, 0.5, 0.5);
    rig.channel.sample(rig.now, 0.5, 0.5);
  }
}

// The response went on while nobody looked. Without the gap in time the same values are an alarm.
TEST(ArxChannel, AGapIsNotAFault) {
  for (const bool gap : {true, false}) {
    Rig rig{second_order()};
    for (int i = 0; i < 1000; ++i) (void)rig.step();
    if (gap) {
      rig.now += Duration{3'000'000};
      EXPECT_EQ(rig.tick().reason, NotJudged::kInputUnknown);
    }
    bool raised = false;
    for (int i = 0; i < 2; ++i) {
      rig.now += kStep;
      rig.channel.sample(rig.now, 0.0, 0.8);
      raised = raised || rig.tick().transition == Transition::kRaise;
    }
    EXPECT_EQ(raised, !gap);
  }
}

TEST(ArxChannel, MutedItGathersNoEvidence) {
  Rig rig{second_order()};
  for (int i = 0; i < 1000; ++i) (void)rig.step();
  rig.now += kStep;
  rig.channel.sample(rig.now, 0.0, 5.0);
  EXPECT_EQ(rig.channel.step(rig.now, Duration{0}, true).transition, Transition::kNone);
  EXPECT_NE(rig.step().transition, Transition::kRaise);
}

TEST(ArxChannel, ClearsAfterTheDisturbance) {
  Rig rig{second_order()};
  for (int i = 0; i < 1000; ++i) (void)rig.step();
  rig.pair.output += 0.5;
  EXPECT_EQ(rig.step().transition, Transition::kRaise);
  bool cleared = false;
  for (int i = 0; i < 400 && !cleared; ++i) cleared = rig.step().transition == Transition::kClear;
  EXPECT_TRUE(cleared);
}

TEST(ArxChannel, UsesNoHeap) {
  ArxParams params;
  params.forgetting = 0.999;
  Rig rig{params};
  const test::AllocationGuard guard;
  for (int i = 0; i < 1000; ++i) (void)rig.step();
  EXPECT_EQ(guard.allocations(), 0U);
}

MonitorParams roll_pair(Samples samples) {
  MonitorParams params;
  params.channel_count = 1;
  params.methods[0] = Method::kArx;
  params.arx[0] = second_order();
  params.arx[0].samples = samples;
  params.channels[0].life_cycle = life_cycle();
  params.channels[0].warm_up = Duration{0};
  return params;
}

/// Set-points and attitude 20 times a second, the attitude measured anew at every eighth only.
class HeldFlight {
 public:
  explicit HeldFlight(unsigned seed) : pair_{seed} {}

  void step(ResponseMonitor& monitor) {
    now_ += kStep;
    for (int i = 0; i < (count_ % 8 == 0 ? 1 : 0); ++i) {
      pair_.step();
      held_ = pair_.output;
    }
    monitor.on_attitude(now_, held_, 0.0);
    monitor.on_attitude_setpoint(now_, pair_.input, 0.0);
    if (++count_ % 2 == 0) ticked_ = monitor.on_imu({now_, {0, 0, -9.81}, {0, 0, 0}});
  }

  /// Samples until the channel judges.
  int arm(ResponseMonitor& monitor) {
    while (count_ < 20'000 && (!ticked_ || monitor.verdicts()[0].reason != NotJudged::kJudged)) step(monitor);
    return count_;
  }

 private:
  Pair pair_;
  TimePoint now_ = from_us(5'000'000);
  double held_ = 0;
  int count_ = 0;
  bool ticked_ = false;
};

TEST(ArxChannel, EverySetpointIsASampleOrOnlyAFreshAttitude) {
  HeldFlight held{1};
  ResponseMonitor every{roll_pair(Samples::kEverySetpoint)};
  const int setpoints = held.arm(every);
  EXPECT_GE(setpoints, 202);
  EXPECT_LE(setpoints, 400);
  HeldFlight again{1};
  ResponseMonitor fresh{roll_pair(Samples::kFresh)};
  const int to_fresh = again.arm(fresh);
  EXPECT_GE(to_fresh, 8 * 202);
  EXPECT_LE(to_fresh, 8 * 400);
  EXPECT_EQ(fresh.state(), DetectorState::kMonitoring);
}

TEST(ArxChannel, StandsBesideARegressionInOneMonitor) {
  MonitorParams params = roll_pair(Samples::kFresh);
  params.channel_count = 2;
  params.channels[1].response.signal = Signal::kAccelZ;
  params.channels[1].terms[0].signal = Signal::kOne;
  params.channels[1].term_count = 1;
  params.channels[1].regression.terms = 1;
  params.channels[1].warm_up = Duration{0};
  ResponseMonitor monitor{params};
  ResponseMonitor alone{roll_pair(Samples::kFresh)};
  HeldFlight flight{1};
  HeldFlight same{1};
  EXPECT_EQ(flight.arm(monitor), same.arm(alone));
  EXPECT_EQ(monitor.verdicts()[0].expected, alone.verdicts()[0].expected);
  EXPECT_NEAR(monitor.verdicts()[1].expected, -9.81, 0.01);
}

}  // namespace
}  // namespace airworthy::response
