#pragma once

#include <algorithm>
#include <cmath>

#include "core/time/time.h"

namespace airworthy {

struct CusumParams {
  double drift_sigmas = 1.25;  ///< k₀: what a healthy residual may average, in σ
  double clip_sigmas = 4.0;    ///< one sample adds no more than this
  double threshold = 8.0;      ///< h: alarm at S ≥ h
  double ceiling_ratio = 2.0;  ///< S stops at this multiple of h, so that recovery is seen in bounded time
};

/// One-sided cumulative sum of a normalised residual.
///   S ← max(0, S + clip(z, ±c) − k₀), alarm at S ≥ h (1) Source     E. S. Page, Continuous inspection
///   schemes, Biometrika 41 (1954) Onset      the last sample at which S was 0: the maximum-likelihood start
///   of the change for (1)
class Cusum {
 public:
  explicit Cusum(const CusumParams& params) noexcept : params_{params} {}

  void step(double z, TimePoint now) noexcept {
    const double limited = std::clamp(z, -params_.clip_sigmas, params_.clip_sigmas);
    if (s_ <= 0) onset_ = now;
    s_ = std::clamp(s_ + limited - params_.drift_sigmas, 0.0, params_.ceiling_ratio * params_.threshold);
  }

  void reset() noexcept { s_ = 0; }

  [[nodiscard]] double test_ratio() const noexcept { return s_ / params_.threshold; }  ///< alarm at 1
  [[nodiscard]] TimePoint onset() const noexcept { return onset_; }

 private:
  CusumParams params_;
  double s_ = 0;
  TimePoint onset_;
};

}  // namespace airworthy
