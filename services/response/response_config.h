#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/detectors/response/response_monitor.h"
#include "core/vehicle/multirotor.h"
#include "runtime/config/config_file.h"
#include "runtime/detector/fault_reporter.h"

namespace airworthy::response {

/// What an alarm of a channel means, in words.
struct ChannelMeaning {
  std::string name;
  std::string component;
  std::string fault_kind;
  rt::Severity severity = rt::Severity::kCaution;
  std::string summary;
  std::string unit;  ///< of the response
  std::vector<std::string> candidates;
};

struct ResponseConfig {
  std::string vehicle;
  std::string hash;
  std::optional<Multirotor> multirotor;  ///< the flight phase needs it
  int imu_sensor_id = 0;
  MonitorParams monitor;
  std::vector<ChannelMeaning> channels;  ///< in the order of monitor.channels

  [[nodiscard]] std::vector<std::string> channel_names() const;

  /// With a key `calibration` the monitor starts warm, from that file; see services/response/calibration.h.
  [[nodiscard]] static rt::Expected<ResponseConfig> load(const std::string& path,
                                                         const std::vector<std::string>& overrides);
  /// The same without opening the calibration, which may yet have to be learned.
  [[nodiscard]] static rt::Expected<ResponseConfig> load_cold(const std::string& path,
                                                              const std::vector<std::string>& overrides);
};

}  // namespace airworthy::response
