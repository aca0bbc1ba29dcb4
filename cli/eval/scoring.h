#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/eval/flight.h"

namespace airworthy::eval {

struct Rules {
  Duration warm_up{20'000'000};  ///< alarms so early in a flight, and that time, do not count
  Duration onset_tolerance{0};   ///< an alarm so long before the onset still counts as finding the fault
  Duration rearm{5'000'000};     ///< alarms closer together are one false alarm
};

enum class Outcome { kTruePositive, kFalseNegative, kTrueNegative, kFalsePositive, kEarly, kUnscored };

/// The verdict on one flight: its first alarm decides. kEarly, an alarm before the onset, is both a false
/// positive and a miss.
struct Score {
  Outcome outcome = Outcome::kUnscored;
  std::optional<Alarm> first;  ///< the alarm that decided
  double delay_s = 0;          ///< of a true positive, from the onset
  double healthy_s = 0;        ///< time scored for false alarms: healthy flight, or before the onset
  int false_alarms = 0;        ///< in healthy_s
};

[[nodiscard]] Score score(const Flight& flight, const Rules& rules);

struct Totals {
  int flights = 0;
  int tp = 0;
  int fp = 0;
  int fn = 0;
  int tn = 0;
  int found_within_10_s = 0;
  double precision = 0;
  double recall = 0;
  double accuracy = 0;  ///< (tp + tn) / flights
  double mean_delay_s = 0;
  double median_delay_s = 0;
  double max_delay_s = 0;
  int false_alarms = 0;
  double healthy_h = 0;
  double false_alarms_per_hour = 0;
  double false_alarms_per_hour_low = 0;  ///< exact 95 % Poisson interval
  double false_alarms_per_hour_high = 0;
};

/// Ratios whose denominator is 0 are NaN: not known, never 1.
[[nodiscard]] Totals total(const std::vector<Score>& scores);

[[nodiscard]] const char* to_string(Outcome outcome);

}  // namespace airworthy::eval
