#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/detectors/effectiveness/effectiveness_monitor.h"
#include "runtime/config/config_file.h"

namespace airworthy::effectiveness {

/// What healthy flights say about how a vehicle answers to its rotors: the content of a calibration file.
/// `airworthy calibrate effectiveness` writes it, airworthy-effectiveness reads it.
struct Calibration {
  struct Axis {
    double gain = 1.0;        ///< learned over described effectiveness
    double gain_sigma = 0.0;  ///< standard error over parts of the flights
    double explained = 0.0;   ///< R² of the changes within an interval
    bool is_excited = true;   ///< false: the flights did not tell the gain, it is the vehicle file's
  };

  std::string vehicle;
  std::string vehicle_hash;  ///< of the content of the vehicle file it was learned with
  std::string hash;          ///< of the file it was read from
  int flights = 0;
  double used_s = 0.0;
  std::array<Axis, 3> axis;            ///< roll, pitch, vertical
  bool speeds_are_commanded = false;   ///< no flight had reports: learned from commands alone
  double motor_time_constant_s = 0.0;  ///< 0 = no commands were logged
  double command_latency_s = 0.0;
  double telemetry_latency_s = 0.0;
  double gyro_noise_rad_s = 0.0;
  double accel_noise_m_s2 = 0.0;
  double smallest_loss_ratio = 0.0;  ///< of a rotor, found within a second
};

/// Reads a calibration file; every error of it at once.
[[nodiscard]] rt::Expected<Calibration> load_calibration(const std::string& path);

/// The rotors count as numbered as described where both roll and pitch were excited.
[[nodiscard]] EffectivenessParams with_calibration(EffectivenessParams params,
                                                   const Calibration& calibration);

[[nodiscard]] std::string to_toml(const Calibration& calibration);

}  // namespace airworthy::effectiveness
