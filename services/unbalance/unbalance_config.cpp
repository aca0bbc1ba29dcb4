#include "services/unbalance/unbalance_config.h"

#include <fmt/format.h>

#include <cmath>

#include "runtime/config/named_calibration.h"
#include "runtime/config/vehicle.h"
#include "services/unbalance/calibration.h"

namespace airworthy::unbalance {
namespace {

using rt::ConfigTable;
using rt::Range;

constexpr Range kThreshold{0.0, 1e6};

enum class ThresholdUnit { kMg, kGMm, kMS2 };

/// Acceleration at hover that a threshold of 1 stands for.
double m_s2_per_unit(ThresholdUnit unit, const UnbalanceParams& params) {
  const double m_s2_per_kg_m = 1.0 / UnbalanceMonitor::kg_m_per_m_s2(params);
  switch (unit) {
    case ThresholdUnit::kMg:
      return 1e-6 * params.vehicle.propeller_radius_m * m_s2_per_kg_m;
    case ThresholdUnit::kGMm:
      return 1e-6 * m_s2_per_kg_m;
    case ThresholdUnit::kMS2:
      break;
  }
  return 1.0;
}

void read_thresholds(ConfigTable table, UnbalanceParams& params) {
  const auto unit = table.choice<ThresholdUnit>(
      "unit", {{"mg", ThresholdUnit::kMg}, {"g_mm", ThresholdUnit::kGMm}, {"m_s2", ThresholdUnit::kMS2}});
  const auto advisory = table.required<double>("advisory", kThreshold.without_min());
  const auto caution = table.required<double>("caution", kThreshold.without_min());
  const auto usual = table.required<double>("usual", kThreshold);
  if (!(caution > advisory)) {
    table.fail("caution", fmt::format("{:g} must exceed advisory ({:g})", caution, advisory), {"advisory"});
  }
  params.thresholds_are_masses = unit != ThresholdUnit::kMS2;
  const double scale = m_s2_per_unit(unit, params);
  params.smallest_m_s2 = scale * advisory;
  params.caution_m_s2 = scale * caution;
  params.usual_m_s2 = scale * usual;
}

void read_policy(ConfigTable table, UnbalanceParams& params) {
  params.persistence_s = table.optional<double>("persistence_s", params.persistence_s, Range{0.0, 600.0});
  params.ambiguous_after_s =
      table.optional<double>("ambiguous_after_s", params.ambiguous_after_s, Range{0.0, 3600.0});
  params.log_odds = std::log(table.optional<double>("odds", 10'000.0, Range{2.0, 1e12}));
  params.life_cycle.clear_ratio =
      table.optional<double>("clear_ratio", params.life_cycle.clear_ratio, Range{0.0, 0.9});
  params.life_cycle.clear_after = from_seconds(
      table.optional<double>("clear_after_s", to_seconds(params.life_cycle.clear_after), Range{0.1, 600.0}));
}

void read_calibration(ConfigTable root, bool opens_it, UnbalanceConfig& config) {
  if (!root.has("calibration")) return;
  const auto calibration = rt::named_calibration(root, config.vehicle, opens_it, load_calibration);
  if (!calibration) return;
  auto params = with_calibration(config.monitor, *calibration);
  if (!params) return root.fail("calibration", params.error().text, {"vehicle"});
  config.monitor = *params;
  config.is_calibrated = true;
}

rt::Expected<UnbalanceConfig> load_file(const std::string& path, const std::vector<std::string>& overrides,
                                        bool opens_calibration) {
  auto file = rt::ConfigFile::load(path, overrides);
  ConfigTable root = file.root();
  UnbalanceConfig config;
  const rt::VehicleFile vehicle = rt::VehicleFile::named_by(root);
  config.vehicle = vehicle.name;
  ConfigTable input = root.table("input");
  config.imu_sensor_id = input.optional<int>("imu_sensor_id", 0, Range{0, 127});
  config.monitor.low_pass_Hz = input.optional<double>("accel_low_pass_Hz", 0.0, Range{0.0, 1e5});
  if (vehicle.multirotor) {
    config.monitor.vehicle = *vehicle.multirotor;
    const auto& response = vehicle.multirotor->vibration_response;
    config.monitor.response = 0.5 * (response[0] + response[1]);
  } else {
    root.fail("vehicle", "has no table [multirotor]: there are no rotors to watch");
  }
  if (!(config.monitor.response > 0.0)) {
    root.fail("vehicle", "multirotor.vibration_response: 0 in x and y: no unbalance could be felt");
    config.monitor.response = 1.0;
  }
  read_thresholds(root.required_table("threshold"), config.monitor);
  read_policy(root.table("policy"), config.monitor);
  read_calibration(root, opens_calibration, config);
  config.hash = file.hash();
  return file.finish(std::move(config));
}

}  // namespace

rt::Expected<UnbalanceConfig> UnbalanceConfig::load(const std::string& path,
                                                    const std::vector<std::string>& overrides) {
  return load_file(path, overrides, true);
}

rt::Expected<UnbalanceConfig> UnbalanceConfig::load_uncalibrated(const std::string& path,
                                                                 const std::vector<std::string>& overrides) {
  return load_file(path, overrides, false);
}

}  // namespace airworthy::unbalance
