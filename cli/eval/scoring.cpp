#include "cli/eval/scoring.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <limits>
#include <numeric>

namespace airworthy::eval {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double ratio(double numerator, double denominator) {
  return denominator > 0 ? numerator / denominator : kNan;
}

// Garwood's exact interval of a Poisson mean from one count.
double poisson_low(int count) {
  if (count == 0) return 0.0;
  return 0.5 * boost::math::quantile(boost::math::chi_squared{2.0 * count}, 0.025);
}
double poisson_high(int count) {
  return 0.5 * boost::math::quantile(boost::math::chi_squared{2.0 * (count + 1)}, 0.975);
}

using Interval = JudgementLog::Interval;

bool contains(const Interval& interval, TimePoint time) {
  return interval.from <= time && time <= interval.until;
}

// While an alarm can be of this fault.
Interval interval_of(const Truth& fault, const Flight& flight, const Rules& rules) {
  const TimePoint until = fault.end ? *fault.end + rules.aftermath : TimePoint::max();
  return {fault.onset.value_or(flight.start) - rules.onset_tolerance, until};
}

// What of the flight after the warm-up is in none of these, which are in order of their begin.
std::vector<Interval> healthy_parts(const std::vector<Interval>& faulty, TimePoint from, TimePoint until) {
  std::vector<Interval> parts;
  for (const Interval& one : faulty) {
    const TimePoint end = std::min(one.from, until);
    if (end > from) parts.push_back({from, end});
    from = std::max(from, one.until);
  }
  if (until > from) parts.push_back({from, until});
  return parts;
}

std::vector<FaultScore> faults_of(const Flight& flight, const Rules& rules) {
  std::vector<FaultScore> faults;
  for (const Truth& fault : flight.faults) {
    FaultScore& score = faults.emplace_back();
    score.fault = fault;
    score.is_watched = watches(rules.detector, fault);
    score.is_reached = fault.onset.value_or(flight.start) <= flight.end;
  }
  return faults;
}

// What an alarm says of the faults that are there: the best of it, and the delay from the onset of that fault, the
// latest if there are several. Where it names none of them the delay is from the first.
void judge(const Alarm& alarm, const Flight& flight, const Rules& rules, Score& score) {
  std::optional<TimePoint> onset;
  for (const FaultScore& one : score.faults) {
    if (!one.counts() || !contains(interval_of(one.fault, flight, rules), alarm.time)) continue;
    const Named named_so = named(alarm, one.fault);
    const bool is_better = named_so > score.named;
    const bool is_later = named_so == score.named && named_so != Named::kAnother;
    if (!onset || is_better || is_later) onset = one.fault.onset.value_or(flight.start);
    score.named = std::max(score.named, named_so);
  }
  score.delay_s = to_seconds(alarm.time - onset.value_or(alarm.time));
}

void note_named(const Alarm& alarm, const Flight& flight, const Rules& rules,
                std::vector<FaultScore>& faults) {
  for (FaultScore& one : faults) {
    if (!one.counts() || one.named_s || !contains(interval_of(one.fault, flight, rules), alarm.time))
      continue;
    if (named(alarm, one.fault) != Named::kRight) continue;
    one.named_s = to_seconds(alarm.time - one.fault.onset.value_or(flight.start));
  }
}

}  // namespace

Score score(const Flight& flight, const Rules& rules) {
  Score result;
  const TimePoint armed = flight.start + rules.warm_up;
  result.faults = faults_of(flight, rules);
  std::vector<Interval> faulty;  // while there is something to find
  for (const FaultScore& one : result.faults) {
    if (one.counts()) faulty.push_back(interval_of(one.fault, flight, rules));
  }
  result.judged_s = flight.judgement.judged_s({armed, flight.end});
  if (flight.truth) {
    for (const Interval& part : healthy_parts(faulty, armed, flight.end)) {
      result.healthy_s += to_seconds(part.until - part.from);
      result.judged_healthy_s += flight.judgement.judged_s(part);
    }
  }

  std::optional<TimePoint> last_counted;
  bool is_first_false = false;
  for (const Alarm& alarm : flight.alarms) {
    const bool is_false = std::none_of(faulty.begin(), faulty.end(),
                                       [&](const Interval& one) { return contains(one, alarm.time); });
    if (is_false && alarm.time < armed) continue;
    if (!result.first) {
      result.first = alarm;
      is_first_false = is_false;
    }
    note_named(alarm, flight, rules, result.faults);
    if (flight.truth && is_false && (!last_counted || alarm.time - *last_counted >= rules.rearm)) {
      ++result.false_alarms;
      last_counted = alarm.time;
    }
  }
  if (!result.first && result.judged_s <= 0.0) {
    result.outcome = Outcome::kNotJudged;
  } else if (!flight.truth) {
    result.outcome = Outcome::kUnscored;
  } else if (faulty.empty()) {
    result.outcome = result.first ? Outcome::kFalsePositive : Outcome::kTrueNegative;
  } else if (!result.first) {
    result.outcome = Outcome::kFalseNegative;
  } else if (is_first_false) {
    result.outcome = Outcome::kEarly;
  } else {
    result.outcome = Outcome::kTruePositive;
    judge(*result.first, flight, rules, result);
  }
  return result;
}

Totals total(const std::vector<Score>& scores) {
  Totals totals;
  std::vector<double> delays_s;
  for (const Score& score : scores) {
    if (score.outcome == Outcome::kNotJudged) ++totals.not_judged;
    if (score.outcome == Outcome::kUnscored || score.outcome == Outcome::kNotJudged) continue;
    ++totals.flights;
    totals.healthy_h += score.healthy_s / 3600.0;
    totals.judged_healthy_h += score.judged_healthy_s / 3600.0;
    totals.false_alarms += score.false_alarms;
    switch (score.outcome) {
      case Outcome::kTruePositive:
        ++totals.tp;
        ++(score.named == Named::kRight   ? totals.named_right
           : score.named == Named::kAmong ? totals.named_among
                                          : totals.named_another);
        delays_s.push_back(score.delay_s);
        totals.found_within_10_s += score.delay_s <= 10.0 ? 1 : 0;
        break;
      case Outcome::kFalseNegative:
        ++totals.fn;
        break;
      case Outcome::kTrueNegative:
        ++totals.tn;
        break;
      case Outcome::kFalsePositive:
        ++totals.fp;
        break;
      case Outcome::kEarly:
        ++totals.fp;
        ++totals.fn;
        break;
      case Outcome::kNotJudged:
      case Outcome::kUnscored:
        break;
    }
  }
  totals.precision = ratio(totals.tp, totals.tp + totals.fp);
  totals.recall = ratio(totals.tp, totals.tp + totals.fn);
  totals.accuracy = ratio(totals.tp + totals.tn, totals.flights);
  std::sort(delays_s.begin(), delays_s.end());
  const std::size_t n = delays_s.size();
  totals.mean_delay_s =
      n > 0 ? std::accumulate(delays_s.begin(), delays_s.end(), 0.0) / static_cast<double>(n) : kNan;
  totals.median_delay_s = n > 0 ? 0.5 * (delays_s[(n - 1) / 2] + delays_s[n / 2]) : kNan;
  totals.max_delay_s = n > 0 ? delays_s.back() : kNan;
  totals.false_alarms_per_hour = ratio(totals.false_alarms, totals.judged_healthy_h);
  totals.false_alarms_per_hour_low = ratio(poisson_low(totals.false_alarms), totals.judged_healthy_h);
  totals.false_alarms_per_hour_high = ratio(poisson_high(totals.false_alarms), totals.judged_healthy_h);
  return totals;
}

const char* to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::kTruePositive:
      return "found";
    case Outcome::kFalseNegative:
      return "missed";
    case Outcome::kTrueNegative:
      return "silent";
    case Outcome::kFalsePositive:
      return "false alarm";
    case Outcome::kEarly:
      return "early";
    case Outcome::kNotJudged:
      return "not judged";
    case Outcome::kUnscored:
      return "not scored";
  }
  return "not scored";
}

}  // namespace airworthy::eval
