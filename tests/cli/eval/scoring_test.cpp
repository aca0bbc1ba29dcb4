#include "cli/eval/scoring.h"

#include <gtest/gtest.h>

#include <cmath>

namespace airworthy::eval {
namespace {

constexpr double kStart_s = 1000;

TimePoint at(double seconds) { return from_us(0) + from_seconds(kStart_s + seconds); }

Alarm alarm(double time_s, const std::string& component = "engine", const std::string& kind = "thrust_loss") {
  return {at(time_s), at(time_s), component, kind, 0.0, {}};
}

Truth fault(const std::string& component, const std::string& kind, double onset_s,
            std::optional<double> end_s = std::nullopt) {
  Truth fault{component, kind, at(onset_s), std::nullopt};
  if (end_s) fault.end = at(*end_s);
  return fault;
}

/// Of 120 s, judged from begin to end.
Flight flight_of(const std::vector<Truth>& faults, const std::vector<Alarm>& alarms) {
  Flight flight;
  flight.name = "f";
  flight.truth = faults.empty() ? Truth{"", "none", std::nullopt, std::nullopt} : faults.front();
  flight.faults = faults;
  flight.start = at(0);
  flight.end = at(120);
  flight.alarms = alarms;
  flight.judgement.note(flight.start, flight.end, "");
  return flight;
}

Flight flight(std::optional<double> onset_s, const std::vector<double>& alarms_s) {
  std::vector<Truth> faults;
  if (onset_s) faults.push_back(fault("engine", "thrust_loss", *onset_s));
  std::vector<Alarm> alarms;
  for (const double t : alarms_s) alarms.push_back(alarm(t));
  return flight_of(faults, alarms);
}

Rules of(const std::string& detector) { return {.detector = detector, .warm_up = Duration{0}}; }

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

TEST(Score, AFaultFoundInTheWarmUpIsFound) {
  EXPECT_EQ(score(flight(10, {5, 11}), {}).outcome, Outcome::kTruePositive);
  EXPECT_NEAR(score(flight(10, {5, 11, 30}), {}).delay_s, 1.0, 1e-6);
  EXPECT_EQ(score(flight(10, {5, 11}), {}).false_alarms, 0);
  EXPECT_EQ(score(flight(10, {5}), {}).outcome, Outcome::kFalseNegative);
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

TEST(Score, FoundSaysWhetherTheFailedPartIsNamed) {
  const Score other = score(flight_of({fault("engine", "thrust_loss", 60)},
                                      {alarm(61, "pitch control", "control_effectiveness_loss"), alarm(65)}),
                            {});
  EXPECT_EQ(other.outcome, Outcome::kTruePositive);
  EXPECT_EQ(other.named, Named::kAnother);
  EXPECT_NEAR(other.delay_s, 1.0, 1e-6);
  ASSERT_EQ(other.faults.size(), 1U);
  EXPECT_NEAR(other.faults[0].named_s.value_or(0), 5.0, 1e-6) << "the second alarm names it";
  EXPECT_EQ(score(flight(60, {61}), {}).named, Named::kRight);
}

TEST(Score, ARotorBlamedForAFrozenGyroIsAFalseAlarm) {
  const Truth frozen = fault("imu", "gyro_freeze", 30);
  EXPECT_EQ(score(flight_of({frozen}, {}), of("effectiveness")).outcome, Outcome::kTrueNegative);
  const Score blamed =
      score(flight_of({frozen}, {alarm(30.08, "rotor 3", "partial_loss")}), of("effectiveness"));
  EXPECT_EQ(blamed.outcome, Outcome::kFalsePositive);
  EXPECT_EQ(blamed.false_alarms, 1);
  EXPECT_NEAR(blamed.healthy_s, 120, 1e-6);
}

TEST(Score, OfSeveralFaultsThoseThatTheDetectorWatchesCount) {
  const std::vector faults{fault("rotor 2", "unbalance", 10), fault("rotor 3", "propeller_lost", 60)};
  const Score right = score(flight_of(faults, {alarm(61, "rotor 3", "propeller_lost")}), of("effectiveness"));
  EXPECT_EQ(right.outcome, Outcome::kTruePositive);
  EXPECT_EQ(right.named, Named::kRight);
  EXPECT_NEAR(right.delay_s, 1.0, 1e-6);
  EXPECT_NEAR(right.healthy_s, 60, 1e-6);
  EXPECT_EQ(score(flight_of(faults, {alarm(30, "rotor 2", "partial_loss")}), of("effectiveness")).outcome,
            Outcome::kEarly);
  EXPECT_EQ(score(flight_of(faults, {alarm(30, "rotor 2", "unbalance")}), of("unbalance")).outcome,
            Outcome::kTruePositive);
}

TEST(Score, TheDelayIsFromTheFaultThatIsNamed) {
  const std::vector faults{fault("rotor 1", "partial_loss", 20), fault("rotor 2", "partial_loss", 60)};
  const Score second = score(flight_of(faults, {alarm(61, "rotor 2", "partial_loss")}), of("effectiveness"));
  EXPECT_EQ(second.named, Named::kRight);
  EXPECT_NEAR(second.delay_s, 1.0, 1e-6);
  EXPECT_FALSE(second.faults[0].named_s);
  EXPECT_TRUE(second.faults[1].named_s);
  const Score neither = score(flight_of(faults, {alarm(61, "rotor 4", "partial_loss")}), of("effectiveness"));
  EXPECT_EQ(neither.named, Named::kAnother);
  EXPECT_NEAR(neither.delay_s, 41.0, 1e-6);
}

TEST(Score, AfterTheEndOfAFaultTheFlightIsHealthyAgain) {
  const std::vector faults{fault("left elevon", "loss_of_effectiveness", 30, 40),
                           fault("right elevon", "loss_of_effectiveness", 80, 90)};
  EXPECT_NEAR(score(flight_of(faults, {}), {}).healthy_s, 10 + 30 + 20, 1e-6)
      << "20 to 30, 50 to 80, 100 to 120";
  EXPECT_EQ(score(flight_of(faults, {alarm(49, "roll control")}), {}).outcome, Outcome::kTruePositive);
  const Score early = score(flight_of(faults, {alarm(60, "roll control")}), {});
  EXPECT_EQ(early.outcome, Outcome::kEarly);
  EXPECT_EQ(early.false_alarms, 1);
}

TEST(Score, AFaultAfterTheEndOfTheLogIsNotMissed) {
  const Score unreached = score(flight(130, {}), {});
  EXPECT_EQ(unreached.outcome, Outcome::kTrueNegative);
  ASSERT_EQ(unreached.faults.size(), 1U);
  EXPECT_FALSE(unreached.faults[0].is_reached);
  EXPECT_EQ(score(flight(130, {100}), {}).outcome, Outcome::kFalsePositive);
}

TEST(Score, WhatNobodyJudgedIsNeitherSilentNorMissed) {
  for (const auto& onset : {std::optional<double>{}, std::optional<double>{60}}) {
    Flight one = flight(onset, {});
    one.judgement = {};
    EXPECT_EQ(score(one, {}).outcome, Outcome::kNotJudged) << "it does not tell";
    one.judgement.note(one.start, one.end, "no inertial data yet");
    EXPECT_EQ(score(one, {}).outcome, Outcome::kNotJudged);
    one.judgement.note(at(19), at(20), "");
    EXPECT_EQ(score(one, {}).outcome, Outcome::kNotJudged) << "in the warm-up only";
  }
}

TEST(Score, FalseAlarmsAreCountedInJudgedTime) {
  Flight one = flight(80, {30});
  one.judgement = {};
  one.judgement.note(at(0), at(50), "");
  one.judgement.note(at(50), at(70), "stale");
  one.judgement.note(at(70), at(120), "");
  const Score early = score(one, {});
  EXPECT_NEAR(early.judged_s, 80, 1e-6);
  EXPECT_NEAR(early.healthy_s, 60, 1e-6);
  EXPECT_NEAR(early.judged_healthy_s, 40, 1e-6) << "20 to 50, 70 to 80";
  EXPECT_NEAR(total({early}).false_alarms_per_hour, 3600.0 / 40, 1e-6);
}

TEST(Total, CountsNamesAndWhatWasNotJudgedApart) {
  Flight wrong = flight(60, {});
  wrong.alarms = {alarm(61, "pitch control")};
  Flight among = flight(60, {});
  among.alarms = {alarm(61, "propulsion")};
  among.alarms[0].candidates = {"engine", "propeller"};
  Flight unjudged = flight(std::nullopt, {});
  unjudged.judgement = {};
  const Totals t =
      total({score(flight(60, {61}), {}), score(wrong, {}), score(among, {}), score(unjudged, {})});
  EXPECT_EQ(t.tp, 3);
  EXPECT_EQ(t.named_right, 1);
  EXPECT_EQ(t.named_among, 1);
  EXPECT_EQ(t.named_another, 1);
  EXPECT_EQ(t.not_judged, 1);
  EXPECT_EQ(t.tn, 0);
  EXPECT_EQ(t.flights, 3);
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
