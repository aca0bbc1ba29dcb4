#pragma once

#include <vector>

namespace airworthy::calibrate {

/// Threshold that a statistic of healthy flight exceeds as rarely as asked.
///   Model      maxima M of blocks of flight, above their 80 % quantile u: P(M > h) = 0.2·exp(−(h − u)/β)   (1)
///   Fit        β = mean(Mᵢ − u) over the Mᵢ > u, the maximum-likelihood estimate                           (2)
///   Threshold  h(λ) = u + β·ln(0.2·N_h/λ), N_h blocks an hour, λ false alarms an hour                      (3)
///   Valid for  a statistic with an exponential tail, as the maxima of a CUSUM have; rates far below one in
///              the time observed are an extrapolation
struct Tail {
  double start = 0;  ///< u
  double scale = 0;  ///< β; 0 where fewer than kFewestBlocks blocks were seen
  int blocks = 0;

  static constexpr double kShareAbove = 0.2;
  static constexpr int kFewestBlocks = 20;
  static constexpr double kBlock_s = 20.0;

  [[nodiscard]] double threshold(double false_alarms_per_hour) const;
};

[[nodiscard]] Tail fit_tail(std::vector<double> block_maxima);

}  // namespace airworthy::calibrate
