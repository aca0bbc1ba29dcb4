#include "services/effectiveness/calibration.h"

#include <fmt/format.h>

#include <algorithm>

namespace airworthy::effectiveness {
namespace {

using rt::ConfigTable;
using rt::Range;

constexpr std::array kAxisNames{"roll", "pitch", "vertical"};
constexpr Range kGain{0.2, 5.0};

}  // namespace

rt::Expected<Calibration> load_calibration(const std::string& path) {
  auto file = rt::ConfigFile::load(path);
  ConfigTable root = file.root();
  Calibration calibration;
  calibration.vehicle = root.required<std::string>("vehicle");
  calibration.vehicle_hash = root.required<std::string>("vehicle_hash");
  calibration.flights = root.optional<int>("flights", 0);
  calibration.used_s = root.optional<double>("used_s", 0.0);
  calibration.speeds_are_commanded = root.optional<bool>("speeds_are_commanded", false);
  calibration.motor_time_constant_s = root.required<double>("motor_time_constant_s", Range{0.0, 1.0});
  calibration.command_latency_s = root.required<double>("command_latency_s", Range{0.0, 0.2});
  calibration.telemetry_latency_s = root.required<double>("telemetry_latency_s", Range{0.0, 0.2});
  calibration.gyro_noise_rad_s = root.required<double>("gyro_noise_rad_s", Range{1e-5, 10.0});
  calibration.accel_noise_m_s2 = root.required<double>("accel_noise_m_s2", Range{1e-4, 100.0});
  calibration.smallest_loss_ratio = root.optional<double>("smallest_loss_ratio", 0.0);
  for (std::size_t i = 0; i < kAxisNames.size(); ++i) {
    ConfigTable table = root.required_table(kAxisNames[i]);
    calibration.axis[i].gain = table.required<double>("gain", kGain);
    calibration.axis[i].gain_sigma = table.required<double>("gain_sigma", Range{0.0, 5.0});
    calibration.axis[i].explained = table.optional<double>("explained", 0.0);
    calibration.axis[i].is_excited = table.optional<bool>("excited", false);
  }
  calibration.hash = file.hash();
  return file.finish(std::move(calibration));
}

EffectivenessParams with_calibration(EffectivenessParams params, const Calibration& calibration) {
  constexpr std::array kRows{kRollRow, kPitchRow, kVerticalRow};
  for (std::size_t i = 0; i < kRows.size(); ++i) {
    for (double& one : params.effectiveness.per_speed2[kRows[i]]) one *= calibration.axis[i].gain;
  }
  if (calibration.motor_time_constant_s > 0.0)
    params.speeds.time_constant_s = calibration.motor_time_constant_s;
  params.speeds.command_latency = from_seconds(calibration.command_latency_s);
  params.speeds.telemetry_latency = from_seconds(calibration.telemetry_latency_s);
  params.noise.gyro_rad_s = calibration.gyro_noise_rad_s;
  params.noise.accel_m_s2 = calibration.accel_noise_m_s2;
  const bool shows_mapping = calibration.axis[0].is_excited && calibration.axis[1].is_excited;
  params.mapping_is_known = params.mapping_is_known || shows_mapping;
  return params;
}

std::string to_toml(const Calibration& calibration) {
  std::string text = fmt::format(
      "# How this vehicle answers to its rotors, learned from healthy flights. Written by\n"
      "# `airworthy calibrate effectiveness`; learn it again after propellers, motors or payload have "
      "changed.\n\n"
      "vehicle = \"{}\"\n"
      "vehicle_hash = \"{}\"   # of the vehicle file: what is learned is in relation to it\n"
      "flights = {}\n"
      "used_s = {:.1f}                  # of flight that was used\n"
      "speeds_are_commanded = {}        # true: no rotor reported its speed, all below follows from "
      "commands\n"
      "motor_time_constant_s = {:.4g}   # 0: no commands were logged, the vehicle file's counts\n"
      "command_latency_s = {:.4g}       # from the stamp of a command until the speed begins to follow\n"
      "telemetry_latency_s = {:.4g}     # from a speed until the stamp of its report\n"
      "gyro_noise_rad_s = {:.4g}        # of one sample against the model\n"
      "accel_noise_m_s2 = {:.4g}\n"
      "smallest_loss_ratio = {:.2g}     # of one rotor's thrust that is found within a second\n",
      calibration.vehicle, calibration.vehicle_hash, calibration.flights, calibration.used_s,
      calibration.speeds_are_commanded, calibration.motor_time_constant_s, calibration.command_latency_s,
      calibration.telemetry_latency_s, calibration.gyro_noise_rad_s, calibration.accel_noise_m_s2,
      calibration.smallest_loss_ratio);
  for (std::size_t i = 0; i < kAxisNames.size(); ++i) {
    const Calibration::Axis& axis = calibration.axis[i];
    text += fmt::format(
        "\n[{}]\n"
        "gain = {:.4g}          # learned over described effectiveness; 95 %: {:.4g} to {:.4g}\n"
        "gain_sigma = {:.4g}    # standard error\n"
        "explained = {:.3g}     # R² of the changes that the rotors explain\n"
        "excited = {}          # false: the gain is the vehicle file's, and this axis does not show the "
        "numbering\n",
        kAxisNames[i], axis.gain, axis.gain - 1.96 * axis.gain_sigma, axis.gain + 1.96 * axis.gain_sigma,
        axis.gain_sigma, axis.explained, axis.is_excited);
  }
  return text;
}

}  // namespace airworthy::effectiveness
