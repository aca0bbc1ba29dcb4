#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "cli/eval/detectors.h"
#include "cli/eval/flight_run.h"
#include "cli/eval/nested.h"
#include "cli/eval/report.h"
#include "runtime/process/command_line.h"
#include "runtime/process/exit.h"

namespace {

using namespace airworthy;

constexpr const char* kRules = R"(What counts
  The first alarm of a flight decides: silent, found, missed, false alarm, or early (before the fault: a false alarm
  and a miss). Beside "found" stands whether the part named is the failed one (or the control lost with it), one of
  several candidates, or another.
  A fault that the detector does not watch, or that begins after the end of the log, is said and not looked for: the
  flight counts as healthy, and an alarm in it is a false one.
  Alarms of the first 20 s of a flight, and that time, do not count with --detector response, which learns meanwhile.
  A flight of which nothing was judged is "not judged", never silent. False alarms per hour are of judged time.
Exit code
  0; 64 wrong use; 65 a log was refused; 66 of a flight nothing was judged; 78 wrong configuration.
docs/evaluation.md has the rules whole.)";

struct Options {
  std::vector<std::string> logs;
  std::string detector = eval::detector_names().front();
  std::string config_path;
  std::vector<std::string> overrides;
  std::string calibration_path;
  std::string vehicle;  ///< whose logs these are; empty: the configured one
  std::string flight_name_pattern;
  bool nested = false;
  bool json = false;
  bool muted = false;
  calibrate::LearningParams learning;

  [[nodiscard]] bool is_response() const { return detector == eval::detector_names().front(); }
};

using Flights = std::vector<rt::Expected<eval::Flight>>;

std::string quoted(const std::string& text) { return nlohmann::json(text).dump(); }

rt::Expected<Flights> run_configured(const Options& options) {
  std::vector<std::string> overrides = options.overrides;
  if (!options.calibration_path.empty())
    overrides.push_back("calibration=" + quoted(options.calibration_path));
  const auto detector = eval::load_detector(options.detector, options.config_path, overrides);
  if (!detector) return tl::unexpected<rt::Error>{detector.error()};
  Flights flights(options.logs.size());
  calibrate::for_each_parallel(options.logs.size(), options.learning.jobs, [&](std::size_t i) {
    const std::string& log = options.logs[i];
    eval::JudgementLog judgement;
    flights[i] = eval::run_flight(log, detector->process,
                                  [&](rt::Node& node) { return detector->make(node, judgement); });
    if (!flights[i]) return;
    if (judgement.has_any()) flights[i]->judgement = std::move(judgement);  // finer than DETECTOR_STATUS
    const auto checked = eval::check_vehicle(log, flights[i]->vehicle,
                                             options.vehicle.empty() ? detector->vehicle : options.vehicle);
    if (!checked) flights[i] = tl::unexpected<rt::Error>{checked.error()};
  });
  return flights;
}

// Where there is a calibration it must be of the log's own vehicle.
rt::Expected<void> check_calibration(const std::string& log, const eval::Flight& flight,
                                     const std::optional<response::Calibration>& calibration) {
  if (!calibration || flight.vehicle == calibration->vehicle) return {};
  return rt::fail_with(fmt::format("{}: of vehicle \"{}\", but the calibration is of \"{}\"", log,
                                   flight.vehicle, calibration->vehicle));
}

Flights run_all(const Options& options, const std::string& vehicle, const response::ResponseConfig& config,
                const std::optional<response::Calibration>& calibration) {
  Flights flights(options.logs.size());
  calibrate::for_each_parallel(options.logs.size(), options.learning.jobs, [&](std::size_t i) {
    const std::string& log = options.logs[i];
    flights[i] = eval::run_flight(log, config);
    if (!flights[i]) return;
    auto checked = eval::check_vehicle(log, flights[i]->vehicle, vehicle);
    if (checked) checked = check_calibration(log, *flights[i], calibration);
    if (!checked) flights[i] = tl::unexpected<rt::Error>{checked.error()};
  });
  return flights;
}

rt::Expected<Flights> run_response(const Options& options, const calibrate::FlightName& flight_name) {
  const bool own_calibration = options.nested || !options.calibration_path.empty();
  auto config = own_calibration ? response::ResponseConfig::load_cold(options.config_path, options.overrides)
                                : response::ResponseConfig::load(options.config_path, options.overrides);
  if (!config) return tl::unexpected<rt::Error>{config.error()};
  const std::string vehicle = options.vehicle.empty() ? config->vehicle : options.vehicle;
  std::optional<response::Calibration> calibration;
  if (!options.calibration_path.empty()) {
    auto loaded = response::load_calibration(options.calibration_path);
    if (!loaded) return tl::unexpected<rt::Error>{loaded.error()};
    auto monitor = response::with_calibration(config->monitor, config->channel_names(), *loaded);
    if (!monitor) return rt::fail_with(options.calibration_path + ": " + monitor.error().text);
    config->monitor = *monitor;
    calibration = std::move(*loaded);
  }
  return options.nested ? eval::run_nested(options.logs, vehicle, *config, flight_name, options.learning)
                        : run_all(options, vehicle, *config, calibration);
}

rt::Expected<void> refuse_twice(const std::vector<std::string>& logs) {
  std::map<std::filesystem::path, std::string> given;
  for (const std::string& log : logs) {
    std::error_code error;
    const auto [first, is_new] = given.try_emplace(std::filesystem::weakly_canonical(log, error), log);
    if (!is_new && !error)
      return rt::fail_with(fmt::format("{}: given twice, also as {}", log, first->second));
  }
  return {};
}

// Only the response detector needs time to learn the flight.
eval::Rules rules_of(const Options& options) {
  eval::Rules rules;
  rules.detector = options.detector;
  if (!options.is_response()) rules.warm_up = Duration{0};
  return rules;
}

int evaluate(const Options& options) {
  const auto flight_name = calibrate::FlightName::parse(options.flight_name_pattern);
  if (!flight_name) return rt::fail(EX_USAGE, flight_name.error());
  if (!options.is_response() && options.nested)
    return rt::fail(EX_USAGE, rt::Error{"--nested is for --detector response"});
  if (const auto once = refuse_twice(options.logs); !once) return rt::fail(EX_USAGE, once.error());
  auto flights = options.is_response() ? run_response(options, *flight_name) : run_configured(options);
  if (!flights) return rt::fail(EX_CONFIG, flights.error());
  eval::Evaluation evaluation;
  evaluation.rules = rules_of(options);
  eval::Rules tolerant = evaluation.rules;
  tolerant.onset_tolerance = Duration{500'000};
  int code = EX_OK;
  for (auto& flight : *flights) {
    if (!flight) {
      code = rt::fail(EX_DATAERR, flight.error());
      continue;
    }
    evaluation.scores.push_back(eval::score(*flight, evaluation.rules));
    evaluation.tolerant_scores.push_back(eval::score(*flight, tolerant));
    evaluation.flights.push_back(std::move(*flight));
  }
  if (evaluation.flights.empty()) return code;
  fmt::print("{}", options.json ? eval::to_json(evaluation) : eval::to_table(evaluation));
  if (options.muted && !options.json) fmt::print("\n{}", eval::to_muted_table(evaluation));
  if (const std::string silence = eval::not_judged_lines(evaluation); !silence.empty()) {
    const int not_judged = rt::fail(EX_NOINPUT, rt::Error{silence});
    if (code == EX_OK) code = not_judged;
  }
  return code;
}

int run(int argc, char** argv) {
  CLI::App app{
      "Runs a configured detector over recorded flights, on message time, and scores it against the truth in "
      "the logs.",
      "airworthy eval"};
  app.set_version_flag("--version", "airworthy-eval " AIRWORTHY_VERSION);
  app.footer(kRules);
  Options options;
  options.learning.jobs = std::max(1U, std::thread::hardware_concurrency());
  app.add_option("LOG", options.logs, "LCM logs, for example from 'airworthy import' or 'airworthy sim'")
      ->required();
  app.add_option("--detector", options.detector, "which one the configuration is of; default response")
      ->check(CLI::IsMember(eval::detector_names()));
  app.add_option("--config", options.config_path, "configuration of the detector")->required();
  app.add_option("--set", options.overrides, "override of a key, as KEY=VALUE; repeatable")
      ->allow_extra_args(false);
  app.add_option("--vehicle", options.vehicle,
                 "vehicle whose logs these are; default: the configured one. Logs of any other are refused");
  auto* calibration_option =
      app.add_option("--calibration", options.calibration_path,
                     "with this file of 'airworthy calibrate' of the same detector; else the one that the "
                     "configuration names, if any");
  auto* nested_flag = app.add_flag(
      "--nested", options.nested,
      "--detector response: start each flight warm from a calibration that all the other flights "
      "taught");
  nested_flag->excludes(calibration_option);
  app.add_option(
         "--flight-name", options.flight_name_pattern,
         "--nested: regular expression whose first group, in a log's name, says which flight it is a part of")
      ->needs(nested_flag);
  app.add_option("--false-alarms-per-hour", options.learning.false_alarms_per_hour,
                 "--nested: of each channel; default 0.01")
      ->check(rt::is_number(rt::Range{1e-6, 10.0}))
      ->needs(nested_flag);
  app.add_flag(
      "--muted", options.muted,
      "also print how long each flight was judged and which seconds were not, by cause, and how long each "
      "component; to half a second, effectiveness to a sample; with --json it is always there");
  app.add_flag("--json", options.json, "print JSON instead of a table");
  app.add_option("--jobs", options.learning.jobs, "flights evaluated at a time")
      ->check(rt::is_whole_number(1, 256));
  if (const auto ended = rt::parse_command_line(app, argc, argv)) return *ended;
  return evaluate(options);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {  // memory or threads ran out
    std::fprintf(stderr, "airworthy-eval: %s\n", error.what());
    return EX_OSERR;
  }
}
