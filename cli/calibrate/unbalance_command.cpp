#include "cli/calibrate/unbalance_command.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <string>
#include <thread>
#include <vector>

#include "cli/calibrate/unbalance_learning.h"
#include "runtime/file/output_file.h"
#include "runtime/process/command_line.h"
#include "runtime/process/exit.h"

namespace airworthy::calibrate {
namespace {

struct Options {
  std::vector<std::string> logs;
  std::string config_path;
  std::vector<std::string> overrides;
  std::string output;
  std::vector<std::string> trials;
  unsigned jobs = 1;
};

template <class Number>
bool parse(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size();
}

/// "2:40:LOG": rotor, mg at the tip, log.
rt::Expected<TrialFlight> parse_trial(const std::string& text, std::size_t rotors) {
  TrialFlight trial;
  const auto first = text.find(':');
  const auto second = first == std::string::npos ? first : text.find(':', first + 1);
  const bool is_whole =
      second != std::string::npos && second + 1 < text.size() &&
      parse(std::string_view{text}.substr(0, first), trial.rotor) &&
      parse(std::string_view{text}.substr(first + 1, second - first - 1), trial.tip_mass_mg);
  if (!is_whole) {
    return rt::fail_with(
        fmt::format("--trial {}: must be ROTOR:MILLIGRAM:LOG, for example 2:100:trial.lcm", text));
  }
  if (trial.rotor < 1 || static_cast<std::size_t>(trial.rotor) > rotors) {
    return rt::fail_with(fmt::format("--trial {}: rotor {} of a vehicle with {}", text, trial.rotor, rotors));
  }
  if (!(trial.tip_mass_mg > 0.0) || trial.tip_mass_mg > 1e6) {
    return rt::fail_with(
        fmt::format("--trial {}: {:g} mg must be above 0 and at most 1e6", text, trial.tip_mass_mg));
  }
  trial.log = text.substr(second + 1);
  return trial;
}

void print_summary(const LearnedUnbalance& learned, const UnbalanceParams& params) {
  const unbalance::Calibration& calibration = learned.calibration;
  UnbalanceParams measured = params;
  measured.response = calibration.response;
  fmt::print(
      "{} flights, {:.0f} s judged; telemetry {:.0f} ms late, noise {:.2f} %; motor lag {}; response "
      "{:.2f}{}\n",
      calibration.flights, calibration.judged_s, 1e3 * calibration.speed_latency_s,
      100.0 * calibration.speed_noise_ratio,
      calibration.motor_time_constant_s > 0.0
          ? fmt::format("{:.0f} ms", 1e3 * calibration.motor_time_constant_s)
          : "not learned",
      calibration.response,
      calibration.has_trial_mass ? " by trial mass"
                                 : ", not measured: absolute masses may be off by its error");
  fmt::print("  {:<8} {:>14} {:>12} {:>12} {:>26} {:>14}\n", "rotor", "baseline m/s^2", "g*mm", "mg at tip",
             "smallest growth seen, mg", "masses within");
  for (std::size_t i = 0; i < calibration.rotors.size(); ++i) {
    const auto& rotor = calibration.rotors[i];
    const double g_mm = 1e6 * UnbalanceMonitor::kg_m_per_m_s2(measured, i);
    const double mg = g_mm / params.vehicle.propeller_radius_m;
    fmt::print("  {:<8} {:>6.3f} ± {:<5.3f} {:>12.3g} {:>12.3g} {:>26.3g} {:>12.0f} %\n", i + 1,
               rotor.baseline_m_s2, rotor.baseline_sigma_m_s2, g_mm * rotor.baseline_m_s2,
               mg * rotor.baseline_m_s2, mg * learned.smallest_growth_m_s2[i],
               200.0 * rotor.response_sigma_ratio);
  }
  for (const std::string& note : learned.notes) fmt::print("note: {}\n", note);
}

}  // namespace

int calibrate_unbalance(int argc, char** argv) {
  CLI::App app{
      "Learns from healthy flights how well the propellers of a vehicle are balanced, and writes it to a "
      "file for "
      "airworthy-unbalance (key `calibration`).",
      "airworthy calibrate unbalance"};
  app.set_version_flag("--version", "airworthy-calibrate " AIRWORTHY_VERSION);
  Options options;
  options.jobs = std::max(1U, std::thread::hardware_concurrency());
  app.add_option(
         "LOG", options.logs,
         "LCM logs of healthy flights; of a flight with a GROUND_TRUTH fault the part before it is used")
      ->required();
  app.add_option("--config", options.config_path, "configuration of airworthy-unbalance")->required();
  app.add_option("--set", options.overrides, "override of a key, as KEY=VALUE; repeatable")
      ->allow_extra_args(false);
  app.add_option("-o,--output", options.output, "calibration file to write")->required();
  app.add_option(
         "--trial", options.trials,
         "ROTOR:MILLIGRAM:LOG, a flight with a known mass stuck to the tip of one blade of that rotor; once "
         "for either blade. Measures what the inertial unit feels, so that masses come out right; repeatable")
      ->allow_extra_args(false);
  app.add_option("--jobs", options.jobs, "flights read at a time")->check(rt::is_whole_number(1, 256));
  if (const auto ended = rt::parse_command_line(app, argc, argv)) return *ended;
  // Learning starts from nothing, whatever the configuration names.
  const auto config = unbalance::UnbalanceConfig::load_uncalibrated(options.config_path, options.overrides);
  if (!config) return rt::fail(EX_CONFIG, config.error());
  std::vector<TrialFlight> trials;
  for (const std::string& text : options.trials) {
    auto trial = parse_trial(text, config->monitor.vehicle.rotor_count);
    if (!trial) return rt::fail(EX_USAGE, trial.error());
    trials.push_back(std::move(*trial));
  }
  if (const auto checked = rt::check_output_path(options.output); !checked) {
    return rt::fail(EX_CANTCREAT, checked.error());
  }
  const auto learned = learn_unbalance(options.logs, trials, *config, options.jobs);
  if (!learned) return rt::fail(EX_DATAERR, learned.error());
  if (const auto written = rt::write_file(options.output, to_toml(learned->calibration)); !written) {
    return rt::fail(EX_CANTCREAT, written.error());
  }
  print_summary(*learned, config->monitor);
  return EX_OK;
}

}  // namespace airworthy::calibrate
