#pragma once

#include <string>
#include <vector>

#include "core/detectors/response/response_monitor.h"
#include "runtime/config/config_file.h"

namespace airworthy::response {

/// What the healthy flights of one vehicle say about its response channels: the content of a calibration
/// file. `airworthy calibrate` writes it, airworthy-response reads it.
struct Calibration {
  struct Channel {
    std::string name;
    std::vector<std::string> model;  ///< the response and the terms it was learned for, see describe()
    ChannelPrior prior;
    std::int64_t samples = 0;  ///< behind θ₀ and G₀
    double flight_spread = 0;  ///< standard deviation over flights of the mean residual, unit of the response
  };
  struct Configuration {
    bool airspeed_sensor = false;
    int flights = 0;
    double flown_s = 0;
    std::vector<Channel> channels;
  };

  std::string vehicle;
  std::string hash;                  ///< of the file it was read from
  double false_alarms_per_hour = 0;  ///< of each channel, that the thresholds are set for
  std::vector<Configuration> configurations;
};

/// A channel's model in words, the response first: what a calibration was learned for and what is configured
/// can be compared, and shown.
[[nodiscard]] std::vector<std::string> describe(const ChannelParams& params, Duration tick_period);

/// Reads a calibration file; every error of it at once.
[[nodiscard]] rt::Expected<Calibration> load_calibration(const std::string& path);

/// Makes the monitor start warm. `channel_names` in the order of monitor.channels. A channel that is not
/// configured, or whose model has changed since, is an error that says so.
[[nodiscard]] rt::Expected<MonitorParams> with_calibration(MonitorParams monitor,
                                                           const std::vector<std::string>& channel_names,
                                                           const Calibration& calibration);

[[nodiscard]] std::string to_toml(const Calibration& calibration);

}  // namespace airworthy::response
