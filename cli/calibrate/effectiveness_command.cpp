#include "cli/calibrate/effectiveness_command.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <string>
#include <thread>
#include <vector>

#include "cli/calibrate/effectiveness_learning.h"
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
  bool keeps_unexcited = false;
  unsigned jobs = 1;
};

void print_summary(const effectiveness::Calibration& calibration) {
  fmt::print("{} flights, {:.0f} s of free flight; ", calibration.flights, calibration.used_s);
  if (calibration.speeds_are_commanded) {
    fmt::print("no reported speeds: by commands");
  } else {
    fmt::print("telemetry {:.0f} ms late", 1e3 * calibration.telemetry_latency_s);
  }
  if (calibration.motor_time_constant_s > 0.0) {
    fmt::print("; motors: lag {:.1f} ms after {:.0f} ms", 1e3 * calibration.motor_time_constant_s,
               1e3 * calibration.command_latency_s);
  }
  fmt::print("\n");
  constexpr std::array kAxisNames{"roll", "pitch", "vertical"};
  for (std::size_t i = 0; i < kAxisNames.size(); ++i) {
    const auto& axis = calibration.axis[i];
    if (!axis.is_excited) {
      fmt::print("  {:<9} gain of the vehicle file: not excited, rotors explain {:.0f} %\n", kAxisNames[i],
                 100.0 * axis.explained);
      continue;
    }
    fmt::print("  {:<9} gain {:.3f}, 95 % within {:.3f} to {:.3f}; rotors explain {:.0f} %\n", kAxisNames[i],
               axis.gain, axis.gain - 1.96 * axis.gain_sigma, axis.gain + 1.96 * axis.gain_sigma,
               100.0 * axis.explained);
  }
  fmt::print(
      "noise {:.3g} rad/s, {:.3g} m/s^2; smallest loss seen within a second of hover: {:.0f} % of a rotor\n",
      calibration.gyro_noise_rad_s, calibration.accel_noise_m_s2, 100.0 * calibration.smallest_loss_ratio);
}

}  // namespace

int calibrate_effectiveness(int argc, char** argv) {
  CLI::App app{
      "Learns from healthy flights how a vehicle answers to its rotors, and writes it to a file for "
      "airworthy-effectiveness (key `calibration`).",
      "airworthy calibrate effectiveness"};
  app.set_version_flag("--version", "airworthy-calibrate " AIRWORTHY_VERSION);
  Options options;
  options.jobs = std::max(1U, std::thread::hardware_concurrency());
  app.add_option(
         "LOG", options.logs,
         "LCM logs of healthy flights; of a flight with a GROUND_TRUTH fault the part before it is used")
      ->required();
  app.add_option("--config", options.config_path, "configuration of airworthy-effectiveness")->required();
  app.add_option("--set", options.overrides, "override of a key, as KEY=VALUE; repeatable")
      ->allow_extra_args(false);
  app.add_option("-o,--output", options.output, "calibration file to write")->required();
  app.add_flag("--keep-unexcited", options.keeps_unexcited,
               "an axis that the flights did not excite keeps the effectiveness of the vehicle file");
  app.add_option("--jobs", options.jobs, "flights read at a time")->check(rt::is_whole_number(1, 256));
  if (const auto ended = rt::parse_command_line(app, argc, argv)) return *ended;
  // Learning starts from nothing, whatever the configuration names.
  const auto config =
      effectiveness::EffectivenessConfig::load_uncalibrated(options.config_path, options.overrides);
  if (!config) return rt::fail(EX_CONFIG, config.error());
  if (const auto checked = rt::check_output_path(options.output); !checked) {
    return rt::fail(EX_CANTCREAT, checked.error());
  }
  const auto flights = read_effectiveness_recordings(options.logs, *config, options.jobs);
  if (!flights) return rt::fail(EX_DATAERR, flights.error());
  const auto learned = learn_effectiveness(*flights, *config, options.keeps_unexcited);
  if (!learned) return rt::fail(EX_DATAERR, learned.error());
  if (const auto written = rt::write_file(options.output, effectiveness::to_toml(*learned)); !written) {
    return rt::fail(EX_CANTCREAT, written.error());
  }
  print_summary(*learned);
  return EX_OK;
}

}  // namespace airworthy::calibrate
