#include "services/actuator/actuator_config.h"

#include <fmt/format.h>

#include "runtime/config/vehicle.h"

namespace airworthy::actuator {
namespace {

using rt::ConfigTable;
using rt::Range;

const Range kSigma = Range{0.0, 1e3}.without_min();
const Range kShare = Range{0.0, 100.0}.without_min();

Duration seconds(ConfigTable table, const char* key, Range range) {
  return from_seconds(table.required<double>(key, range));
}

void read_input(ConfigTable table, ActuatorConfig& config) {
  ActuatorMonitorParams& params = config.monitor;
  config.imu_sensor_id = table.required<int>("imu_sensor_id", Range{0.0, 127.0});
  params.source = table.choice<InputSource>(
      "source",
      {{"auto", InputSource::kAuto}, {"speed", InputSource::kSpeed}, {"command", InputSource::kCommand}});
  params.gyro_sigma_rad_s = table.required<double>("gyro_sigma_rad_s", kSigma);
  params.accel_sigma_m_s2 = table.required<double>("accel_sigma_m_s2", kSigma);
  params.accel_lowpass_s = table.required<double>("accel_lowpass_s", Range{1e-3, 1.0});
  params.angle_sigma_rad = table.required<double>("angle_sigma_rad", kSigma);
  params.climb_sigma_m_s = table.required<double>("climb_sigma_m_s", kSigma);
  params.timing_sigma_s = table.required<double>("timing_sigma_s", Range{0.0, 1.0});
}

void read_disturbances(ConfigTable table, ActuatorMonitorParams& params) {
  params.disturbance_ratio = table.required<double>("roll_pitch_ratio", kShare);
  params.yaw_disturbance_ratio = table.required<double>("yaw_ratio", kShare);
  params.height_disturbance_ratio = table.required<double>("height_ratio", kShare);
  params.disturbance_time_s = table.required<double>("time_s", Range{0.01, 600.0});
}

void read_loss(ConfigTable table, ActuatorMonitorParams& params) {
  params.prior_sigma = table.required<double>("prior_sigma", kShare);
  params.drift_sigma_1_sqrt_s = table.required<double>("drift_sigma_1_sqrt_s", Range{0.0, 10.0});
  params.healthy_spread = table.required<double>("healthy_spread", kShare);
  params.first_spread = table.required<double>("first_spread", kShare);
  params.most_baseline = table.required<double>("most_baseline", Range{0.0, 1.0});
  params.isolation_log_likelihood = table.required<double>("isolation_log_likelihood", Range{0.0, 1e3});
  params.settle = seconds(table, "settle_s", Range{0.0, 600.0});
}

LossPolicyParams read_policy(ConfigTable table, double& judged_sigma) {
  LossPolicyParams params;
  params.loss = table.required<double>("loss_ratio", Range{0.0, 1.0}.without_min());
  params.probability = table.required<double>("probability", Range{0.5, 1.0}.without_max());
  params.persistence = seconds(table, "persistence_s", Range{0.0, 60.0});
  judged_sigma = table.required<double>("judged_sigma", kShare);
  params.life_cycle.latched = table.required<bool>("latched");
  params.life_cycle.clear_ratio = table.required<double>("clear_ratio", Range{0.0, 0.9});
  params.life_cycle.clear_after = seconds(table, "clear_after_s", Range{0.1, 600.0});
  return params;
}

}  // namespace

rt::Expected<ActuatorConfig> ActuatorConfig::load(const std::string& path,
                                                  const std::vector<std::string>& overrides) {
  auto file = rt::ConfigFile::load(path, overrides);
  ConfigTable root = file.root();
  ActuatorConfig config;
  const rt::VehicleFile vehicle = rt::VehicleFile::named_by(root);
  config.vehicle = vehicle.name;
  if (vehicle.multirotor) {
    config.monitor.vehicle = *vehicle.multirotor;
  } else if (!vehicle.name.empty()) {
    root.fail("vehicle", fmt::format("\"{}\" has no table [multirotor]: rotors must be known", vehicle.name));
  }
  read_input(root.table("input"), config);
  read_disturbances(root.table("disturbance"), config.monitor);
  read_loss(root.table("loss"), config.monitor);
  ConfigTable rotor = root.table("rotor");
  config.monitor.rotor = read_policy(rotor, config.monitor.rotor_judged_sigma);
  config.warning_loss_ratio = rotor.required<double>("warning_loss_ratio", Range{0.0, 1.0});
  config.monitor.axis = read_policy(root.table("axis"), config.monitor.axis_judged_sigma);
  config.state_period = seconds(root.table("output"), "state_period_s", Range{0.0, 60.0});
  config.hash = file.hash();
  return file.finish(std::move(config));
}

}  // namespace airworthy::actuator
