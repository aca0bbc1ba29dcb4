#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "cli/eval/flight_run.h"
#include "cli/eval/nested.h"
#include "cli/eval/report.h"
#include "runtime/process/exit.h"

namespace {

using namespace airworthy;

// The configured detector; where there is a calibration it must be of the log's own vehicle.
rt::Expected<eval::Flight> run_one(const std::string& log, const response::ResponseConfig& config,
                                   const std::optional<response::Calibration>& calibration) {
  auto flight = eval::run_flight(log, config);
  if (flight && calibration && flight->vehicle != calibration->vehicle) {
    return rt::fail_with(fmt::format("{}: of vehicle \"{}\", but the calibration is of \"{}\"", log,
                                     flight->vehicle, calibration->vehicle));
  }
  return flight;
}

std::vector<rt::Expected<eval::Flight>> run_all(const std::vector<std::string>& logs,
                                                const response::ResponseConfig& config,
                                                const std::optional<response::Calibration>& calibration,
                                                unsigned jobs) {
  std::vector<rt::Expected<eval::Flight>> flights(logs.size());
  calibrate::for_each_parallel(logs.size(), jobs,
                               [&](std::size_t i) { flights[i] = run_one(logs[i], config, calibration); });
  return flights;
}

int run(int argc, char** argv) {
  CLI::App app{
      "Runs the configured detectors over recorded flights, on message time, and scores them against the "
      "truth "
      "in the logs.",
      "airworthy eval"};
  std::vector<std::string> logs;
  std::string config_path;
  std::vector<std::string> overrides;
  std::string calibration_path;
  std::string flight_name_pattern;
  bool nested = false;
  bool json = false;
  calibrate::LearningParams learning;
  learning.jobs = std::max(1U, std::thread::hardware_concurrency());
  app.add_option("LOG", logs, "LCM logs, for example from 'airworthy import'")->required();
  app.add_option("--config", config_path, "configuration of airworthy-response")->required();
  app.add_option("--set", overrides, "override of a key, as KEY=VALUE; repeatable")->allow_extra_args(false);
  auto* calibration_option =
      app.add_option("--calibration", calibration_path, "start warm from this file of 'airworthy calibrate'");
  auto* nested_flag = app.add_flag(
      "--nested", nested, "start each flight warm from a calibration that all the other flights taught");
  nested_flag->excludes(calibration_option);
  app.add_option(
         "--flight-name", flight_name_pattern,
         "--nested: regular expression whose first group, in a log's name, says which flight it is a part of")
      ->needs(nested_flag);
  app.add_option("--false-alarms-per-hour", learning.false_alarms_per_hour,
                 "--nested: of each channel; default 0.01")
      ->check(CLI::Range(1e-6, 10.0))
      ->needs(nested_flag);
  app.add_flag("--json", json, "print JSON instead of a table");
  app.add_option("--jobs", learning.jobs, "flights evaluated at a time")->check(CLI::Range(1U, 256U));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? EX_OK : EX_USAGE;
  }
  const auto flight_name = calibrate::FlightName::parse(flight_name_pattern);
  if (!flight_name) return rt::fail(EX_USAGE, flight_name.error());
  const bool own_calibration = nested || !calibration_path.empty();
  auto config = own_calibration ? response::ResponseConfig::load_cold(config_path, overrides)
                                : response::ResponseConfig::load(config_path, overrides);
  if (!config) return rt::fail(EX_CONFIG, config.error());
  std::optional<response::Calibration> calibration;
  if (!calibration_path.empty()) {
    auto loaded = response::load_calibration(calibration_path);
    if (!loaded) return rt::fail(EX_CONFIG, loaded.error());
    auto monitor = response::with_calibration(config->monitor, config->channel_names(), *loaded);
    if (!monitor) return rt::fail(EX_CONFIG, rt::Error{calibration_path + ": " + monitor.error().text});
    config->monitor = *monitor;
    calibration = std::move(*loaded);
  }

  eval::Evaluation evaluation;
  int failures = 0;
  for (auto& flight : nested ? eval::run_nested(logs, *config, *flight_name, learning)
                             : run_all(logs, *config, calibration, learning.jobs)) {
    if (!flight) {
      failures = rt::fail(EX_DATAERR, flight.error());
      continue;
    }
    evaluation.scores.push_back(eval::score(*flight, {}));
    evaluation.tolerant_scores.push_back(eval::score(*flight, {.onset_tolerance = Duration{500'000}}));
    evaluation.flights.push_back(std::move(*flight));
  }
  fmt::print("{}", json ? eval::to_json(evaluation) : eval::to_table(evaluation));
  return failures;
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
