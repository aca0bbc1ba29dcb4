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

}  // namespace

Score score(const Flight& flight, const Rules& rules) {
  Score result;
  if (!flight.truth) return result;
  const TimePoint armed = flight.start + rules.warm_up;
  const std::optional<TimePoint> onset = flight.truth->onset;
  const TimePoint healthy_until = onset ? std::min(*onset - rules.onset_tolerance, flight.end) : flight.end;
  result.healthy_s = std::max(0.0, to_seconds(healthy_until - armed));

  std::optional<TimePoint> last_counted;
  for (const Alarm& alarm : flight.alarms) {
    if (alarm.time < armed) continue;
    if (!result.first) result.first = alarm;
    const bool false_alarm = !onset || alarm.time < *onset - rules.onset_tolerance;
    if (false_alarm && (!last_counted || alarm.time - *last_counted >= rules.rearm)) {
      ++result.false_alarms;
      last_counted = alarm.time;
    }
  }
  if (!onset) {
    result.outcome = result.first ? Outcome::kFalsePositive : Outcome::kTrueNegative;
  } else if (!result.first) {
    result.outcome = Outcome::kFalseNegative;
  } else if (result.first->time < *onset - rules.onset_tolerance) {
    result.outcome = Outcome::kEarly;
  } else {
    result.outcome = Outcome::kTruePositive;
    result.delay_s = to_seconds(result.first->time - *onset);
  }
  return result;
}

Totals total(const std::vector<Score>& scores) {
  Totals totals;
  std::vector<double> delays_s;
  for (const Score& score : scores) {
    if (score.outcome == Outcome::kUnscored) continue;
    ++totals.flights;
    totals.healthy_h += score.healthy_s / 3600.0;
    totals.false_alarms += score.false_alarms;
    switch (score.outcome) {
      case Outcome::kTruePositive:
        ++totals.tp;
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
  totals.false_alarms_per_hour = ratio(totals.false_alarms, totals.healthy_h);
  totals.false_alarms_per_hour_low = ratio(poisson_low(totals.false_alarms), totals.healthy_h);
  totals.false_alarms_per_hour_high = ratio(poisson_high(totals.false_alarms), totals.healthy_h);
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
    case Outcome::kUnscored:
      return "not scored";
  }
  return "not scored";
}

}  // namespace airworthy::eval
