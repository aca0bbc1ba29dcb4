#include "core/detectors/effectiveness/rotor_loss_test.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/support/allocation_guard.h"

namespace airworthy {
namespace {

using LossTest = RotorLossTest<double>;
using Sample = MotionSample<double>;

constexpr double kStep_s = 0.002;
constexpr std::array<LossRange<double>, 2> kRanges{LossRange<double>{0.5, 1.1, 1e9}, {0.15, 1.1, 1e9}};
constexpr std::array<LossRange<double>, 3> kWithGains{
    LossRange<double>{0.5, 1.1, 1e9}, {0.15, 1.1, 1e9}, {-0.15, -1.1, 1e9}};

/// Axes that keep no state: innovations are what is missing plus white noise, so that sums have closed forms.
Sample white_sample(int step, const std::array<double, 3>& innovation) {
  Sample sample;
  sample.time = from_us(1'000'000 + 2'000 * step);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    // Gain 1 and no gain of the disturbance: each innovation holds one step of acceleration.
    sample.rate[axis] = {innovation[axis], 0.01, 1.0, 0.0, kStep_s};
  }
  sample.vertical = {innovation[2], 0.5, 0.0, 0.0, kStep_s};
  // Four rotors at the corners: roll ∓, pitch ±, and a share of the lift.
  const std::array<std::array<double, 3>, 4> contribution{
      {{-40.0, 40.0, -2.5}, {40.0, 40.0, -2.5}, {40.0, -40.0, -2.5}, {-40.0, -40.0, -2.5}}};
  for (std::size_t i = 0; i < 4; ++i) sample.contribution[i] = contribution[i];
  return sample;
}

std::array<double, 3> trace_of_loss(std::size_t rotor, double share) {
  const Sample sample = white_sample(0, {});
  return {-share * kStep_s * sample.contribution[rotor][0], -share * kStep_s * sample.contribution[rotor][1],
          -share * sample.contribution[rotor][2]};
}

TEST(RotorLossTest, SumsAndSizeInClosedForm) {
  LossTest test{4, {}, kRanges};
  constexpr int kSteps = 12;
  for (int i = 0; i < kSteps; ++i) test.step(white_sample(i, trace_of_loss(2, 0.8)));
  const auto best = test.leading(0);
  EXPECT_EQ(best.rotor, 2U);
  EXPECT_NEAR(best.loss, 0.8, 1e-9);
  // b: two rate axes of (0.002·40)²/0.01 and the lift of 2.5²/0.5, each step.
  const double information = kSteps * (2.0 * 0.08 * 0.08 / 0.01 + 2.5 * 2.5 / 0.5);
  EXPECT_NEAR(best.loss_variance, 1.0 / information, 1e-9);
  EXPECT_NEAR(best.evidence, 0.8 * 0.8 * information / 2.0, 1e-6);
  EXPECT_NEAR(best.unexplained, 0.0, 1e-6);
  // The opposite rotor explains the lift but none of the moments, the neighbours one moment each.
  EXPECT_LT(best.second, best.evidence);
  ASSERT_TRUE(test.finding());
  EXPECT_EQ(test.finding()->rotor, 2U);
}

TEST(RotorLossTest, NeverNamesWhatNoSingleRotorExplains) {
  // Moments of a lost rotor, but the lift of a gained one: a foot on the ground, a push from below.
  LossTest pushed{4, {}, kRanges};
  for (int i = 0; i < 60; ++i) {
    auto trace = trace_of_loss(0, 1.0);
    trace[2] = -trace[2];
    pushed.step(white_sample(i, trace));
    ASSERT_FALSE(pushed.finding()) << i;
  }
  // A moment about one axis alone: between two rotors.
  LossTest between{4, {}, kRanges};
  for (int i = 0; i < 60; ++i) {
    auto trace = trace_of_loss(0, 1.0);
    trace[1] = 0.0;
    between.step(white_sample(i, trace));
    ASSERT_FALSE(between.finding()) << i;
  }
}

TEST(RotorLossTest, FalseAlarmsKeepToTheirBound) {
  // White innovations of the assumed variance: the mean time between false alarms of each sum is at least eʰ samples. With
  // h for one false alarm in 20 s, 100 runs of 20 s see at most 100 in the mean, and Poisson luck of 3 sigma.
  RotorLossParams<double> params;
  params.threshold = loss_threshold(180.0, 500.0, 8);
  params.margin = 0.0;
  params.unexplained = 1e9;
  int alarms = 0;
  std::mt19937 random{11};
  std::normal_distribution normal;
  for (int run = 0; run < 100; ++run) {
    LossTest test{4, params, kRanges};
    for (int i = 0; i < 10'000; ++i) {
      test.step(
          white_sample(i, {0.1 * normal(random), 0.1 * normal(random), std::sqrt(0.5) * normal(random)}));
      if (!test.finding()) continue;
      ++alarms;
      test.reset();
    }
  }
  EXPECT_LE(alarms, 130);
}

TEST(RotorLossTest, ThresholdByHand) {
  // Eight sums at 500 Hz, one false alarm in 10⁴ h: ln(8·500·3600·10⁴).
  EXPECT_NEAR(loss_threshold(1e-4, 500.0, 8), std::log(8.0 * 500.0 * 3600.0 * 1e4), 1e-12);
}

TEST(RotorLossTest, AGreaterLossIsNeverFoundLater) {
  int before = 10'000;
  for (const double share : {0.2, 0.3, 0.5, 0.7, 1.0}) {
    LossTest test{4, {}, kRanges};
    std::mt19937 random{12};
    std::normal_distribution normal;
    int found = 0;
    while (!test.finding() && found < 9'000) {
      auto trace = trace_of_loss(1, share);
      trace[0] += 0.1 * normal(random);
      trace[1] += 0.1 * normal(random);
      trace[2] += std::sqrt(0.5) * normal(random);
      test.step(white_sample(found++, trace));
    }
    ASSERT_TRUE(test.finding()) << share;
    EXPECT_EQ(test.finding()->rotor, 1U);
    EXPECT_LE(found, before) << share;
    before = found;
  }
}

TEST(RotorLossTest, AGainIsItsOwnAndNotTheLossOfTheOpposite) {
  for (const double gain : {0.3, 0.8}) {
    RotorLossTest<double, kMaxRotors, 3> test{4, {}, kWithGains};
    int steps = 0;
    while (!test.finding() && steps < 1000) test.step(white_sample(steps++, trace_of_loss(1, -gain)));
    const auto finding = test.finding();
    ASSERT_TRUE(finding) << gain;
    EXPECT_EQ(finding->range, 2U);
    EXPECT_EQ(finding->rotor, 1U);
    EXPECT_NEAR(finding->loss, -gain, 1e-9);
    // Of the rivals the opposite rotor comes nearest: the same moments, the wrong lift.
    EXPECT_GT(finding->second, 0.0);
    EXPECT_LT(finding->second, finding->evidence - 8.0);
  }
}

// Moments without a word about the lift: rotor 2 has regained something or its opposite has lost something.
TEST(RotorLossTest, WhatWasLostComesBackRatherThanThatAnotherLosesSomething) {
  const auto named = [](double most_return) {
    RotorLossTest<double, kMaxRotors, 3> test{4, {}, kWithGains};
    test.may_return(1, most_return);
    // Between two rotors with the same evidence the likelier one is ahead by the odds.
    for (int step = 0; step < 1000; ++step) {
      Sample sample = white_sample(step, trace_of_loss(1, -0.3));
      sample.vertical.variance = 1e12;
      test.step(sample);
    }
    EXPECT_NEAR(test.evidence(2, 1), test.evidence(1, 3), 1e-6);
    std::size_t rotor = 0;
    for (std::size_t range = 0; range < 3; ++range) {
      const auto leading = test.leading(range);
      const double odds = most_return > 0.3 ? 8.0 : 10.0;
      if (leading.evidence - leading.second > odds - 0.1) rotor = leading.rotor + 1;
    }
    return rotor;
  };
  EXPECT_EQ(named(0.5), 2U);
  EXPECT_EQ(named(0.25), 4U);  // more than it had lost
  EXPECT_EQ(named(0.0), 4U);   // it had lost nothing
}

// The lift speaks for the gain by a few nats, as noise may: no propeller grows in flight.
TEST(RotorLossTest, ALossIsNamedWhereTheLiftHardlySpeaksForTheGainOfTheOpposite) {
  for (const double lift_variance : {400.0, 20.0}) {
    RotorLossTest<double, kMaxRotors, 3> test{4, {}, kWithGains};
    for (int step = 0; step < 600; ++step) {
      Sample sample = white_sample(step, trace_of_loss(1, -0.3));
      sample.vertical.variance = lift_variance;
      test.step(sample);
    }
    const double ahead = test.evidence(2, 1) - test.evidence(1, 3);
    const auto finding = test.finding();
    if (lift_variance == 400.0) {
      EXPECT_NEAR(ahead, 1.5, 0.4);
      ASSERT_TRUE(finding);
      EXPECT_EQ(finding->rotor, 3U);
      EXPECT_NEAR(finding->loss, 0.3, 0.05);
    } else {
      EXPECT_GT(ahead, 15.0);
      EXPECT_FALSE(finding && finding->rotor == 3U);
    }
  }
}

// The range of great losses decides first and reads at least its own smallest.
TEST(RotorLossTest, TheSizeIsReadWhereMostIsExplained) {
  for (const double loss : {0.4, 0.8}) {
    LossTest test{4, {}, kRanges};
    int steps = 0;
    while (!(test.finding() && test.finding()->range == 0) && steps < 1000)
      test.step(white_sample(steps++, trace_of_loss(1, loss)));
    ASSERT_TRUE(test.finding()) << loss;
    EXPECT_NEAR(test.finding()->loss, loss, 1e-6);
  }
}

// A sum that began with something that has passed, and is neither refuted nor fed, must not hide what begins now.
TEST(RotorLossTest, AFruitlessSumStartsAnew) {
  for (const bool says_enough : {false, true}) {
    LossTest test{4, {}, kRanges};
    int step = 0;
    const auto feed = [&](double loss, double variance_scale) {
      Sample sample = white_sample(step++, trace_of_loss(1, loss));
      for (auto& axis : sample.rate) axis.variance *= variance_scale;
      sample.vertical.variance *= variance_scale;
      test.step(sample);
    };
    for (int i = 0; i < (says_enough ? 40 : 4); ++i) feed(0.5, 1.0);
    ASSERT_GT(test.evidence(1, 1), 0.0);
    ASSERT_EQ(test.evidence(1, 1) > 8.0, says_enough);
    const TimePoint begun = test.leading(1).onset;
    while (step < 250) feed(0.0, 1e12);
    EXPECT_EQ(test.leading(1).onset, begun);
    while (step < 260) feed(0.0, 1e12);
    feed(0.5, 1.0);
    EXPECT_EQ(test.leading(1).onset > begun, !says_enough);
  }
}

TEST(RotorLossTest, UsesNoHeap) {
  const test::AllocationGuard guard;
  LossTest test{4, {}, kRanges};
  for (int i = 0; i < 20; ++i) test.step(white_sample(i, trace_of_loss(1, 1.0)));
  static_cast<void>(test.finding());
  EXPECT_EQ(guard.allocations(), 0U);
}

}  // namespace
}  // namespace airworthy
