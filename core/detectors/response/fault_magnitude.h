#pragma once

#include <cmath>
#include <cstdint>

#include "core/detectors/response/channel_verdict.h"
#include "core/time/time.h"

namespace airworthy::response {

/// How large the active fault of a channel is: the mean of observed − expected since its onset.
class FaultMagnitude {
 public:
  void begin(TimePoint onset) noexcept {
    *this = {};
    onset_ = onset;
  }

  void add(const ChannelVerdict& verdict) noexcept {
    innovation_sum_ += verdict.observed - verdict.expected;
    variance_sum_ += verdict.sigma * verdict.sigma;
    ++count_;
  }

  void tell(ChannelVerdict& verdict) const noexcept {
    verdict.onset = onset_;
    if (count_ == 0) return;
    const auto count = static_cast<double>(count_);
    verdict.mean_innovation = innovation_sum_ / count;
    verdict.mean_innovation_sigma = std::sqrt(variance_sum_) / count;
  }

  [[nodiscard]] TimePoint onset() const noexcept { return onset_; }

 private:
  TimePoint onset_{};
  double innovation_sum_ = 0;
  double variance_sum_ = 0;
  std::int64_t count_ = 0;
};

}  // namespace airworthy::response
