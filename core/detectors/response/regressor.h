#pragma once

#include <algorithm>

#include "core/detectors/response/signals.h"

namespace airworthy::response {

/// Computes one Term tick by tick. NaN while its history is too short or its signal unknown; unknown values
/// do not enter the low-pass.
class Regressor {
 public:
  static constexpr int kMostDelayTicks = 63;

  explicit Regressor(const Term& term = {}) noexcept : term_{term} { reset_history(); }

  double step(const SignalFrame& frame, double tick_s) noexcept {
    double value = apply(term_.transform, frame[term_.signal]);
    if (term_.lowpass_s > 0 && std::isfinite(value)) {
      if (!std::isfinite(state_)) state_ = value;
      state_ += std::min(1.0, tick_s / term_.lowpass_s) * (value - state_);
      value = state_;
    }
    newest_ = (newest_ + 1) % static_cast<int>(history_.size());
    history_[static_cast<std::size_t>(newest_)] = value;
    const double late = delayed(term_.delay_ticks);
    return term_.minus_delay_ticks ? late - delayed(*term_.minus_delay_ticks) : late;
  }

  /// After a gap: what lies behind it is not the past that the delays mean.
  void reset_history() noexcept { history_.fill(std::numeric_limits<double>::quiet_NaN()); }

 private:
  [[nodiscard]] double delayed(int ticks) const noexcept {
    const int size = static_cast<int>(history_.size());
    return history_[static_cast<std::size_t>((newest_ - ticks + size) % size)];
  }

  Term term_;
  double state_ = std::numeric_limits<double>::quiet_NaN();
  std::array<double, kMostDelayTicks + 1> history_{};
  int newest_ = 0;
};

}  // namespace airworthy::response
