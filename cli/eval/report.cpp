#include "cli/eval/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

namespace airworthy::eval {
namespace {

using Json = nlohmann::ordered_json;

std::string fault_of(const Flight& flight) {
  if (!flight.truth) return "not known";
  if (!flight.truth->onset) return "none";
  return flight.truth->component + " " + flight.truth->fault_kind;
}

std::string number(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : std::string{"–"};
}

std::string totals_line(const char* name, const Totals& t) {
  return fmt::format(
      "{:<22} tp {} fp {} fn {} tn {}   precision {} recall {} accuracy {}   within 10 s: {} of {}\n", name,
      t.tp, t.fp, t.fn, t.tn, number(t.precision, 3), number(t.recall, 3), number(t.accuracy, 3),
      t.found_within_10_s, t.tp + t.fn);
}

Json json_of(const Totals& t) {
  return {
      {"flights", t.flights},
      {"tp", t.tp},
      {"fp", t.fp},
      {"fn", t.fn},
      {"tn", t.tn},
      {"precision", t.precision},
      {"recall", t.recall},
      {"accuracy", t.accuracy},
      {"found_within_10_s", t.found_within_10_s},
      {"mean_delay_s", t.mean_delay_s},
      {"median_delay_s", t.median_delay_s},
      {"max_delay_s", t.max_delay_s},
      {"false_alarms", t.false_alarms},
      {"healthy_h", t.healthy_h},
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

std::map<std::string, std::vector<Score>> by_fault(const Evaluation& evaluation) {
  std::map<std::string, std::vector<Score>> groups;
  for (std::size_t i = 0; i < evaluation.flights.size(); ++i) {
    if (evaluation.flights[i].truth) groups[fault_of(evaluation.flights[i])].push_back(evaluation.scores[i]);
  }
  return groups;
}

}  // namespace

std::string to_table(const Evaluation& evaluation) {
  std::size_t width = 6;
  for (const Flight& flight : evaluation.flights) width = std::max(width, flight.name.size());
  std::string out = fmt::format("{:<{}}  {:<28} {:<12} {:>8}  {}\n", "flight", width, "truth", "outcome",
                                "delay s", "first alarm");
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
    out += fmt::format("{:<{}}  {:<28} {:<12} {:>8}  {}\n", flight.name, width, fault_of(flight),
                       to_string(score.outcome), delay, first);
  }
  const Totals totals = total(evaluation.scores);
  out += '\n';
  out += totals_line("first alarm decides", totals);
  out += totals_line("0.5 s early allowed", total(evaluation.tolerant_scores));
  out += fmt::format(
      "delay mean {} median {} max {} s   false alarms {} in {} h: {} per hour (95 %: {} to {})\n\n",
      number(totals.mean_delay_s, 2), number(totals.median_delay_s, 2), number(totals.max_delay_s, 2),
      totals.false_alarms, number(totals.healthy_h, 2), number(totals.false_alarms_per_hour, 1),
      number(totals.false_alarms_per_hour_low, 1), number(totals.false_alarms_per_hour_high, 1));
  for (const auto& [fault, scores] : by_fault(evaluation)) {
    const Totals t = total(scores);
    if (fault == "none") {
      out += fmt::format("{:<28} silent {} of {}\n", fault, t.tn, t.flights);
    } else {
      out += fmt::format("{:<28} found {} of {}   delay median {} mean {} max {} s\n", fault, t.tp, t.flights,
                         number(t.median_delay_s, 2), number(t.mean_delay_s, 2), number(t.max_delay_s, 2));
    }
  }
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
    for (const Alarm& alarm : flight.alarms) {
      alarms.push_back({{"time_us", to_us(alarm.time)},
                        {"onset_us", to_us(alarm.onset)},
                        {"component", alarm.component},
                        {"fault_kind", alarm.fault_kind},
                        {"magnitude", alarm.magnitude}});
    }
    Json row{{"flight", flight.name},
             {"truth", fault_of(flight)},
             {"onset_us", nullptr},
             {"outcome", to_string(score.outcome)},
             {"delay_s", nullptr},
             {"false_alarms", score.false_alarms},
             {"healthy_s", score.healthy_s},
             {"duration_s", to_seconds(flight.end - flight.start)},
             {"alarms", alarms}};
    if (flight.judgement.has_any()) {
      row["judged_s"] = flight.judgement.judged_s();
      row["muted"] = json_of(flight.judgement, flight.start);
      for (const auto& [component, its] : flight.components)
        row["components"][component] = {{"judged_s", its.judged_s()}, {"muted", json_of(its, flight.start)}};
    }
    if (flight.truth && flight.truth->onset) row["onset_us"] = to_us(*flight.truth->onset);
    if (score.outcome == Outcome::kTruePositive) row["delay_s"] = score.delay_s;
    flights.push_back(row);
  }
  Json by_type = Json::object();
  for (const auto& [fault, scores] : by_fault(evaluation)) by_type[fault] = json_of(total(scores));
  return Json{{"flights", flights},
              {"totals", json_of(total(evaluation.scores))},
              {"totals_0.5_s_early_allowed", json_of(total(evaluation.tolerant_scores))},
              {"by_fault", by_type}}
             .dump(1) +
         "\n";
}

}  // namespace airworthy::eval
