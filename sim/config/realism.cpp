#include "sim/config/realism.h"

#include <fmt/format.h>

#include <array>
#include <string_view>
#include <tuple>

#include "core/assert.h"
#include "runtime/config/config_file.h"

namespace airworthy::sim {
namespace {

/// One parameter, with all its levels checked, whichever is asked for.
double read_parameter(rt::ConfigTable table, std::string_view key, Level level) {
  rt::ConfigTable parameter = table.required_table(key);
  constexpr rt::Range kNotNegative{0.0, 1e6};
  const std::array values{parameter.required<double>("nominal", kNotNegative),
                          parameter.required<double>("hard", kNotNegative),
                          parameter.required<double>("brutal", kNotNegative)};
  if (parameter.required<std::string>("source").empty()) {
    parameter.fail("source", "must say where the numbers come from");
  }
  return values[static_cast<std::size_t>(level)];
}

}  // namespace

rt::Expected<Realism> Realism::read(std::string_view text, const std::filesystem::path& name, Level level) {
  auto file = rt::ConfigFile::parse(text, name);
  rt::ConfigTable root = file.root();
  Realism realism{};
  {
    rt::ConfigTable imu = root.required_table("imu");
    realism.imu.rate_Hz = read_parameter(imu, "rate_Hz", level);
    realism.imu.averaging_window_s = read_parameter(imu, "averaging_window_s", level);
    realism.imu.filter_cutoff_Hz = read_parameter(imu, "filter_cutoff_Hz", level);
    realism.imu.accel_noise_m_s2_per_sqrt_Hz = read_parameter(imu, "accel_noise_m_s2_per_sqrt_Hz", level);
    realism.imu.accel_vibration_m_s2_per_sqrt_Hz =
        read_parameter(imu, "accel_vibration_m_s2_per_sqrt_Hz", level);
    realism.imu.gyro_noise_rad_s_per_sqrt_Hz = read_parameter(imu, "gyro_noise_rad_s_per_sqrt_Hz", level);
    realism.imu.gyro_vibration_rad_s_per_sqrt_Hz =
        read_parameter(imu, "gyro_vibration_rad_s_per_sqrt_Hz", level);
    realism.imu.accel_bias_m_s2 = read_parameter(imu, "accel_bias_m_s2", level);
    realism.imu.gyro_bias_rad_s = read_parameter(imu, "gyro_bias_rad_s", level);
    realism.imu.accel_drift_m_s2 = read_parameter(imu, "accel_drift_m_s2", level);
    realism.imu.gyro_drift_rad_s = read_parameter(imu, "gyro_drift_rad_s", level);
    realism.imu.accel_resolution_m_s2 = read_parameter(imu, "accel_resolution_m_s2", level);
    realism.imu.gyro_resolution_rad_s = read_parameter(imu, "gyro_resolution_rad_s", level);
    realism.imu.accel_range_m_s2 = read_parameter(imu, "accel_range_m_s2", level);
    realism.imu.gyro_range_rad_s = read_parameter(imu, "gyro_range_rad_s", level);
    realism.imu.latency_s = read_parameter(imu, "latency_s", level);
    realism.imu.dropout_ratio = read_parameter(imu, "dropout_ratio", level);
  }
  {
    rt::ConfigTable esc = root.required_table("esc");
    realism.esc.rate_Hz = read_parameter(esc, "rate_Hz", level);
    realism.esc.latency_s = read_parameter(esc, "latency_s", level);
    realism.esc.jitter_s = read_parameter(esc, "jitter_s", level);
    realism.esc.dropout_ratio = read_parameter(esc, "dropout_ratio", level);
    realism.esc.noise_ratio = read_parameter(esc, "noise_ratio", level);
    realism.esc.resolution_rpm = read_parameter(esc, "resolution_rpm", level);
  }
  {
    rt::ConfigTable motor = root.required_table("motor");
    realism.motor.speed_error_ratio = read_parameter(motor, "speed_error_ratio", level);
    realism.motor.speed_error_time_s = read_parameter(motor, "speed_error_time_s", level);
    realism.motor.time_constant_error_ratio = read_parameter(motor, "time_constant_error_ratio", level);
    realism.motor.sag_ratio_per_min = read_parameter(motor, "sag_ratio_per_min", level);
    realism.motor.command_latency_s = read_parameter(motor, "command_latency_s", level);
  }
  {
    rt::ConfigTable rotor = root.required_table("rotor");
    realism.rotor.natural_unbalance_m_s2 = read_parameter(rotor, "natural_unbalance_m_s2", level);
    realism.rotor.blade_pass_ratio = read_parameter(rotor, "blade_pass_ratio", level);
    realism.rotor.thrust_error_ratio = read_parameter(rotor, "thrust_error_ratio", level);
  }
  {
    rt::ConfigTable airframe = root.required_table("airframe");
    realism.airframe.mass_error_ratio = read_parameter(airframe, "mass_error_ratio", level);
    realism.airframe.inertia_error_ratio = read_parameter(airframe, "inertia_error_ratio", level);
    realism.airframe.thrust_error_ratio = read_parameter(airframe, "thrust_error_ratio", level);
    realism.airframe.aerodynamics_error_ratio = read_parameter(airframe, "aerodynamics_error_ratio", level);
    realism.airframe.centre_of_mass_m_per_m = read_parameter(airframe, "centre_of_mass_m_per_m", level);
    realism.airframe.thrust_axis_error_rad = read_parameter(airframe, "thrust_axis_error_rad", level);
    realism.airframe.vibration_response_error_ratio =
        read_parameter(airframe, "vibration_response_error_ratio", level);
  }
  {
    rt::ConfigTable wind = root.required_table("wind");
    realism.wind.mean_m_s = read_parameter(wind, "mean_m_s", level);
  }
  {
    rt::ConfigTable autopilot = root.required_table("autopilot");
    realism.autopilot.attitude_noise_rad = read_parameter(autopilot, "attitude_noise_rad", level);
    realism.autopilot.position_noise_m = read_parameter(autopilot, "position_noise_m", level);
    realism.autopilot.velocity_noise_m_s = read_parameter(autopilot, "velocity_noise_m_s", level);
    realism.autopilot.attitude_rate_Hz = read_parameter(autopilot, "attitude_rate_Hz", level);
    realism.autopilot.command_rate_Hz = read_parameter(autopilot, "command_rate_Hz", level);
    realism.autopilot.state_rate_Hz = read_parameter(autopilot, "state_rate_Hz", level);
    realism.autopilot.landed_state_delay_s = read_parameter(autopilot, "landed_state_delay_s", level);
    realism.autopilot.dropout_ratio = read_parameter(autopilot, "dropout_ratio", level);
  }
  for (const auto& [table, key, rate] :
       {std::tuple{"imu", "rate_Hz", realism.imu.rate_Hz},
        std::tuple{"imu", "filter_cutoff_Hz", realism.imu.filter_cutoff_Hz},
        std::tuple{"esc", "rate_Hz", realism.esc.rate_Hz},
        std::tuple{"motor", "speed_error_time_s", realism.motor.speed_error_time_s},
        std::tuple{"autopilot", "attitude_rate_Hz", realism.autopilot.attitude_rate_Hz},
        std::tuple{"autopilot", "command_rate_Hz", realism.autopilot.command_rate_Hz},
        std::tuple{"autopilot", "state_rate_Hz", realism.autopilot.state_rate_Hz}}) {
    const std::string path = fmt::format("{}.{}", table, key);
    if (!(rate > 0.0 && rate <= kPhysicsRate_Hz)) {
      root.fail(path, fmt::format("must lie in (0, {:g}] at every level", kPhysicsRate_Hz));
    }
  }
  return file.finish(realism);
}

Realism Realism::at(Level level) {
  const auto realism = read(kRealismTable, "realism.toml", level);
  AW_ASSERT(realism.has_value());  // a test reads every level
  return *realism;
}

Realism Realism::with_rotors_alike() const {
  Realism alike = *this;
  alike.motor.speed_error_ratio = 0.0;
  alike.motor.time_constant_error_ratio = 0.0;
  alike.rotor.thrust_error_ratio = 0.0;
  alike.airframe.centre_of_mass_m_per_m = 0.0;
  alike.airframe.thrust_axis_error_rad = 0.0;
  alike.wind.mean_m_s = 0.0;
  alike.imu.gyro_bias_rad_s = 0.0;
  alike.imu.gyro_drift_rad_s = 0.0;
  alike.autopilot.attitude_noise_rad = 0.0;
  alike.autopilot.position_noise_m = 0.0;
  alike.autopilot.velocity_noise_m_s = 0.0;
  return alike;
}

}  // namespace airworthy::sim
