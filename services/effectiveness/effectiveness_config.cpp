#include "services/effectiveness/effectiveness_config.h"

#include <fmt/format.h>

#include "runtime/config/named_calibration.h"
#include "runtime/config/vehicle.h"
#include "services/effectiveness/calibration.h"

namespace airworthy::effectiveness {
namespace {

using rt::ConfigTable;
using rt::Range;

constexpr double kSecondsPerMs = 1e-3;
constexpr int kMostWaiting = 60;
constexpr double kMostRateOfDelay_Hz =
    1000.0;  // samples wait for the speeds of their delay: the detector holds 64

void read_input(ConfigTable table, EffectivenessConfig& config) {
  config.imu_sensor_id = table.optional<int>("imu_sensor_id", 0, Range{0, 127});
  const auto milliseconds = [&table](const char* key, double fallback, double most) {
    return from_seconds(kSecondsPerMs * table.optional<double>(key, fallback, Range{0.0, most}));
  };
  config.monitor.samples_per_s = table.optional<double>("imu_rate_Hz", 500.0, Range{50.0, 8000.0});
  config.monitor.speeds.command_latency = milliseconds("command_latency_ms", 4.0, 100.0);
  config.monitor.speeds.telemetry_latency = milliseconds("telemetry_latency_ms", 10.0, 100.0);
  config.monitor.learns_inertial_delay = table.optional<bool>("inertial_delay_learned", false);
  if (config.monitor.learns_inertial_delay && config.monitor.samples_per_s > kMostRateOfDelay_Hz) {
    table.fail("imu_rate_Hz",
               fmt::format("{:g} is more than the {:g} of which inertial_delay_learned can learn a delay",
                           config.monitor.samples_per_s, kMostRateOfDelay_Hz),
               {"inertial_delay_learned"});
  }
  config.monitor.most_wait = milliseconds("most_wait_ms", 20.0, 100.0);
  const double most_waiting = to_seconds(config.monitor.most_wait) * config.monitor.samples_per_s;
  if (most_waiting > kMostWaiting) {
    table.fail("most_wait_ms",
               fmt::format("at imu_rate_Hz = {:g} that is {:.0f} samples; the detector holds {}",
                           config.monitor.samples_per_s, most_waiting, kMostWaiting),
               {"imu_rate_Hz"});
  }
  config.monitor.mapping_is_known = table.optional<bool>("rotor_mapping_checked", false);
}

void read_model(ConfigTable table, ModelNoise& noise) {
  noise.acceleration_ratio =
      table.optional<double>("acceleration_error_ratio", noise.acceleration_ratio, Range{1e-3, 1.0});
  noise.gain_error_ratio =
      table.optional<double>("gain_error_ratio", noise.gain_error_ratio, Range{0.0, 1.0});
  noise.disturbance_ratio_per_sqrt_s = table.optional<double>(
      "disturbance_ratio_per_sqrt_s", noise.disturbance_ratio_per_sqrt_s, Range{1e-3, 10.0});
  noise.vertical_ratio_per_sqrt_s =
      table.optional<double>("vertical_ratio_per_sqrt_s", noise.vertical_ratio_per_sqrt_s, Range{1e-3, 10.0});
}

void read_policy(ConfigTable table, EffectivenessParams& params) {
  params.false_alarms_per_hour = table.required<double>("false_alarms_per_hour", Range{1e-12, 1.0});
  params.least_loss_ratio =
      table.optional<double>("least_loss_ratio", params.least_loss_ratio, Range{0.05, 0.5});
  params.propeller_spread_ratio =
      table.optional<double>("propeller_spread_ratio", params.propeller_spread_ratio, Range{0.005, 0.3});
  params.offset_ratio = table.optional<double>("offset_ratio", params.offset_ratio, Range{0.001, 0.5});
  params.lost_below_ratio =
      table.optional<double>("lost_below_ratio", params.lost_below_ratio, Range{0.05, 0.5});
  params.lost_probability =
      table.optional<double>("lost_probability", params.lost_probability, Range{0.5, 0.999});
  params.settle =
      from_seconds(table.optional<double>("settle_s", to_seconds(params.settle), Range{0.1, 60.0}));
  params.settle_partial = from_seconds(
      table.optional<double>("settle_partial_s", to_seconds(params.settle_partial), Range{0.1, 60.0}));
  if (params.settle_partial < params.settle) {
    table.fail("settle_partial_s",
               fmt::format("{:g} must not be less than settle_s ({:g})", to_seconds(params.settle_partial),
                           to_seconds(params.settle)),
               {"settle_s"});
  }
}

void read_calibration(ConfigTable root, bool opens_it, EffectivenessConfig& config) {
  if (!root.has("calibration")) return;
  const auto calibration = rt::named_calibration(root, config.vehicle, opens_it, load_calibration);
  if (!calibration) return;
  if (calibration->vehicle_hash != config.vehicle_hash) {
    return root.fail("calibration",
                     fmt::format("was learned with another content of the file of vehicle \"{}\": "
                                 "calibrate again",
                                 config.vehicle));
  }
  config.monitor = with_calibration(config.monitor, *calibration);
  config.is_calibrated = true;
}

void use_vehicle(ConfigTable root, const rt::VehicleFile& file, EffectivenessParams& params) {
  if (!file.multirotor)
    return root.fail("vehicle", "has no table [multirotor]: there are no rotors to watch");
  params.vehicle = *file.multirotor;
  params.effectiveness = EffectivenessMatrix<double>::of(params.vehicle);
  params.speeds.rotor_count = params.vehicle.rotor_count;
  params.speeds.time_constant_s = params.vehicle.motor_time_constant_s;
  params.speeds.speed_min_rad_s = params.vehicle.speed_min_rad_s;
  params.speeds.speed_max_rad_s = params.vehicle.speed_max_rad_s;
}

rt::Expected<EffectivenessConfig> load_file(const std::string& path,
                                            const std::vector<std::string>& overrides,
                                            bool opens_calibration) {
  auto file = rt::ConfigFile::load(path, overrides);
  ConfigTable root = file.root();
  EffectivenessConfig config;
  const rt::VehicleFile vehicle = rt::VehicleFile::named_by(root);
  config.vehicle = vehicle.name;
  config.vehicle_hash = vehicle.hash;
  use_vehicle(root, vehicle, config.monitor);
  read_input(root.table("input"), config);
  read_model(root.table("model"), config.monitor.noise);
  read_policy(root.required_table("policy"), config.monitor);
  read_calibration(root, opens_calibration, config);
  config.hash = file.hash();
  return file.finish(std::move(config));
}

}  // namespace

rt::Expected<EffectivenessConfig> EffectivenessConfig::load(const std::string& path,
                                                            const std::vector<std::string>& overrides) {
  return load_file(path, overrides, true);
}

rt::Expected<EffectivenessConfig> EffectivenessConfig::load_uncalibrated(
    const std::string& path, const std::vector<std::string>& overrides) {
  return load_file(path, overrides, false);
}

}  // namespace airworthy::effectiveness
