#include "cli/calibrate/unbalance_learning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "cli/calibrate/learning.h"
#include "cli/calibrate/median.h"
#include "cli/calibrate/motor_lag_fit.h"
#include "cli/eval/flight_run.h"
#include "core/detectors/unbalance/rigid_body_response.h"
#include "runtime/bus/channels.h"
#include "services/unbalance/unbalance_service.h"

namespace airworthy::calibrate {
namespace {

using unbalance::UnbalanceConfig;

constexpr double kLatencyStep_s = 0.004;
constexpr int kLatencies = 16;
constexpr double kBetterBy = 1.01;  // in power, for a latency that is not the shortest
constexpr Duration kBeforeOnset{500'000};
constexpr double kSigmas = 2.0;  // that the detector asks for
constexpr double kLeastSpeedNoise = 0.001;
constexpr double kMostSpeedNoise = 0.05;
constexpr double kMostResponse = 10.0;  // of a rigid body's, or its inverse: a wrong figure, no airframe

/// What the monitor said of one rotor, judgement by judgement.
struct RotorRecord {
  std::vector<double> amplitude_m_s2;
  std::vector<double> against_m_s2;
  std::vector<double> sigma_m_s2;
};

struct FlightRecord {
  std::string log;
  std::string vehicle;
  std::vector<RotorRecord> rotors;
  std::vector<Series> speeds;                          ///< reports of each rotor in rev/min, in flight
  std::vector<Series> commands;                        ///< of each rotor, in flight
  UnbalancePowers powers;                              ///< at the end
  std::array<double, kMaxRotors> speed_error_ratio{};  ///< at the end
  std::int64_t judgements = 0;
  std::int64_t after_onset = 0;  ///< judgements left out, for something was broken then
  UnbalanceNotJudged last_reason = UnbalanceNotJudged::kNotFlying;

  [[nodiscard]] double power() const {
    double sum = 0.0;
    for (const RotorRecord& rotor : rotors) {
      for (const double a : rotor.amplitude_m_s2) sum += a * a;
    }
    return sum;
  }
};

struct Judgement {
  TimePoint time;
  UnbalancePowers powers;
  std::array<double, kMaxRotors> speed_error_ratio;
  std::vector<RotorUnbalance> rotors;
};

void keep(const Judgement& judgement, FlightRecord& record) {
  ++record.judgements;
  for (std::size_t i = 0; i < judgement.rotors.size(); ++i) {
    const RotorUnbalance& rotor = judgement.rotors[i];
    if (rotor.reason != UnbalanceNotJudged::kJudged) {
      record.last_reason = rotor.reason;
      continue;
    }
    if (rotor.by_power) continue;  // no amplitude by phase
    record.rotors[i].amplitude_m_s2.push_back(rotor.amplitude_m_s2);
    record.rotors[i].against_m_s2.push_back(rotor.against_m_s2);
    record.rotors[i].sigma_m_s2.push_back(rotor.sigma_m_s2);
  }
}

/// One message of a value per rotor.
struct Report {
  TimePoint time;
  std::vector<double> values;
};

std::vector<Series> series_of(const std::vector<Report>& reports, std::size_t rotors, TimePoint from,
                              TimePoint until) {
  std::vector<Series> series(rotors);
  for (const Report& report : reports) {
    if (report.time < from || report.time >= until) continue;
    for (std::size_t i = 0; i < std::min(rotors, report.values.size()); ++i) {
      if (!std::isfinite(report.values[i])) continue;
      series[i].time_s.push_back(to_seconds(report.time.time_since_epoch()));
      series[i].value.push_back(std::abs(report.values[i]));
    }
  }
  return series;
}

/// Plays a log through the monitor as configured.
rt::Expected<FlightRecord> read_flight(const std::string& log, const UnbalanceConfig& config,
                                       bool whole_flight) {
  std::vector<Judgement> judgements;
  std::vector<Report> speeds;
  std::vector<Report> commands;
  const auto flight = eval::run_flight(log, "airworthy-unbalance", [&](rt::Node& node) {
    node.subscribe<esc_status_t>(channel::kEscStatus, [&](const esc_status_t& message) {
      speeds.push_back({from_us(message.header.time_us), message.speed_rpm});
    });
    node.subscribe<rotor_command_t>(channel::kRotorCommand, [&](const rotor_command_t& message) {
      commands.push_back({from_us(message.header.time_us), message.command_ratio});
    });
    auto service = std::make_shared<unbalance::UnbalanceService>(node, config);
    service->observe([&](const UnbalanceMonitor& monitor) {
      if (monitor.state() != DetectorState::kMonitoring) return;
      judgements.push_back({monitor.judged_at(),
                            monitor.powers(),
                            monitor.innovation().speed_error_ratio,
                            {monitor.rotors().begin(), monitor.rotors().end()}});
    });
    return service;
  });
  if (!flight) return tl::unexpected<rt::Error>{flight.error()};
  const TimePoint until = !whole_flight && flight->truth && flight->truth->onset
                              ? *flight->truth->onset - kBeforeOnset
                              : TimePoint::max();
  const std::size_t rotors = config.monitor.vehicle.rotor_count;
  FlightRecord record;
  record.log = log;
  record.vehicle = flight->vehicle;
  record.rotors.resize(rotors);
  for (const Judgement& judgement : judgements) {
    if (judgement.time >= until) {
      ++record.after_onset;
      continue;
    }
    keep(judgement, record);
    record.powers = judgement.powers;
    record.speed_error_ratio = judgement.speed_error_ratio;
  }
  if (judgements.empty()) return record;
  const TimePoint last = std::min(until, judgements.back().time);
  record.speeds = series_of(speeds, rotors, judgements.front().time, last);
  record.commands = series_of(commands, rotors, judgements.front().time, last);
  return record;
}

rt::Expected<std::vector<FlightRecord>> read_flights(const std::vector<std::string>& logs,
                                                     const UnbalanceConfig& config, unsigned jobs) {
  std::vector<rt::Expected<FlightRecord>> read(logs.size());
  for_each_parallel(logs.size(), jobs, [&](std::size_t i) { read[i] = read_flight(logs[i], config, false); });
  std::vector<FlightRecord> records;
  std::string errors;
  for (auto& one : read) {
    if (one && one->vehicle != config.vehicle) {
      one = rt::fail_with(
          fmt::format("{}: of vehicle \"{}\", not of \"{}\"", one->log, one->vehicle, config.vehicle));
    }
    if (one) {
      records.push_back(std::move(*one));
    } else {
      errors += (errors.empty() ? "" : "\n") + one.error().text;
    }
  }
  if (!errors.empty()) return rt::fail_with(errors);
  return records;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

struct Amplitude {
  double mean_m_s2 = 0.0;
  double sigma_m_s2 = 0.0;  ///< of the mean
};

/// Of judgements whose errors last for some 2 s.
Amplitude amplitude_of(const std::vector<double>& judged) {
  const double centre = mean(judged);
  double variance = 0.0;
  for (const double one : judged)
    variance += (one - centre) * (one - centre) / static_cast<double>(judged.size());
  const double independent = static_cast<double>(judged.size()) * to_seconds(UnbalanceMonitor::kPeriod) / 2.0;
  return {centre, std::sqrt(variance / std::max(1.0, independent))};
}

/// (2), the median over the rotors; empty without enough reports.
std::optional<double> speed_noise(const std::vector<FlightRecord>& flights) {
  std::vector<double> ratios;
  for (const FlightRecord& flight : flights) {
    for (const Series& series : flight.speeds) {
      const std::vector<double>& speed = series.value;
      std::vector<double> bends;
      for (std::size_t k = 1; k + 1 < speed.size(); ++k) {
        bends.push_back(std::abs(speed[k - 1] - 2.0 * speed[k] + speed[k + 1]));
      }
      if (bends.size() > 50) ratios.push_back(1.4826 * median(bends) / std::sqrt(6.0) / median(speed));
    }
  }
  if (ratios.empty()) return std::nullopt;
  return std::clamp(median(ratios), kLeastSpeedNoise, kMostSpeedNoise);
}

/// The median over the flights of those whose commands changed enough.
std::optional<double> motor_lag(const std::vector<FlightRecord>& flights) {
  std::vector<double> lags_s;
  for (const FlightRecord& flight : flights) {
    if (const auto fit = fit_motor_lag(flight.commands, flight.speeds))
      lags_s.push_back(fit->time_constant_s);
  }
  if (lags_s.empty()) return std::nullopt;
  return median(lags_s);
}

/// Of each rotor, the median over the flights.
std::array<double, kMaxRotors> speed_errors(const std::vector<FlightRecord>& flights, std::size_t rotors) {
  std::array<double, kMaxRotors> errors{};
  for (std::size_t i = 0; i < rotors; ++i) {
    std::vector<double> found;
    found.reserve(flights.size());
    for (const FlightRecord& flight : flights) found.push_back(flight.speed_error_ratio[i]);
    errors[i] = median(found);
  }
  return errors;
}

/// All judgements of one rotor in all flights.
RotorRecord pooled(const std::vector<FlightRecord>& flights, std::size_t rotor) {
  RotorRecord all;
  const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  for (const FlightRecord& flight : flights) {
    append(all.amplitude_m_s2, flight.rotors[rotor].amplitude_m_s2);
    append(all.against_m_s2, flight.rotors[rotor].against_m_s2);
    append(all.sigma_m_s2, flight.rotors[rotor].sigma_m_s2);
  }
  return all;
}

const char* words_for(UnbalanceNotJudged reason) {
  switch (reason) {
    case UnbalanceNotJudged::kUnfitInertialData:
      return "the inertial data are unfit: averaged, filtered or too seldom";
    case UnbalanceNotJudged::kConfounded:
      return "it turns too much like another rotor: fly manoeuvres, not a still hover";
    default:
      return "too little information: too much noise, or rotor speeds too seldom";
  }
}

rt::Expected<void> check_coverage(const std::vector<FlightRecord>& flights, std::size_t rotors) {
  std::int64_t judgements = 0;
  std::int64_t after_onset = 0;
  UnbalanceNotJudged reason = UnbalanceNotJudged::kConverging;
  for (const FlightRecord& flight : flights) {
    judgements += flight.judgements;
    after_onset += flight.after_onset;
    if (flight.last_reason != UnbalanceNotJudged::kNotFlying) reason = flight.last_reason;
  }
  const double period_s = to_seconds(UnbalanceMonitor::kPeriod);
  if (static_cast<double>(judgements) * period_s < kLeastJudged_s) {
    const std::string why = after_onset > 0
                                ? fmt::format("{:.1f} s more came after the onset of a fault in GROUND_TRUTH",
                                              static_cast<double>(after_onset) * period_s)
                                : "does it fly, with rotor speeds and inertial data?";
    return rt::fail_with(fmt::format("only {:.1f} s of flight could be judged, {:g} s are needed; {}",
                                     static_cast<double>(judgements) * period_s, kLeastJudged_s, why));
  }
  std::string errors;
  for (std::size_t i = 0; i < rotors; ++i) {
    const double seen_s = static_cast<double>(pooled(flights, i).amplitude_m_s2.size()) * period_s;
    if (seen_s >= kLeastJudged_s) continue;
    errors += fmt::format("{}rotor {} could be judged for {:.1f} s only, {:g} s are needed: {}",
                          errors.empty() ? "" : "\n", i + 1, seen_s, kLeastJudged_s, words_for(reason));
  }
  if (!errors.empty()) return rt::fail_with(errors);
  return {};
}

/// (1). Flights are read once per candidate.
rt::Expected<double> best_latency(const std::vector<std::string>& logs, UnbalanceConfig config,
                                  unsigned jobs) {
  double best_s = 0.0;
  double best_power = 0.0;
  for (int k = 0; k < kLatencies; ++k) {
    config.monitor.speed_latency_s = k * kLatencyStep_s;
    const auto flights = read_flights(logs, config, jobs);
    if (!flights) return tl::unexpected<rt::Error>{flights.error()};
    double power = 0.0;
    for (const FlightRecord& flight : *flights) power += flight.power();
    if (power > (k == 0 ? 0.0 : kBetterBy * best_power)) {
      best_power = power;
      best_s = config.monitor.speed_latency_s;
    }
  }
  return best_s;
}

/// What the trials of one rotor with one mass say.
struct Trials {
  std::size_t rotor = 0;
  double response = 0.0;
  double sigma_ratio = 0.0;  ///< 1σ of it, of itself
};

/// (4) for the amplitudes of one rotor with the mass on either blade.
Trials response_of(std::size_t rotor, double moment_kg_m, const std::vector<Amplitude>& seen,
                   double baseline_m_s2, const UnbalanceParams& params) {
  double power = -baseline_m_s2 * baseline_m_s2;
  double variance = 0.0;
  for (const Amplitude& one : seen) {
    const auto count = static_cast<double>(seen.size());
    power += one.mean_m_s2 * one.mean_m_s2 / count;
    variance += one.sigma_m_s2 * one.sigma_m_s2 / (count * count);
  }
  const double made = std::sqrt(std::max(0.0, power));
  // √(b² + m² + 2·b·m·cos φ) of a single trial: φ may be anything.
  if (seen.size() == 1) variance += 0.5 * baseline_m_s2 * baseline_m_s2;
  const double kg_m = UnbalanceMonitor::kg_m_per_m_s2(params, rotor);
  return {rotor, params.response * made * kg_m / moment_kg_m, std::sqrt(variance) / std::max(made, 1e-6)};
}

/// Of the response to a mass on `rotor`: by the trial that says most of it, or where several rotors were tried by how
/// little these agree.
double response_sigma(const std::vector<Trials>& trials, std::size_t rotor, double response,
                      const Multirotor& vehicle, double against_ratio) {
  double least = 1.0;
  double spread = 0.0;
  for (const Trials& one : trials) {
    const double transfer = response_transfer_sigma(vehicle, one.rotor, rotor, against_ratio);
    const double off = one.response / response - 1.0;
    least = std::min(least, std::hypot(one.sigma_ratio, transfer));
    spread += off * off / static_cast<double>(trials.size());
  }
  return std::max(least, std::sqrt(spread));
}

rt::Expected<void> learn_response(const std::vector<TrialFlight>& trials, const UnbalanceConfig& config,
                                  LearnedUnbalance& learned) {
  unbalance::Calibration& calibration = learned.calibration;
  std::map<std::pair<int, double>, std::vector<Amplitude>> seen;
  for (const TrialFlight& trial : trials) {
    const auto flight = read_flight(trial.log, config, true);
    if (!flight) return tl::unexpected<rt::Error>{flight.error()};
    const auto& amplitudes = flight->rotors[static_cast<std::size_t>(trial.rotor - 1)].amplitude_m_s2;
    if (static_cast<double>(amplitudes.size()) * to_seconds(UnbalanceMonitor::kPeriod) < kLeastJudged_s) {
      return rt::fail_with(
          fmt::format("{}: rotor {} could not be judged for {:g} s", trial.log, trial.rotor, kLeastJudged_s));
    }
    seen[{trial.rotor, trial.tip_mass_mg}].push_back(amplitude_of(amplitudes));
  }
  std::vector<Trials> measured;
  std::vector<double> responses;
  for (const auto& [trial, amplitudes] : seen) {
    const auto& [number, tip_mass_mg] = trial;
    const auto rotor = static_cast<std::size_t>(number - 1);
    const double moment_kg_m = 1e-6 * tip_mass_mg * config.monitor.vehicle.propeller_radius_m;
    measured.push_back(
        response_of(rotor, moment_kg_m, amplitudes, calibration.rotors[rotor].baseline_m_s2, config.monitor));
    const double ratio = measured.back().response;
    if (ratio > 0.0 && (ratio > kMostResponse || ratio < 1.0 / kMostResponse)) {
      return rt::fail_with(
          fmt::format("rotor {}: {:g} mg made {:.2g} times the vibration that follows from the vehicle file: "
                      "are the milligrams right, and its mass and propeller radius?",
                      number, tip_mass_mg, ratio));
    }
    responses.push_back(ratio);
    if (amplitudes.size() == 1) {
      learned.notes.push_back(fmt::format(
          "rotor {}: one trial only; fly again with the mass on the other blade: its phase against the "
          "natural unbalance is not known, which makes the response uncertain by {:.0f} %",
          number, 100.0 * measured.back().sigma_ratio));
    }
  }
  const double response = median(responses);
  if (!(response > 0.0))
    return rt::fail_with("the trial mass made no vibration: is it on the rotor that was named?");
  calibration.response = response;
  calibration.has_trial_mass = true;
  for (std::size_t i = 0; i < calibration.rotors.size(); ++i) {
    calibration.rotors[i].response_sigma_ratio =
        response_sigma(measured, i, response, config.monitor.vehicle, calibration.against_ratio);
  }
  return {};
}

}  // namespace

std::array<double, kMaxRotors> mean_powers(const std::vector<UnbalancePowers>& flights) {
  std::array<double, kMaxRotors> mean{};
  const auto taught = std::count_if(flights.begin(), flights.end(),
                                    [](const auto& one) { return one.learned_s >= kLeastJudged_s; });
  for (const UnbalancePowers& one : flights) {
    if (one.learned_s < kLeastJudged_s) continue;
    for (std::size_t i = 0; i < kMaxRotors; ++i) mean[i] += one.m2_s4[i] / static_cast<double>(taught);
  }
  return mean;
}

rt::Expected<LearnedUnbalance> learn_unbalance(const std::vector<std::string>& logs,
                                               const std::vector<TrialFlight>& trials,
                                               const UnbalanceConfig& config, unsigned jobs) {
  UnbalanceConfig tuned = config;
  const std::size_t rotors = config.monitor.vehicle.rotor_count;
  auto flights = read_flights(logs, tuned, jobs);
  if (!flights) return tl::unexpected<rt::Error>{flights.error()};
  if (const auto covered = check_coverage(*flights, rotors); !covered) {
    return tl::unexpected<rt::Error>{covered.error()};
  }
  if (const auto noise = speed_noise(*flights)) tuned.monitor.speed_noise_ratio = *noise;
  const auto lag_s = motor_lag(*flights);
  if (lag_s) tuned.monitor.vehicle.motor_time_constant_s = *lag_s;
  tuned.monitor.speed_error_ratio = speed_errors(*flights, rotors);
  tuned.monitor.most_speed_error_ratio = unbalance::kCalibratedSpeedError;
  const auto latency = best_latency(logs, tuned, jobs);
  if (!latency) return tl::unexpected<rt::Error>{latency.error()};
  tuned.monitor.speed_latency_s = *latency;
  flights = read_flights(logs, tuned, jobs);
  if (!flights) return tl::unexpected<rt::Error>{flights.error()};
  if (const auto covered = check_coverage(*flights, rotors); !covered) {
    return tl::unexpected<rt::Error>{covered.error()};
  }

  LearnedUnbalance learned;
  unbalance::Calibration& calibration = learned.calibration;
  calibration.vehicle = config.vehicle;
  calibration.flights = static_cast<int>(logs.size());
  calibration.accel_low_pass_Hz = config.monitor.low_pass_Hz;
  calibration.speed_latency_s = tuned.monitor.speed_latency_s;
  calibration.speed_noise_ratio = tuned.monitor.speed_noise_ratio;
  calibration.response = config.monitor.response;
  calibration.motor_time_constant_s = lag_s.value_or(0.0);
  if (!lag_s) {
    learned.notes.push_back(
        "no motor lag: no commands in the logs, or they hardly change; that of the vehicle file is used");
  }
  for (const FlightRecord& flight : *flights) {
    calibration.judged_s += static_cast<double>(flight.judgements) * to_seconds(UnbalanceMonitor::kPeriod);
  }
  std::vector<UnbalancePowers> powers;
  for (const FlightRecord& flight : *flights) powers.push_back(flight.powers);
  const auto powers_m2_s4 = mean_powers(powers);
  double power = 0.0;
  double against = 0.0;
  for (std::size_t i = 0; i < rotors; ++i) {
    const RotorRecord all = pooled(*flights, i);
    const double baseline = mean(all.amplitude_m_s2);
    double variance = 0.0;  // (3)
    for (const double a : all.amplitude_m_s2) {
      variance += (a - baseline) * (a - baseline) / static_cast<double>(all.amplitude_m_s2.size());
    }
    calibration.rotors.push_back({baseline, std::sqrt(variance), powers_m2_s4[i],
                                  tuned.monitor.speed_error_ratio[i],
                                  config.monitor.response_sigma_ratio[i]});
    learned.smallest_growth_m_s2.push_back(config.monitor.smallest_m_s2 +
                                           kSigmas * std::hypot(median(all.sigma_m_s2), std::sqrt(variance)));
    for (const double a : all.amplitude_m_s2) power += a * a;
    for (const double a : all.against_m_s2) against += a * a;
  }
  calibration.against_ratio = power > 0.0 ? std::clamp(std::sqrt(against / power), 0.05, 1.0) : 0.3;
  if (!trials.empty()) {
    if (const auto measured = learn_response(trials, tuned, learned); !measured) {
      return tl::unexpected<rt::Error>{measured.error()};
    }
  }
  return learned;
}

}  // namespace airworthy::calibrate
