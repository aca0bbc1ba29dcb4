#pragma once

#include <string>
#include <vector>

#include "core/detectors/actuator/actuator_monitor.h"
#include "runtime/config/config_file.h"
#include "runtime/detector/fault_reporter.h"

namespace airworthy::actuator {

struct ActuatorConfig {
  std::string vehicle;
  std::string hash;
  int imu_sensor_id = 0;
  Duration state_period{20'000};    ///< of ACTUATOR_STATE
  double warning_loss_ratio = 0.5;  ///< of a rotor; below it is a caution
  ActuatorMonitorParams monitor;    ///< with the vehicle

  [[nodiscard]] static rt::Expected<ActuatorConfig> load(const std::string& path,
                                                         const std::vector<std::string>& overrides);
};

}  // namespace airworthy::actuator
