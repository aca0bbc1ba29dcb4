#pragma once

#include <filesystem>
#include <string_view>

#include "runtime/error.h"

namespace airworthy::sim {

enum class Level { kNominal, kHard, kBrutal };

/// How far the simulated vehicle is from an ideal one; sim/realism.toml explains every number and its source.
/// "sigma" is drawn once a flight unless said otherwise.
struct Realism {
  static constexpr double kPhysicsRate_Hz = 4000.0;  ///< of the integration; every rate is at most this

  struct Imu {
    double rate_Hz;
    double averaging_window_s;  ///< 0 = raw samples
    double filter_cutoff_Hz;
    double accel_noise_m_s2_per_sqrt_Hz;
    double accel_vibration_m_s2_per_sqrt_Hz;
    double gyro_noise_rad_s_per_sqrt_Hz;
    double gyro_vibration_rad_s_per_sqrt_Hz;
    double accel_bias_m_s2;
    double gyro_bias_rad_s;
    double accel_drift_m_s2;
    double gyro_drift_rad_s;
    double accel_resolution_m_s2;
    double gyro_resolution_rad_s;
    double accel_range_m_s2;
    double gyro_range_rad_s;
    double latency_s;
    double dropout_ratio;
  } imu;
  struct Esc {
    double rate_Hz;
    double latency_s;
    double jitter_s;
    double dropout_ratio;
    double noise_ratio;
    double resolution_rpm;
  } esc;
  struct Motor {
    double speed_error_ratio;
    double speed_error_time_s;
    double time_constant_error_ratio;
    double sag_ratio_per_min;
    double command_latency_s;
  } motor;
  struct Rotor {
    double natural_unbalance_m_s2;
    double blade_pass_ratio;
    double thrust_error_ratio;
  } rotor;
  struct Airframe {
    double mass_error_ratio;
    double inertia_error_ratio;
    double thrust_error_ratio;
    double aerodynamics_error_ratio;
    double centre_of_mass_m_per_m;
    double thrust_axis_error_rad;
    double vibration_response_error_ratio;
  } airframe;
  struct Wind {
    double mean_m_s;
  } wind;
  struct Autopilot {
    double attitude_noise_rad;
    double position_noise_m;
    double velocity_noise_m_s;
    double attitude_rate_Hz;
    double command_rate_Hz;
    double state_rate_Hz;
    double landed_state_delay_s;
    double dropout_ratio;
  } autopilot;

  /// Every parameter must have all three levels and a source.
  [[nodiscard]] static rt::Expected<Realism> read(std::string_view text, const std::filesystem::path& name,
                                                  Level level);
  /// The table of this program.
  [[nodiscard]] static Realism at(Level level);
  /// The same, with nothing that makes one rotor turn faster than another in a hover: motors and propellers alike, no wind,
  /// the centre of mass in the middle, an estimate without errors. Noise of the sensors, telemetry, mass, response of the
  /// airframe and unbalance of the propellers stay.
  [[nodiscard]] Realism with_rotors_alike() const;
};

/// The text of sim/realism.toml.
extern const std::string_view kRealismTable;

}  // namespace airworthy::sim
