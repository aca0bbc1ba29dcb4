#include "services/unbalance/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace airworthy::unbalance {
namespace {

using rt::ConfigTable;
using rt::Count;
using rt::Range;

constexpr Range kAmplitude{0.0, 1e4};

}  // namespace

rt::Expected<Calibration> load_calibration(const std::string& path) {
  auto file = rt::ConfigFile::load(path);
  ConfigTable root = file.root();
  Calibration calibration;
  calibration.vehicle = root.required<std::string>("vehicle");
  calibration.flights = root.optional<int>("flights", 0);
  calibration.judged_s = root.optional<double>("judged_s", 0.0);
  calibration.accel_low_pass_Hz = root.required<double>("accel_low_pass_Hz", Range{0.0, 1e5});
  calibration.speed_latency_s = root.required<double>("speed_latency_s", Range{0.0, 1.0});
  calibration.speed_noise_ratio = root.required<double>("speed_noise_ratio", Range{0.0, 0.5});
  calibration.motor_time_constant_s = root.optional<double>("motor_time_constant_s", 0.0, Range{0.0, 1.0});
  calibration.response = root.required<double>("response", Range{1e-3, 1e3});
  calibration.has_trial_mass = root.required<bool>("response_measured");
  calibration.against_ratio = root.required<double>("against_ratio", Range{0.0, 1.0});
  for (ConfigTable rotor : root.tables("rotor", {.count = Count{3, kMaxRotors}})) {
    calibration.rotors.push_back({rotor.required<double>("baseline_m_s2", kAmplitude),
                                  rotor.required<double>("baseline_sigma_m_s2", kAmplitude),
                                  rotor.optional<double>("power_m2_s4", 0.0, Range{-1e8, 1e8}),
                                  rotor.optional<double>("speed_error_ratio", 0.0, Range{-0.1, 0.1}),
                                  rotor.optional<double>("response_sigma_ratio", 0.25, Range{0.0, 10.0})});
  }
  calibration.hash = file.hash();
  return file.finish(std::move(calibration));
}

rt::Expected<UnbalanceParams> with_calibration(UnbalanceParams params, const Calibration& calibration) {
  if (calibration.rotors.size() != params.vehicle.rotor_count) {
    return rt::fail_with(fmt::format("is for {} rotors, the vehicle has {}. Calibrate again.",
                                     calibration.rotors.size(), params.vehicle.rotor_count));
  }
  if (std::abs(calibration.accel_low_pass_Hz - params.low_pass_Hz) > 1e-6) {
    return rt::fail_with(
        fmt::format("was learned with input.accel_low_pass_Hz = {:g}, which is now {:g}. Calibrate again.",
                    calibration.accel_low_pass_Hz, params.low_pass_Hz));
  }
  params.has_baseline = true;
  params.most_speed_error_ratio = kCalibratedSpeedError;
  params.speed_latency_s = calibration.speed_latency_s;
  params.speed_noise_ratio = calibration.speed_noise_ratio;
  params.against_ratio = calibration.against_ratio;
  if (calibration.motor_time_constant_s > 0.0)
    params.vehicle.motor_time_constant_s = calibration.motor_time_constant_s;
  // Thresholds were turned into accelerations with the response assumed before.
  const double ratio = calibration.response / params.response;
  if (params.thresholds_are_masses) {
    params.smallest_m_s2 *= ratio;
    params.caution_m_s2 *= ratio;
    params.usual_m_s2 *= ratio;
  }
  params.response = calibration.response;
  for (std::size_t i = 0; i < calibration.rotors.size(); ++i) {
    params.baseline_m_s2[i] = calibration.rotors[i].baseline_m_s2;
    params.baseline_sigma_m_s2[i] = calibration.rotors[i].baseline_sigma_m_s2;
    params.speed_error_ratio[i] = calibration.rotors[i].speed_error_ratio;
    params.response_sigma_ratio[i] = calibration.rotors[i].response_sigma_ratio;
    params.baseline_power_m2_s4[i] = calibration.rotors[i].power_m2_s4;
  }
  return params;
}

std::string to_toml(const Calibration& calibration) {
  std::string text = fmt::format(
      "# How well the propellers of this vehicle are balanced, learned from healthy flights. Written by\n"
      "# `airworthy calibrate unbalance`; learn it again after a propeller, a motor or the place of the "
      "inertial\n"
      "# unit has changed.\n\n"
      "vehicle = \"{}\"\n"
      "flights = {}\n"
      "judged_s = {:.1f}\n"
      "accel_low_pass_Hz = {:.6g}\n"
      "speed_latency_s = {:.6g}            # of the telemetry of the rotor speeds\n"
      "speed_noise_ratio = {:.6g}          # of one report\n"
      "motor_time_constant_s = {:.6g}     # command to speed; 0 = not learned\n"
      "response = {:.6g}                   # acceleration felt / that of a rigid body, mean of x and y\n"
      "response_measured = {}          # by a flight with a trial mass; false: as the vehicle file assumes\n"
      "against_ratio = {:.6g}              # part of the vibration that turns against the rotor\n",
      calibration.vehicle, calibration.flights, calibration.judged_s, calibration.accel_low_pass_Hz,
      calibration.speed_latency_s, calibration.speed_noise_ratio, calibration.motor_time_constant_s,
      calibration.response, calibration.has_trial_mass, calibration.against_ratio);
  for (std::size_t i = 0; i < calibration.rotors.size(); ++i) {
    const Calibration::Rotor& rotor = calibration.rotors[i];
    text += fmt::format(
        "\n[[rotor]]  # {}\n"
        "baseline_m_s2 = {:.6g}        # amplitude at hover speed\n"
        "baseline_sigma_m_s2 = {:.6g}  # of a single judgement around it\n"
        "power_m2_s4 = {:.6g}          # square of the amplitude by the power of the vibration; 0 = not "
        "learned\n"
        "speed_error_ratio = {:.6g}    # true over reported speed, less 1\n"
        "response_sigma_ratio = {:.6g} # 1 sigma of what a mass on this rotor makes, of itself\n",
        i + 1, rotor.baseline_m_s2, rotor.baseline_sigma_m_s2, rotor.power_m2_s4, rotor.speed_error_ratio,
        rotor.response_sigma_ratio);
  }
  return text;
}

}  // namespace airworthy::unbalance
