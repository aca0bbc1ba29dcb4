#include <fmt/format.h>
#include <signal.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/sim/flight.h"
#include "cli/sim/live.h"
#include "cli/sim/record.h"
#include "runtime/process/command_line.h"
#include "runtime/process/exit.h"

namespace {

using namespace airworthy;

struct Options {
  std::string vehicle_path;
  std::string scenario_path;
  std::vector<std::string> overrides;
  sim::Level level = sim::Level::kHard;
  bool rotors_alike = false;
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> vehicle_seed;
  double duration_s = 0.0;
  double imu_average_ms = 0.0;
  std::string log;
  std::string live;
  double speed = 1.0;
  bool json = false;
};

volatile sig_atomic_t stop_requested = 0;

void request_stop(int) { stop_requested = 1; }

/// A fault that the flight never reaches is told in the log's truth all the same: better ask.
void warn_of_late_faults(const sim_command::Flight& flight) {
  for (const sim::Fault& fault : flight.scenario.faults) {
    if (fault.onset_s < flight.duration_s) continue;
    fmt::print(stderr,
               "airworthy-sim: warning: {} of {} at {:g} s never happens: the flight ends at {:g} s\n",
               sim::word_of(fault.kind), fault.component(), fault.onset_s, flight.duration_s);
  }
}

/// One line on stderr, where that is a terminal.
sim_command::Progress progress_bar(double duration_s) {
  using Clock = std::chrono::steady_clock;
  return [duration_s, is_terminal = isatty(STDERR_FILENO) == 1, start = Clock::now(),
          next = Clock::now()](double time_s) mutable {
    if (stop_requested != 0) return false;
    if (!is_terminal || Clock::now() < next) return true;
    next = Clock::now() + std::chrono::milliseconds{200};
    const std::chrono::duration<double> elapsed = Clock::now() - start;
    constexpr int kWidth = 40;
    const int done = static_cast<int>(kWidth * time_s / duration_s);
    fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {:.0f} of {:.0f} s, {:.0f} times real time ", "", done, "",
               kWidth - done, time_s, duration_s, time_s / std::max(elapsed.count(), 1e-3));
    return true;
  };
}

rt::Expected<sim_command::Flight> read_flight(const Options& options) {
  auto vehicle = rt::VehicleFile::load(options.vehicle_path);
  if (vehicle && !vehicle->multirotor) {
    vehicle = rt::fail_with(options.vehicle_path + ": has no table [multirotor]: nothing to simulate");
  }
  // Without a vehicle any rotor may be in a scenario: its other errors are told all the same.
  const std::size_t rotors = vehicle ? vehicle->multirotor->rotor_count : kMaxRotors;
  auto scenario = sim::Scenario::load(options.scenario_path, rotors, options.overrides);
  if (!vehicle && !scenario) return rt::fail_with(vehicle.error().text + "\n" + scenario.error().text);
  if (!vehicle) return tl::unexpected<rt::Error>{vehicle.error()};
  if (!scenario) return tl::unexpected<rt::Error>{scenario.error()};
  sim_command::Flight flight{std::move(*vehicle),
                             std::move(*scenario),
                             sim::Realism::at(options.level),
                             {options.vehicle_seed.value_or(options.seed), options.seed},
                             options.duration_s};
  if (options.rotors_alike) flight.realism = flight.realism.with_rotors_alike();
  if (flight.duration_s <= 0.0) flight.duration_s = flight.scenario.duration_s();
  if (options.imu_average_ms > 0.0) {
    flight.realism.imu.averaging_window_s = options.imu_average_ms * 1e-3;
    flight.realism.imu.rate_Hz = 1e3 / options.imu_average_ms;
  }
  return flight;
}

int run_live(const Options& options, const sim_command::Flight& flight) {
  const auto flown =
      sim_command::fly_live(flight, options.live, options.speed, progress_bar(flight.duration_s));
  if (!flown) return rt::fail(EX_UNAVAILABLE, flown.error());
  if (options.json) {
    const nlohmann::json summary{{"start_boottime_us", flown->start_boottime_us},
                                 {"flown_s", flown->flown_s},
                                 {"frames_not_read", flown->writes_dropped},
                                 {"most_behind_s", flown->most_behind_s}};
    fmt::print("{}\n", summary.dump());
    return EX_OK;
  }
  fmt::print("flown {:.1f} s, {} frames not read, at most {:.0f} ms behind the clock\n", flown->flown_s,
             flown->writes_dropped, flown->most_behind_s * 1e3);
  return EX_OK;
}

int run_recorded(const Options& options, const sim_command::Flight& flight) {
  const auto start = std::chrono::steady_clock::now();
  const auto recording = sim_command::record(flight, options.log, progress_bar(flight.duration_s));
  if (isatty(STDERR_FILENO) == 1) fmt::print(stderr, "\r\x1b[K");
  if (!recording) return rt::fail(EX_CANTCREAT, recording.error());
  if (recording->stopped) return rt::fail(EX_TEMPFAIL, rt::Error{"stopped, no log written"});
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  const auto bytes = static_cast<double>(std::filesystem::file_size(options.log));
  if (options.json) {
    const nlohmann::json summary{
        {"log", options.log}, {"vehicle", flight.vehicle.name}, {"duration_s", flight.duration_s},
        {"bytes", bytes},     {"elapsed_s", elapsed.count()},   {"messages", recording->messages}};
    fmt::print("{}\n", summary.dump());
    return EX_OK;
  }
  fmt::print("{}: {:.1f} s, {:.1f} MB ({:.2f} MB per minute), {:.0f} times real time\n", options.log,
             flight.duration_s, bytes * 1e-6, bytes * 1e-6 * 60.0 / flight.duration_s,
             flight.duration_s / elapsed.count());
  for (const auto& [channel, count] : recording->messages) fmt::print("  {:<28} {:>9}\n", channel, count);
  return EX_OK;
}

int run(int argc, char** argv) {
  CLI::App app{"Flies a simulated multirotor, healthy or with faults, into a log or live on a serial line.",
               "airworthy sim"};
  app.set_version_flag("--version", "airworthy-sim " AIRWORTHY_VERSION);
  Options options;
  app.add_option("--vehicle", options.vehicle_path, "vehicle file with a table [multirotor]")->required();
  app.add_option("--scenario", options.scenario_path, "flight plan and faults, see config/scenarios")
      ->required();
  app.add_option("--set", options.overrides, "override of a key of the scenario, as KEY=VALUE; repeatable")
      ->allow_extra_args(false);
  rt::add_words<sim::Level>(
      app, "--level", options.level,
      {{"nominal", sim::Level::kNominal}, {"hard", sim::Level::kHard}, {"brutal", sim::Level::kBrutal}},
      "realism; default hard");
  app.add_flag(
      "--rotors-alike", options.rotors_alike,
      "no wind, no difference between motors or propellers but their unbalance, thrust axes upright, mass in "
      "the middle, gyro without bias or drift, an estimate without noise: in a hover all rotors turn at one "
      "speed");
  app.add_option("--seed", options.seed, "of all random numbers; default 1")->check(rt::is_whole_number(0));
  app.add_option(
         "--vehicle-seed", options.vehicle_seed,
         "of what makes this vehicle differ from its file, to fly the same one again; default: --seed")
      ->check(rt::is_whole_number(0));
  app.add_option("--duration", options.duration_s, "seconds; default: the flight plan's")
      ->check(rt::is_number(rt::Range{0.01, 1e6}));
  app.add_option("--imu-average", options.imu_average_ms,
                 "inertial samples are averages over so many ms instead of raw ones; 5 = as PX4 streams them")
      ->check(rt::is_number(rt::Range{0.5, 100.0}));
  auto* log = app.add_option("-o,--output", options.log, "LCM log to write, as fast as the computer can");
  auto* live =
      app.add_option("--live", options.live,
                     "fly at the pace of the clock and speak MAVLink on a pseudo-terminal, to which this "
                     "path becomes a symbolic link");
  live->excludes(log);
  app.add_flag("--json", options.json, "print the summary as one line of JSON");
  app.add_option("--speed", options.speed, "--live: times the pace of the clock")
      ->needs(live)
      ->check(rt::is_number(rt::Range{0.01, 100.0}));
  if (const auto ended = rt::parse_command_line(app, argc, argv)) return *ended;
  if (options.log.empty() && options.live.empty()) {
    return rt::wrong_usage("--output LOG or --live LINK is needed");
  }
  const auto flight = read_flight(options);
  if (!flight) return rt::fail(EX_CONFIG, flight.error());
  warn_of_late_faults(*flight);
  signal(SIGINT, request_stop);
  signal(SIGTERM, request_stop);
  return options.live.empty() ? run_recorded(options, *flight) : run_live(options, *flight);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {  // memory ran out
    std::fprintf(stderr, "airworthy-sim: %s\n", error.what());
    return EX_OSERR;
  }
}
