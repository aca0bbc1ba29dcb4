#include "core/detectors/actuator/sample_check.h"

#include <gtest/gtest.h>

#include <random>

namespace airworthy::actuator {
namespace {

using Verdict = SampleCheck::Verdict;
using Values = SampleCheck::Values;

constexpr double kSigma = 0.05;
constexpr double kStep_s = 0.002;
constexpr double kMost_rad_s2 = 100.0;

/// A gyro at 500 Hz with noise of its own, and what the check says of it.
struct Gyro {
  explicit Gyro(double sigma = kSigma) : noise{0.0, sigma} {}

  Verdict step(double rate_rad_s = 0.0, double spike_rad_s = 0.0) {
    time += from_seconds(kStep_s);
    last = {rate_rad_s + noise(random), noise(random), noise(random) + spike_rad_s};
    return again();
  }
  Verdict again() {
    const double reach = kMost_rad_s2 * check.since_taken_s(time);
    return check.judge(time, last, {reach, reach, reach});
  }
  Verdict repeat() {
    time += from_seconds(kStep_s);
    return again();
  }

  SampleCheck check{kSigma};
  TimePoint time = from_us(1'000'000);
  Values last{};
  std::mt19937 random{1};
  std::normal_distribution<double> noise;
};

TEST(SampleCheck, TakesNoiseAndWhatTheVehicleCanDo) {
  Gyro gyro;
  double rate_rad_s = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    rate_rad_s += kStep_s * kMost_rad_s2 * ((i / 100) % 2 == 0 ? 1.0 : -1.0);
    ASSERT_EQ(gyro.step(rate_rad_s), Verdict::kTaken) << i;
  }
  EXPECT_EQ(gyro.check.outliers() + gyro.check.repeated(), 0);
}

TEST(SampleCheck, ABadSampleOnAnyAxisIsAnOutlierAndTheNextGoodOneIsTaken) {
  for (const double spike_rad_s : {-200.0, -1.5, 1.5, 34.0}) {
    Gyro gyro;
    for (int i = 0; i < 100; ++i) (void)gyro.step();
    EXPECT_EQ(gyro.step(0.0, spike_rad_s), Verdict::kOutlier);
    EXPECT_EQ(gyro.step(), Verdict::kTaken);
    EXPECT_EQ(gyro.check.outliers(), 1);
  }
}

TEST(SampleCheck, WhatLastsIsTakenAfterFiftyMilliseconds) {
  Gyro gyro;
  for (int i = 0; i < 100; ++i) (void)gyro.step();
  const TimePoint since = gyro.time;
  while (gyro.step(0.0, 34.0) == Verdict::kOutlier) ASSERT_LE(gyro.time - since, from_seconds(0.05));
  EXPECT_EQ(gyro.time - since, from_seconds(0.052));
  EXPECT_EQ(gyro.step(0.0, 34.0), Verdict::kTaken);
}

TEST(SampleCheck, AVehicleThatShakesMoreThanExpectedIsBelieved) {
  Gyro gyro{20.0 * kSigma};
  int refused_late = 0;
  for (int i = 0; i < 5000; ++i) {
    if (gyro.step() != Verdict::kTaken && i >= 500) ++refused_late;
  }
  EXPECT_EQ(refused_late, 0);
  EXPECT_EQ(gyro.step(0.0, 34.0), Verdict::kOutlier);
}

TEST(SampleCheck, ValuesThatRepeatOnAllAxesAreNoMeasurement) {
  Gyro gyro;
  (void)gyro.step();
  const TimePoint since = gyro.time;
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(gyro.repeat(), Verdict::kRepeated);
    EXPECT_EQ(gyro.check.repeats_for(gyro.time), gyro.time - since);
  }
  EXPECT_EQ(gyro.check.repeated(), 100);
  gyro.last[1] += 1e-6;
  EXPECT_EQ(gyro.repeat(), Verdict::kTaken);
  EXPECT_EQ(gyro.check.repeats_for(gyro.time), Duration{0});
}

TEST(SampleCheck, WhatMovedWhileNothingWasMeasuredIsWithinReach) {
  Gyro gyro;
  for (int i = 0; i < 100; ++i) (void)gyro.step();
  for (int i = 0; i < 20; ++i) (void)gyro.repeat();  // 40 ms, in which 100 rad/s² do 4 rad/s
  EXPECT_EQ(gyro.step(4.0), Verdict::kTaken);
}

TEST(SampleCheck, ARestartComparesWithNothing) {
  Gyro gyro;
  for (int i = 0; i < 100; ++i) (void)gyro.step();
  gyro.check.restart();
  EXPECT_EQ(gyro.check.since_taken_s(gyro.time), 0.0);
  EXPECT_EQ(gyro.step(34.0), Verdict::kTaken);
}

}  // namespace
}  // namespace airworthy::actuator
