#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/eval/concern.h"
#include "cli/eval/flight.h"

namespace airworthy::eval {

struct Rules {
  std::string detector = "response";  ///< only what it watches is to be found
  Duration warm_up{20'000'000};       ///< healthy time so early in a flight, and alarms in it, do not count
  Duration onset_tolerance{0};        ///< an alarm so long before the onset still counts as finding the fault
  Duration aftermath{10'000'000};     ///< an alarm so long after the end of a fault is still its alarm
  Duration rearm{5'000'000};          ///< alarms closer together are one false alarm
};

enum class Outcome {
  kTruePositive,
  kFalseNegative,
  kTrueNegative,
  kFalsePositive,
  kEarly,
  kNotJudged,
  kUnscored
};

/// What became of one fault of a flight.
struct FaultScore {
  Truth fault;
  bool is_watched = false;
  bool is_reached = false;        ///< it begins before the recording ends
  std::optional<double> named_s;  ///< from its onset until the first alarm that names it right

  [[nodiscard]] bool counts() const { return is_watched && is_reached; }
};

/// The verdict on one flight, for the faults that the detector watches: its first alarm decides. kEarly, an alarm
/// while there is no such fault though there is one in the flight, is both a false positive and a miss. A flight
/// without such a fault is a healthy one.
struct Score {
  Outcome outcome = Outcome::kUnscored;
  std::optional<Alarm> first;     ///< the alarm that decided
  Named named = Named::kAnother;  ///< of a true positive: what it names, of the faults that are there
  double delay_s = 0;    ///< of a true positive, from the onset of the fault it names, else of the first
  double judged_s = 0;   ///< after the warm-up
  double healthy_s = 0;  ///< flight after the warm-up without a fault to find
  double judged_healthy_s = 0;     ///< of it judged: what false alarms are counted in
  int false_alarms = 0;            ///< in healthy_s
  std::vector<FaultScore> faults;  ///< all that the truth names
};

[[nodiscard]] Score score(const Flight& flight, const Rules& rules);

struct Totals {
  int flights = 0;  ///< scored; those that were not judged are apart
  int not_judged = 0;
  int tp = 0;
  int fp = 0;
  int fn = 0;
  int tn = 0;
  int named_right = 0;    ///< of tp
  int named_among = 0;    ///< of tp: the failed part is one of several candidates
  int named_another = 0;  ///< of tp
  int found_within_10_s = 0;
  double precision = 0;
  double recall = 0;
  double accuracy = 0;  ///< (tp + tn) / flights
  double mean_delay_s = 0;
  double median_delay_s = 0;
  double max_delay_s = 0;
  int false_alarms = 0;
  double healthy_h = 0;
  double judged_healthy_h = 0;
  double false_alarms_per_hour = 0;      ///< of judged_healthy_h
  double false_alarms_per_hour_low = 0;  ///< exact 95 % Poisson interval
  double false_alarms_per_hour_high = 0;
};

/// Ratios whose denominator is 0 are NaN: not known, never 1.
[[nodiscard]] Totals total(const std::vector<Score>& scores);

[[nodiscard]] const char* to_string(Outcome outcome);

}  // namespace airworthy::eval
