#pragma once

#include <string>
#include <vector>

#include "core/detectors/unbalance/unbalance_monitor.h"
#include "runtime/config/config_file.h"

namespace airworthy::unbalance {

/// How far a clock may drift from what a calibration found, temperature included.
inline constexpr double kCalibratedSpeedError = 0.002;

/// What healthy flights say about the balance of a vehicle's propellers: the content of a calibration file.
/// `airworthy calibrate unbalance` writes it, airworthy-unbalance reads it.
struct Calibration {
  struct Rotor {
    double baseline_m_s2 = 0.0;          ///< amplitude at hover speed, mean over the flights
    double baseline_sigma_m_s2 = 0.0;    ///< of a single judgement around it, between flights included
    double power_m2_s4 = 0.0;            ///< UnbalancePowers, mean over the flights; 0 = not learned
    double speed_error_ratio = 0.0;      ///< true over reported speed, less 1
    double response_sigma_ratio = 0.25;  ///< 1σ of what a mass on this rotor makes, of itself
  };

  std::string vehicle;
  std::string hash;  ///< of the file it was read from
  int flights = 0;
  double judged_s = 0.0;
  double accel_low_pass_Hz = 0.0;  ///< that amplitudes were corrected for
  double speed_latency_s = 0.0;
  double speed_noise_ratio = 0.0;
  double motor_time_constant_s = 0.0;  ///< 0 = not learned
  double response =
      1.0;  ///< acceleration felt / that of a rigid body; by a trial mass, else of the vehicle file
  bool has_trial_mass = false;  ///< whether `response` was measured
  double against_ratio = 0.3;
  std::vector<Rotor> rotors;
};

/// Reads a calibration file; every error of it at once.
[[nodiscard]] rt::Expected<Calibration> load_calibration(const std::string& path);

/// Why the calibration does not fit what is configured, if it does not.
[[nodiscard]] rt::Expected<UnbalanceParams> with_calibration(UnbalanceParams params,
                                                             const Calibration& calibration);

[[nodiscard]] std::string to_toml(const Calibration& calibration);

}  // namespace airworthy::unbalance
