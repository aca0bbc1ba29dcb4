#include "cli/eval/report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

namespace airworthy::eval {
namespace {

using Json = nlohmann::ordered_json;

std::string name_of(const FaultScore& score) {
  return score.fault.component + " " + score.fault.fault_kind +
         (!score.is_watched   ? " (not watched)"
          : !score.is_reached ? " (never in the log)"
                              : "");
}

// All faults of a flight, each once.
std::string fault_of(const Flight& flight, const Score& score) {
  if (!flight.truth) return "not known";
  std::vector<std::string> names;
  for (const FaultScore& one : score.faults) {
    if (std::find(names.begin(), names.end(), name_of(one)) == names.end()) names.push_back(name_of(one));
  }
  std::sort(names.begin(), names.end());  // flights with the same faults are one group, whichever came first
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

// A name that is not right is a part of the outcome: nobody should read "found" for it.
std::string outcome_of(const Score& score) {
  if (score.outcome != Outcome::kTruePositive || score.named == Named::kRight)
    return to_string(score.outcome);
  return score.named == Named::kAmong ? "found, one of several" : "found, another named";
}

std::string number(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : std::string{"–"};
}

std::string totals_line(const char* name, const Totals& t) {
  return fmt::format(
      "{:<22} tp {} fp {} fn {} tn {}   not judged {}   precision {} recall {} accuracy {}   within 10 s: {} "
      "of "
      "{}\n",
      name, t.tp, t.fp, t.fn, t.tn, t.not_judged, number(t.precision, 3), number(t.recall, 3),
      number(t.accuracy, 3), t.found_within_10_s, t.tp + t.fn);
}

std::string named_counts(const Totals& t) {
  return fmt::format("named right {}, one of several {}, another {}", t.named_right, t.named_among,
                     t.named_another);
}

std::string totals_lines(const Totals& t, const Totals& tolerant) {
  std::string out = totals_line("first alarm decides", t) + totals_line("0.5 s early allowed", tolerant);
  out += fmt::format("of {} found: {}\n", t.tp, named_counts(t));
  out += fmt::format(
      "delay mean {} median {} max {} s   false alarms {} in {} h judged, of {} h healthy flight: {} "
      "per hour judged (95 %: {} to {})\n",
      number(t.mean_delay_s, 2), number(t.median_delay_s, 2), number(t.max_delay_s, 2), t.false_alarms,
      number(t.judged_healthy_h, 3), number(t.healthy_h, 3), number(t.false_alarms_per_hour, 1),
      number(t.false_alarms_per_hour_low, 1), number(t.false_alarms_per_hour_high, 1));
  return out;
}

// How a group of flights with the same faults did; a group without a fault to find is of healthy flights.
std::string group_line(const std::string& fault, std::size_t width, const std::vector<Score>& scores) {
  const Totals t = total(scores);
  std::string line = fmt::format("{:<{}}", fault, width);
  if (t.tp + t.fn > 0) {
    line += fmt::format("  found {} of {}: {}   delay median {} mean {} max {} s", t.tp, t.tp + t.fn,
                        named_counts(t), number(t.median_delay_s, 2), number(t.mean_delay_s, 2),
                        number(t.max_delay_s, 2));
  } else if (t.flights > 0) {
    line += fmt::format("  silent {} of {}", t.tn, t.flights);
  }
  if (t.not_judged > 0) line += fmt::format("   not judged {}", t.not_judged);
  return line + '\n';
}

Json json_of(const Totals& t) {
  return {
      {"flights", t.flights},
      {"not_judged", t.not_judged},
      {"tp", t.tp},
      {"fp", t.fp},
      {"fn", t.fn},
      {"tn", t.tn},
      {"named_right", t.named_right},
      {"named_one_of_several", t.named_among},
      {"named_another", t.named_another},
      {"precision", t.precision},
      {"recall", t.recall},
      {"accuracy", t.accuracy},
      {"found_within_10_s", t.found_within_10_s},
      {"mean_delay_s", t.mean_delay_s},
      {"median_delay_s", t.median_delay_s},
      {"max_delay_s", t.max_delay_s},
      {"false_alarms", t.false_alarms},
      {"healthy_h", t.healthy_h},
      {"judged_healthy_h", t.judged_healthy_h},
      {"false_alarms_per_hour", t.false_alarms_per_hour},
      {"false_alarms_per_hour_95", Json::array({t.false_alarms_per_hour_low, t.false_alarms_per_hour_high})}};
}

Json json_of(const JudgementLog& judgement, TimePoint start) {
  Json causes = Json::array();
  for (const JudgementLog::Muted& cause : judgement.muted()) {
    Json intervals = Json::array();
    for (const auto& one : cause.intervals)
      intervals.push_back(Json::array({to_seconds(one.from - start), to_seconds(one.until - start)}));
    causes.push_back({{"why", cause.why}, {"seconds", cause.seconds}, {"intervals_s", intervals}});
  }
  return causes;
}

Json json_of(const Alarm& alarm) {
  return {{"time_us", to_us(alarm.time)},   {"onset_us", to_us(alarm.onset)}, {"component", alarm.component},
          {"fault_kind", alarm.fault_kind}, {"candidates", alarm.candidates}, {"magnitude", alarm.magnitude}};
}

Json json_of(const std::vector<FaultScore>& faults, TimePoint start) {
  Json rows = Json::array();
  for (const FaultScore& one : faults) {
    Json row{{"component", one.fault.component},
             {"fault_kind", one.fault.fault_kind},
             {"onset_s", to_seconds(one.fault.onset.value_or(start) - start)},
             {"watched", one.is_watched},
             {"in_log", one.is_reached},
             {"named_after_s", nullptr}};
    if (one.named_s) row["named_after_s"] = *one.named_s;
    rows.push_back(row);
  }
  return rows;
}

std::map<std::string, std::vector<Score>> by_fault(const Evaluation& evaluation) {
  std::map<std::string, std::vector<Score>> groups;
  for (std::size_t i = 0; i < evaluation.flights.size(); ++i) {
    const Flight& flight = evaluation.flights[i];
    if (flight.truth) groups[fault_of(flight, evaluation.scores[i])].push_back(evaluation.scores[i]);
  }
  return groups;
}

}  // namespace

std::string to_table(const Evaluation& evaluation) {
  std::size_t width = 6;
  std::size_t truth_width = 5;
  for (std::size_t i = 0; i < evaluation.flights.size(); ++i) {
    width = std::max(width, evaluation.flights[i].name.size());
    truth_width = std::max(truth_width, fault_of(evaluation.flights[i], evaluation.scores[i]).size());
  }
  std::string out = fmt::format("{:<{}}  {:<{}}  {:<21} {:>8} {:>9}  {}\n", "flight", width, "truth",
                                truth_width, "outcome", "delay s", "judged s", "first alarm");
  for (std::size_t i = 0; i < evaluation.flights.size(); ++i) {
    const Flight& flight = evaluation.flights[i];
    const Score& score = evaluation.scores[i];
    std::string first;
    if (score.first) {
      first = fmt::format("{} {} at {:.2f} s", score.first->component, score.first->fault_kind,
                          to_seconds(score.first->time - flight.start));
    }
    const std::string delay =
        score.outcome == Outcome::kTruePositive ? fmt::format("{:.2f}", score.delay_s) : std::string{};
    out += fmt::format("{:<{}}  {:<{}}  {:<21} {:>8} {:>9.2f}  {}\n", flight.name, width,
                       fault_of(flight, score), truth_width, outcome_of(score), delay, score.judged_s, first);
  }
  const Totals totals = total(evaluation.scores);
  out += '\n';
  if (evaluation.rules.warm_up > Duration{0}) {
    out += fmt::format("Alarms of the first {:g} s of a flight, and that time, do not count.\n",
                       to_seconds(evaluation.rules.warm_up));
  }
  out +=
      totals.flights > 0 ? totals_lines(totals, total(evaluation.tolerant_scores)) : "No flight is scored.\n";
  out += '\n';
  const auto groups = by_fault(evaluation);
  for (const auto& [fault, scores] : groups) out += group_line(fault, truth_width, scores);
  return out;
}

std::string to_muted_table(const Evaluation& evaluation) {
  std::string out;
  for (const Flight& flight : evaluation.flights) {
    const JudgementLog& judgement = flight.judgement;
    if (!judgement.has_any()) {
      out += fmt::format("{}: the detector does not tell when it judges\n", flight.name);
      continue;
    }
    out += fmt::format("{}: judged {:.2f} s, muted {:.2f} s\n", flight.name, judgement.judged_s(),
                       judgement.muted_s());
    for (const JudgementLog::Muted& cause : judgement.muted()) {
      out += fmt::format("  {:8.2f} s  {}:", cause.seconds, cause.why);
      for (const auto& one : cause.intervals)
        out += fmt::format(" {:.2f}-{:.2f}", to_seconds(one.from - flight.start),
                           to_seconds(one.until - flight.start));
      out += '\n';
    }
    for (const auto& [component, its] : flight.components) {
      out += fmt::format("  {}: judged {:.2f} s{}\n", component, its.judged_s(),
                         its.muted().empty() ? "" : ", longest not: " + its.main_cause());
    }
  }
  return out;
}

std::string to_json(const Evaluation& evaluation) {
  Json flights = Json::array();
  for (std::size_t i = 0; i < evaluation.flights.size(); ++i) {
    const Flight& flight = evaluation.flights[i];
    const Score& score = evaluation.scores[i];
    Json alarms = Json::array();
    for (const Alarm& alarm : flight.alarms) alarms.push_back(json_of(alarm));
    Json row{{"flight", flight.name},
             {"truth", fault_of(flight, score)},
             {"faults", json_of(score.faults, flight.start)},
             {"onset_us", nullptr},
             {"outcome", to_string(score.outcome)},
             {"named", nullptr},
             {"first_alarm", nullptr},
             {"delay_s", nullptr},
             {"false_alarms", score.false_alarms},
             {"healthy_s", score.healthy_s},
             {"judged_after_warm_up_s", score.judged_s},
             {"judged_healthy_s", score.judged_healthy_s},
             {"duration_s", to_seconds(flight.end - flight.start)},
             {"alarms", alarms}};
    if (flight.judgement.has_any()) {
      row["judged_s"] = flight.judgement.judged_s();
      row["muted"] = json_of(flight.judgement, flight.start);
      for (const auto& [component, its] : flight.components)
        row["components"][component] = {{"judged_s", its.judged_s()}, {"muted", json_of(its, flight.start)}};
    }
    if (flight.truth && flight.truth->onset) row["onset_us"] = to_us(*flight.truth->onset);
    if (score.first) row["first_alarm"] = json_of(*score.first);
    if (score.outcome == Outcome::kTruePositive) {
      row["delay_s"] = score.delay_s;
      row["named"] = to_string(score.named);
    }
    flights.push_back(row);
  }
  Json by_type = Json::object();
  for (const auto& [fault, scores] : by_fault(evaluation)) by_type[fault] = json_of(total(scores));
  return Json{{"detector", evaluation.rules.detector},
              {"warm_up_s", to_seconds(evaluation.rules.warm_up)},
              {"flights", flights},
              {"totals", json_of(total(evaluation.scores))},
              {"totals_0.5_s_early_allowed", json_of(total(evaluation.tolerant_scores))},
              {"by_fault", by_type}}
             .dump(1) +
         "\n";
}

std::string not_judged_lines(const Evaluation& evaluation) {
  std::string out;
  for (std::size_t i = 0; i < evaluation.flights.size(); ++i) {
    if (evaluation.scores[i].outcome != Outcome::kNotJudged) continue;
    const Flight& flight = evaluation.flights[i];
    std::string why = flight.judgement.main_cause();
    if (why.empty()) why = "the flight is too short";
    if (flight.judgement.judged_s() > 0.0) why = fmt::format("in the warm-up alone; after it: {}", why);
    if (!flight.misfits.empty()) why += fmt::format("; {}", flight.misfits);
    out += fmt::format("{}: not judged: {}; the log has {}\n", flight.name, why,
                       flight.inputs.empty() ? "no input" : flight.inputs);
  }
  return out;
}

}  // namespace airworthy::eval
