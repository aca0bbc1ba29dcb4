#include "cli/calibrate/response_command.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "cli/calibrate/flight_name.h"
#include "cli/calibrate/learning.h"
#include "cli/calibrate/suggest_pairs.h"
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
  std::string vehicle;
  std::string flight_name;
  bool suggest_pairs = false;
  bool json = false;
  calibrate::LearningParams learning;
};

// Every flight, or every error, one a line.
rt::Expected<std::vector<calibrate::HealthyFlight>> read_flights(const Options& options,
                                                                 const response::ResponseConfig& config,
                                                                 const calibrate::FlightName& flight_name) {
  std::vector<rt::Expected<calibrate::HealthyFlight>> read(options.logs.size());
  calibrate::for_each_parallel(options.logs.size(), options.learning.jobs, [&](std::size_t i) {
    read[i] = calibrate::read_healthy_flight(options.logs[i], config);
  });
  std::vector<calibrate::HealthyFlight> flights;
  std::string errors;
  for (auto& one : read) {
    if (one && one->vehicle != options.vehicle) {
      one = rt::fail_with(
          fmt::format("{}: of vehicle \"{}\", not of \"{}\"", one->log_path, one->vehicle, options.vehicle));
    }
    if (!one) {
      errors += (errors.empty() ? "" : "\n") + one.error().text;
      continue;
    }
    one->group = flight_name.of(one->name);
    flights.push_back(std::move(*one));
  }
  if (!errors.empty()) return rt::fail_with(errors);
  return flights;
}

void print_summary(const calibrate::Learned& learned, const std::vector<std::string>& channel_names) {
  for (const auto& configuration : learned.calibration.configurations) {
    fmt::print("{} airspeed sensor: {} flights, {:.1f} min\n",
               configuration.airspeed_sensor ? "with" : "without", configuration.flights,
               configuration.flown_s / 60);
    fmt::print("  {:<16} {:>8} {:>12} {:>14} {:>10}\n", "channel", "samples", "sigma", "flight spread",
               "threshold");
    for (const auto& channel : configuration.channels) {
      fmt::print("  {:<16} {:>8} {:>12.4g} {:>14.4g} {:>10.2f}\n", channel.name, channel.samples,
                 channel.prior.sigma, channel.flight_spread, channel.prior.threshold);
    }
  }
  for (std::size_t i = 0; i < channel_names.size(); ++i) {
    const calibrate::Tail& tail = learned.tails[i];
    if (tail.blocks == 0) continue;
    fmt::print(
        "{}: statistic of healthy flights left out in turn: {:.2f} in 80 % of {} blocks of {:g} s, tail "
        "{:.2f}\n",
        channel_names[i], tail.start, tail.blocks, calibrate::Tail::kBlock_s, tail.scale);
  }
  for (const std::string& note : learned.notes) fmt::print("note: {}\n", note);
}

int suggest(const Options& options, const response::ResponseConfig& config) {
  std::vector<calibrate::SignalRecord> records;
  int failures = EX_OK;
  for (const std::string& log : options.logs) {
    auto record = calibrate::read_signals(log, config);
    if (record) {
      records.push_back(std::move(*record));
    } else {
      failures = rt::fail(EX_DATAERR, record.error());
    }
  }
  if (failures != EX_OK) return failures;
  const auto suggestions = calibrate::suggest_pairs(records);
  const double tick_s = to_seconds(config.monitor.tick_period);
  fmt::print("{}", options.json ? to_json(suggestions, tick_s) : to_table(suggestions, tick_s));
  return EX_OK;
}

}  // namespace

int calibrate_response(int argc, char** argv) {
  CLI::App app{
      "Learns from healthy flights of a vehicle what its responses are, how much they vary and how far its "
      "detectors may trust that, and writes it to a file for airworthy-response (key `calibration`).",
      "airworthy calibrate"};
  app.set_version_flag("--version", "airworthy-calibrate " AIRWORTHY_VERSION);
  app.footer(
      "This is `airworthy calibrate response`. For the other detectors there are\n"
      "  airworthy calibrate unbalance       how well the propellers are balanced\n"
      "  airworthy calibrate effectiveness   how the vehicle answers to its rotors\n"
      "each with a --help of its own.");
  Options options;
  options.learning.jobs = std::max(1U, std::thread::hardware_concurrency());
  app.add_option(
         "LOG", options.logs,
         "LCM logs of healthy flights; of a flight with a GROUND_TRUTH fault the part before it is used")
      ->required();
  app.add_option("--config", options.config_path, "configuration of airworthy-response")->required();
  app.add_option("--set", options.overrides, "override of a key, as KEY=VALUE; repeatable")
      ->allow_extra_args(false);
  auto* output = app.add_option("-o,--output", options.output, "calibration file to write");
  auto* suggestion =
      app.add_flag("--suggest-pairs", options.suggest_pairs,
                   "write no file; rank which measured signals follow which commanded ones in the logs, "
                   "for channels of your own");
  suggestion->excludes(output);
  app.add_flag("--json", options.json, "--suggest-pairs: print JSON instead of a table")->needs(suggestion);
  app.add_option("--vehicle", options.vehicle, "vehicle whose logs these are; default: the configured one");
  app.add_option(
      "--flight-name", options.flight_name,
      "regular expression whose first group, in a log's name, says which flight it is a part of; default: "
      "every log is a flight of its own");
  app.add_option("--false-alarms-per-hour", options.learning.false_alarms_per_hour,
                 "of each channel; default 0.01")
      ->check(rt::is_number(rt::Range{1e-6, 10.0}));
  app.add_option("--jobs", options.learning.jobs, "flights read at a time")
      ->check(rt::is_whole_number(1, 256));
  if (const auto ended = rt::parse_command_line(app, argc, argv)) return *ended;
  if (!options.suggest_pairs && options.output.empty()) {
    return rt::wrong_usage("--output FILE or --suggest-pairs is needed");
  }
  const auto flight_name = calibrate::FlightName::parse(options.flight_name);
  if (!flight_name) return rt::fail(EX_USAGE, flight_name.error());
  // Learning starts from nothing, whatever the configuration names.
  const auto config = response::ResponseConfig::load_cold(options.config_path, options.overrides);
  if (!config) return rt::fail(EX_CONFIG, config.error());
  if (options.suggest_pairs) return suggest(options, *config);
  if (options.vehicle.empty()) options.vehicle = config->vehicle;
  if (const auto checked = rt::check_output_path(options.output); !checked) {
    return rt::fail(EX_CANTCREAT, checked.error());
  }
  const auto flights = read_flights(options, *config, *flight_name);
  if (!flights) return rt::fail(EX_DATAERR, flights.error());
  std::vector<const calibrate::HealthyFlight*> all;
  for (const auto& flight : *flights) all.push_back(&flight);
  const auto learned = calibrate::learn(all, *config, options.learning);
  if (!learned) return rt::fail(EX_DATAERR, learned.error());
  if (const auto written = rt::write_file(options.output, to_toml(learned->calibration)); !written) {
    return rt::fail(EX_CANTCREAT, written.error());
  }
  print_summary(*learned, config->channel_names());
  return EX_OK;
}

}  // namespace airworthy::calibrate
