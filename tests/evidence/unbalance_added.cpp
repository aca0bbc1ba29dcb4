#include <algorithm>
#include <cmath>

#include "tests/evidence/unbalance_recorded.h"

namespace airworthy::testing {
namespace {

using nlohmann::json;

/// How the speeds reach the tracker, and what it is told of that.
struct Link {
  const char* name;
  SpeedTelemetry telemetry;
  double told_latency_s;
  bool follows_clocks = true;
};

constexpr double kResolution_rad_s = 1.5;  // 100 electrical rev/min of 7 pole pairs
constexpr SpeedTelemetry kFast{};
constexpr SpeedTelemetry kLate8{.delay_s = 0.008, .period_s = 0.02, .resolution_rad_s = kResolution_rad_s};
constexpr SpeedTelemetry kLate50{.delay_s = 0.05, .period_s = 0.02, .resolution_rad_s = kResolution_rad_s};
constexpr std::array kLinks{
    Link{.name = "as recorded", .telemetry = kFast, .told_latency_s = 0.0},
    Link{.name = "50 Hz, 8 ms late", .telemetry = kLate8, .told_latency_s = 0.008},
    Link{.name = "50 Hz, 50 ms late", .telemetry = kLate50, .told_latency_s = 0.05},
    Link{.name = "50 Hz, 50 ms late, told 8 ms", .telemetry = kLate50, .told_latency_s = 0.008},
    Link{.name = "as recorded; clocks not followed",
         .telemetry = kFast,
         .told_latency_s = 0.0,
         .follows_clocks = false}};

/// A flight to be spoilt: from when on, and the baseline that the monitor has then.
struct Trial {
  const RecordedFlight* flight;
  double onset_s;
  UnbalanceParams params;
};

struct Outcome {
  int right = 0;
  int wrong = 0;
  int several = 0;  ///< reported as an unbalance that may be one of several rotors
  int nobody = 0;
  int early = 0;        ///< something was reported before the onset
  int wrong_later = 0;  ///< another rotor too, after the right one
  std::vector<double> delays_s;
  std::vector<double> estimates;  ///< growth found over what was added
  std::array<int, 4> right_by_rotor{};
};

void judge(const Trial& trial, const RecordedSet& set, const Link& link, const AddedUnbalance& added,
           std::uint64_t seed, Outcome& outcome) {
  const RecordedFlight spoilt = add_unbalance(*trial.flight, set, added, seed);
  const UnbalanceFlight result = judge_unbalance(spoilt, trial.params, link.telemetry);
  bool is_right = false;
  bool is_wrong = false;
  for (const auto& report : result.reports) {
    if (report.time_s < added.onset_s) {
      ++outcome.early;
      return;
    }
    const bool names_it = report.rotor == added.rotor;
    if (names_it && !is_right && !is_wrong) {
      is_right = true;
      outcome.delays_s.push_back(report.time_s - added.onset_s);
    } else if (!names_it) {
      outcome.wrong_later += is_right ? 1 : 0;
      is_wrong = is_wrong || !is_right;
    }
  }
  outcome.right += is_right ? 1 : 0;
  outcome.wrong += is_wrong ? 1 : 0;
  outcome.right_by_rotor[added.rotor] += is_right ? 1 : 0;
  if (!is_right && !is_wrong) ++(result.ambiguities_s.empty() ? outcome.nobody : outcome.several);
}

json described(double amplitude_m_s2, Outcome& outcome) {
  std::sort(outcome.delays_s.begin(), outcome.delays_s.end());
  const auto quantile = [&](double share) -> json {
    if (outcome.delays_s.empty()) return nullptr;
    const auto last = static_cast<double>(outcome.delays_s.size() - 1);
    return outcome.delays_s[static_cast<std::size_t>(std::lround(share * last))];
  };
  return {{"amplitude_m_s2", amplitude_m_s2},
          {"right", outcome.right},
          {"wrong", outcome.wrong},
          {"several", outcome.several},
          {"nobody", outcome.nobody},
          {"early", outcome.early},
          {"wrong_later", outcome.wrong_later},
          {"delay_median_s", quantile(0.5)},
          {"delay_95_s", quantile(0.95)},
          {"right_by_rotor", outcome.right_by_rotor}};
}

UnbalanceParams params_for(const RecordedSet& set, const Link& link) {
  UnbalanceParams params = set.params;
  params.speed_latency_s = link.told_latency_s;
  if (!link.follows_clocks) params.most_speed_error_ratio = 0.0;
  return params;
}

/// After the clocks are known they are followed only as far as they drift.
void know_clocks(UnbalanceParams& params) {
  params.most_speed_error_ratio = std::min(params.most_speed_error_ratio, 0.002);
}

/// The baseline of the thrown quadrotors comes from the other flights; the onset is 3 s into a flight.
std::vector<Trial> thrown_trials(const RecordedSet& set, const Link& link) {
  constexpr double kIntoFlight_s = 3.0;
  constexpr double kLeastAfter_s = 4.0;
  const UnbalanceParams start = params_for(set, link);
  std::vector<UnbalanceFlight> healthy;
  for (const RecordedFlight& flight : set.flights)
    healthy.push_back(judge_unbalance(flight, start, link.telemetry));
  std::vector<Trial> trials;
  for (std::size_t k = 0; k < healthy.size(); ++k) {
    if (healthy[k].moments.empty()) continue;
    const double onset_s = healthy[k].moments.front().time_s + kIntoFlight_s;
    if (healthy[k].moments.back().time_s < onset_s + kLeastAfter_s) continue;
    Trial trial{&set.flights[k], onset_s, start};
    std::vector<std::array<double, 4>> amplitudes;
    std::vector<const UnbalanceFlight*> others;
    for (std::size_t other = 0; other < healthy.size(); ++other) {
      if (other == k) continue;
      amplitudes.push_back(healthy[other].rms_amplitude_m_s2());
      others.push_back(&healthy[other]);
    }
    learn_baseline(amplitudes, trial.params);
    if (link.follows_clocks) {
      learn_speed_errors(others, trial.params);
      know_clocks(trial.params);
    }
    trials.push_back(trial);
  }
  return trials;
}

/// The Bebop's baseline comes from the first half of its only flight, the onset is at the middle.
std::vector<Trial> bebop_trials(const RecordedSet& set, const Link& link) {
  Trial trial{&set.flights.front(), kBebopHalf_s, params_for(set, link)};
  const UnbalanceFlight healthy = judge_unbalance(set.flights.front(), trial.params, link.telemetry);
  const auto amplitudes = amplitudes_by_second(healthy, kBebopFrom_s + 1.5, kBebopHalf_s);
  learn_baseline(amplitudes, trial.params);
  if (link.follows_clocks) {
    trial.params.speed_error_ratio = {};
    for (const auto& moment : healthy.moments) {
      if (moment.time_s > kBebopHalf_s) break;
      std::copy(moment.speed_error_ratio.begin(), moment.speed_error_ratio.end(),
                trial.params.speed_error_ratio.begin());
    }
    know_clocks(trial.params);
  }
  return {trial};
}

json added_to(const RecordedSet& set, std::vector<Trial> (*trials_of)(const RecordedSet&, const Link&),
              std::span<const double> amplitudes_m_s2, int seeds, double against_ratio, std::uint64_t seed) {
  json links = json::array();
  for (const Link& link : kLinks) {
    const auto trials = trials_of(set, link);
    json rows = json::array();
    for (const double amplitude : amplitudes_m_s2) {
      Outcome outcome;
      for (std::size_t k = 0; k < trials.size(); ++k) {
        for (std::size_t rotor = 0; rotor < 4; ++rotor) {
          for (int n = 0; n < seeds; ++n) {
            const AddedUnbalance added{.rotor = rotor,
                                       .amplitude_m_s2 = amplitude,
                                       .onset_s = trials[k].onset_s,
                                       .against_ratio = against_ratio};
            judge(trials[k], set, link, added, seed + 1000 * k + 10 * rotor + static_cast<std::uint64_t>(n),
                  outcome);
          }
        }
      }
      rows.push_back(described(amplitude, outcome));
    }
    json baselines = json::array();
    for (const Trial& trial : trials)
      baselines.push_back({{"flight", trial.flight->name},
                           {"onset_s", trial.onset_s},
                           {"has_baseline", trial.params.has_baseline},
                           {"baseline_m_s2", trial.params.baseline_m_s2},
                           {"sigma_m_s2", trial.params.baseline_sigma_m_s2},
                           {"speed_error_ratio", trial.params.speed_error_ratio}});
    links.push_back({{"link", link.name}, {"trials", baselines}, {"rows", rows}});
  }
  return {
      {"set", set.name},
      {"links", links},
      {"mass_kg", set.params.vehicle.mass_kg},
      {"radius_mm", 1e3 * set.params.vehicle.propeller_radius_m},
      {"g_mm_per_m_s2_and_kg", 1e6 / std::pow(UnbalanceMonitor::hover_speed_rad_s(set.params.vehicle), 2)}};
}

}  // namespace

nlohmann::json added_evidence(const std::filesystem::path& data, std::uint64_t seed) {
  nlohmann::json result = json::array();
  const RecordedSet thrown = thrown_set(data);
  // Before the sensor, whose low-pass leaves 1.6 % of them at hover speed.
  constexpr std::array kThrown_m_s2{0.0, 1.0, 1.5, 2.0, 3.0, 4.5, 6.0, 9.0, 15.0};
  if (!thrown.flights.empty()) result.push_back(added_to(thrown, thrown_trials, kThrown_m_s2, 1, 0.0, seed));
  const RecordedSet flown = bebop_set(data);
  constexpr std::array kBebop_m_s2{0.0, 0.4, 0.7, 1.0, 1.5, 2.0, 3.0, 4.5, 7.0};
  if (!flown.flights.empty()) result.push_back(added_to(flown, bebop_trials, kBebop_m_s2, 10, 0.5, seed));
  return result;
}

}  // namespace airworthy::testing
