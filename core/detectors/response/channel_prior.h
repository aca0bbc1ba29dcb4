#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace airworthy::response {

inline constexpr int kMostTerms = 12;
inline constexpr int kMostChannels = 8;

/// What earlier healthy flights of a vehicle say about one channel. Learned by `airworthy calibrate`;
/// equations in docs/equations/response.md, section warm start.
struct ChannelPrior {
  std::array<double, kMostTerms> theta{};  ///< θ₀, in the order of the channel's terms
  std::array<double, std::size_t{kMostTerms} * kMostTerms>
      gram{};                      ///< G₀ = mean of x·xᵀ, row by row, term_count square
  double sigma = 0;                ///< σ₀ of the residual, in the unit of the response
  double threshold = 0;            ///< h, from the tail of the healthy flights' statistic
  std::int64_t worth_samples = 0;  ///< N₀
};

/// How a vehicle is equipped decides what its commands mean: a flight controller without an airspeed sensor
/// reports errors of an estimate. Priors are learned and used per configuration.
struct VehicleConfiguration {
  bool airspeed_sensor = false;
  std::array<std::optional<ChannelPrior>, kMostChannels> priors{};
};
inline constexpr int kMostConfigurations = 2;

}  // namespace airworthy::response
