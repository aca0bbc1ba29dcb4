#pragma once

#include <functional>
#include <string>
#include <vector>

#include "cli/calibrate/healthy_flight.h"
#include "cli/calibrate/tail.h"

namespace airworthy::calibrate {

struct LearningParams {
  double false_alarms_per_hour = 0.01;  ///< of each channel
  std::int64_t worth_samples = 300;     ///< N₀: how much of a new flight outweighs the earlier ones
  unsigned jobs = 1;
};

/// A learned calibration, and what a person should see before trusting it.
struct Learned {
  response::Calibration calibration;
  std::vector<Tail> tails;         ///< of the configured channels, over all configurations
  std::vector<std::string> notes;  ///< what was left out, and why
};

/// Fewer independent flights of a configuration cannot be cross-validated.
inline constexpr int kFewestFlights = 3;

/// Learns, per configuration of the vehicle, a prior for each regression channel and, over all of them, each
/// channel's threshold. The threshold comes from flights that the prior behind their statistic has not seen:
/// each group of flights is left out in turn.
///   θ₀, σ₀  Huber fit over all flights: w = min(1, c·σ/|e|), c = 2, σ = 1.4826·median|e|, to convergence   (1)
///   G₀      Σ w·x·xᵀ/Σ w + 10⁻⁴·diag(mean x²)                                                            (2)
///   h       Tail::threshold(), of S with flights left out in turn                                          (3)
/// Refuses flights of several vehicles, and too few flights.
[[nodiscard]] rt::Expected<Learned> learn(const std::vector<const HealthyFlight*>& flights,
                                          const response::ResponseConfig& config,
                                          const LearningParams& params);

/// Calls `work(i)` for i = 0 … count − 1 on `jobs` threads.
void for_each_parallel(std::size_t count, unsigned jobs, const std::function<void(std::size_t)>& work);

}  // namespace airworthy::calibrate
