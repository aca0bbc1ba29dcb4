#pragma once

#include <string>
#include <vector>

#include "core/detectors/effectiveness/effectiveness_monitor.h"
#include "runtime/config/config_file.h"

namespace airworthy::effectiveness {

struct EffectivenessConfig {
  std::string vehicle;
  std::string vehicle_hash;  ///< of the content of its file
  std::string hash;
  int imu_sensor_id = 0;
  EffectivenessParams monitor;
  bool is_calibrated = false;

  /// With a key `calibration` effectiveness, latencies and noise come from that file; see calibration.h.
  [[nodiscard]] static rt::Expected<EffectivenessConfig> load(const std::string& path,
                                                              const std::vector<std::string>& overrides);
  /// The same without opening the calibration, which may yet have to be learned.
  [[nodiscard]] static rt::Expected<EffectivenessConfig> load_uncalibrated(
      const std::string& path, const std::vector<std::string>& overrides);
};

}  // namespace airworthy::effectiveness
