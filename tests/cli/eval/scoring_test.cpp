#include "cli/eval/scoring.h"

#include <gtest/gtest.h>

#include <cmath>

namespace airworthy::eval {
namespace {

constexpr double kStart_s = 1000;

TimePoint at(double seconds) { return from_us(0) + from_seconds(kStart_s + seconds); }

Flight flight(std::optional<double> onset_s, std::vector<double> alarms_s, double duration_s = 120) {
  Flight flight;
  flight.name = "f";
  flight.truth = Truth{"engine", onset_s ? "thrust_loss" : "none", std::nullopt, std::nullopt};
  if (onset_s) flight.truth->onset = at(*onset_s);
  flight.start = at(0);
  flight.end = at(duration_s);
  for (const double t : alarms_s) flight.alarms.push_back({at(t), at(t), "engine", "thrust_loss", 0.0, {}});
  return flight;
}

TEST(Score, TheFirstAlarmDecides) {
  EXPECT_EQ(score(flight(60, {61.5, 70}), {}).outcome, Outcome::kTruePositive);
  EXPECT_NEAR(score(flight(60, {61.5, 70}), {}).delay_s, 1.5, 1e-6);
  EXPECT_EQ(score(flight(60, {}), {}).outcome, Outcome::kFalseNegative);
  EXPECT_EQ(score(flight(60, {59.9, 61}), {}).outcome, Outcome::kEarly);
  EXPECT_EQ(score(flight(std::nullopt, {}), {}).outcome, Outcome::kTrueNegative);
  EXPECT_EQ(score(flight(std::nullopt, {100}), {}).outcome, Outcome::kFalsePositive);
  EXPECT_EQ(score(flight(60, {60}), {}).outcome, Outcome::kTruePositive) << "at the onset is not before it";
}

TEST(Score, AToleranceForgivesAnAlarmJustBeforeTheOnset) {
  const Rules tolerant{.onset_tolerance = from_seconds(0.5)};
  EXPECT_EQ(score(flight(60, {59.6}), tolerant).outcome, Outcome::kTruePositive);
  EXPECT_EQ(score(flight(60, {59.4}), tolerant).outcome, Outcome::kEarly);
}

TEST(Score, TheWarmUpDoesNotCount) {
  EXPECT_EQ(score(flight(std::nullopt, {19.9}), {}).outcome, Outcome::kTrueNegative);
  EXPECT_EQ(score(flight(std::nullopt, {20.0}), {}).outcome, Outcome::kFalsePositive);
  EXPECT_NEAR(score(flight(std::nullopt, {}), {}).healthy_s, 100.0, 1e-6);
  EXPECT_NEAR(score(flight(60, {}), {}).healthy_s, 40.0, 1e-6);
  EXPECT_EQ(score(flight(10, {}), {}).healthy_s, 0.0);
}

TEST(Score, FalseAlarmsAreCountedOncePerRearmTime) {
  EXPECT_EQ(score(flight(std::nullopt, {30, 34.9, 35.1, 40.2}), {}).false_alarms, 3);
  EXPECT_EQ(score(flight(60, {30, 50, 61}), {}).false_alarms, 2);
}

TEST(Score, WithoutTruthNothingIsScored) {
  Flight unknown = flight(std::nullopt, {30});
  unknown.truth.reset();
  EXPECT_EQ(score(unknown, {}).outcome, Outcome::kUnscored);
  EXPECT_EQ(total({score(unknown, {})}).flights, 0);
}

TEST(Total, AnEarlyAlarmIsBothAFalsePositiveAndAMiss) {
  const Totals t = total({score(flight(60, {30}), {})});
  EXPECT_EQ(t.tp, 0);
  EXPECT_EQ(t.fp, 1);
  EXPECT_EQ(t.fn, 1);
  EXPECT_EQ(t.accuracy, 0.0);
}

TEST(Total, ByHand) {
  const Totals t = total({score(flight(60, {61}), {}), score(flight(60, {73}), {}), score(flight(60, {}), {}),
                          score(flight(60, {30, 61}), {}), score(flight(std::nullopt, {}), {}),
                          score(flight(std::nullopt, {50}), {})});
  EXPECT_EQ(t.flights, 6);
  EXPECT_EQ(t.tp, 2);
  EXPECT_EQ(t.fp, 2);
  EXPECT_EQ(t.fn, 2);
  EXPECT_EQ(t.tn, 1);
  EXPECT_DOUBLE_EQ(t.precision, 0.5);
  EXPECT_DOUBLE_EQ(t.recall, 0.5);
  EXPECT_DOUBLE_EQ(t.accuracy, 0.5);
  EXPECT_EQ(t.found_within_10_s, 1);
  EXPECT_NEAR(t.mean_delay_s, 7.0, 1e-6);
  EXPECT_NEAR(t.median_delay_s, 7.0, 1e-6);
  EXPECT_NEAR(t.max_delay_s, 13.0, 1e-6);
  EXPECT_EQ(t.false_alarms, 2);
  EXPECT_NEAR(t.healthy_h, (4 * 40 + 2 * 100) / 3600.0, 1e-9);
  // Two events: Garwood's interval is [0.2422, 7.2247] events.
  EXPECT_NEAR(t.false_alarms_per_hour_low, 0.2422 / t.healthy_h, 0.01);
  EXPECT_NEAR(t.false_alarms_per_hour_high, 7.2247 / t.healthy_h, 0.01);
}

TEST(Total, WhatCannotBeKnownIsNotANumber) {
  const Totals t = total({});
  EXPECT_TRUE(std::isnan(t.precision));
  EXPECT_TRUE(std::isnan(t.recall));
  EXPECT_TRUE(std::isnan(t.accuracy));
  EXPECT_TRUE(std::isnan(t.mean_delay_s));
  EXPECT_TRUE(std::isnan(t.false_alarms_per_hour));
}

}  // namespace
}  // namespace airworthy::eval
