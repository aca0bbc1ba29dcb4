#pragma once

#include <string>
#include <vector>

#include "runtime/error.h"
#include "services/response/calibration.h"
#include "services/response/response_config.h"

namespace airworthy::calibrate {

/// The healthy part of one recorded flight as the response channels saw it: from kSettle after it began until
/// kBeforeOnset before a fault that GROUND_TRUTH names, or to its end.
struct HealthyFlight {
  struct Samples {
    std::vector<double> response;    ///< y, one a tick
    std::vector<double> regressors;  ///< x, term_count a tick, tick by tick
  };

  static constexpr Duration kSettle{5'000'000};
  static constexpr Duration kBeforeOnset{500'000};

  std::string log_path;
  std::string name;
  std::string group;  ///< recordings of one group are parts of one flight, never independent
  std::string vehicle;
  bool truth_known = false;
  bool airspeed_sensor = false;
  double flown_s = 0;
  std::vector<Samples> channels;
};

/// Plays a log through the cold detector and keeps what its channels saw.
[[nodiscard]] rt::Expected<HealthyFlight> read_healthy_flight(const std::string& log_path,
                                                              const response::ResponseConfig& config);

/// Plays a log through the detector with `config` as it stands and returns, per channel, the greatest value
/// of its statistic (in units of the evidence, not of the threshold) in each Tail::kBlock_s of healthy flight.
[[nodiscard]] rt::Expected<std::vector<std::vector<double>>> block_maxima(
    const std::string& log_path, const response::ResponseConfig& config);

}  // namespace airworthy::calibrate
