#pragma once

#include <string>
#include <vector>

#include "core/detectors/unbalance/unbalance_monitor.h"
#include "runtime/config/config_file.h"

namespace airworthy::unbalance {

struct UnbalanceConfig {
  std::string vehicle;
  std::string hash;
  int imu_sensor_id = 0;
  UnbalanceParams monitor;
  bool is_calibrated = false;

  /// With a key `calibration` the baselines come from that file; see services/unbalance/calibration.h.
  [[nodiscard]] static rt::Expected<UnbalanceConfig> load(const std::string& path,
                                                          const std::vector<std::string>& overrides);
  /// The same without opening the calibration, which may yet have to be learned.
  [[nodiscard]] static rt::Expected<UnbalanceConfig> load_uncalibrated(
      const std::string& path, const std::vector<std::string>& overrides);
};

}  // namespace airworthy::unbalance
