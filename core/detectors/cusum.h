#pragma once

#include <algorithm>

#include "core/time/time.h"

namespace airworthy {

struct CusumParams {
  double threshold = 8.0;      ///< h: alarm at S ≥ h
  double ceiling_ratio = 2.0;  ///< S stops at this multiple of h, so that recovery is seen in bounded time
};

/// Cumulative sum of evidence for a change.
///   S ← max(0, S + g), alarm at S ≥ h                                                                (1)
///   Source     E. S. Page, Continuous inspection schemes, Biometrika 41 (1954)
///   Symbols    g: log-likelihood ratio of one sample, or a robust stand-in, negative in the mean without a
///              change
///   Onset      the last sample at which S was 0: the maximum-likelihood start of the change for (1)
class Cusum {
 public:
  explicit Cusum(const CusumParams& params) noexcept : params_{params} {}

  void step(double evidence, TimePoint now) noexcept {
    if (s_ <= 0) onset_ = now;
    s_ = std::clamp(s_ + evidence, 0.0, params_.ceiling_ratio * params_.threshold);
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
