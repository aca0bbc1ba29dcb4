#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include "core/time/time.h"

namespace airworthy::actuator {

/// Whether a sample of a three-axis sensor says something about the vehicle.
///   |y − y₋| > b = 8·√2·max(σ, √q) + reach   on any axis: an outlier, for at most 50 ms in a row           (1)
///   q ← q + (min(|y − y₋|, 5·√2·max(σ, √q))²/2 − q)·Δt/(Δt + 1 s)   for vehicles that shake by more than σ    (2)
///   y₋: the last sample taken; reach: how far the vehicle itself may have moved y since; Δt since the last sample
/// (1) compares samples, not a sample and a prediction: what a fault does grows from sample to sample within reach and is
/// never held back, while a bad sample stands alone. What lasts is taken in the end, for it may be true.
/// Values that repeat the last ones on all axes to the bit are no measurement: they are an older one sent again.
class SampleCheck {
 public:
  using Values = std::array<double, 3>;
  enum class Verdict : std::uint8_t { kTaken, kOutlier, kRepeated };

  explicit SampleCheck(double sigma) noexcept : least_variance_{sigma * sigma} {}

  [[nodiscard]] Verdict judge(TimePoint time, const Values& value, const Values& reach) noexcept {
    const bool repeats = has_value_ && value == value_;
    if (repeats) {
      ++repeated_;
      return Verdict::kRepeated;
    }
    const double dt_s = has_value_ ? std::max(0.0, to_seconds(time - changed_at_)) : 0.0;
    value_ = value;
    has_value_ = true;
    changed_at_ = time;
    if (taken_at_ && jumps(value, reach, dt_s) && time - *taken_at_ <= kMostHeldBack) {
      ++outliers_;
      return Verdict::kOutlier;
    }
    taken_ = value;
    taken_at_ = time;
    return Verdict::kTaken;
  }

  /// What was taken before is no measure for what comes.
  void restart() noexcept { taken_at_.reset(); }

  /// For how long the same values have been repeated.
  [[nodiscard]] Duration repeats_for(TimePoint now) const noexcept {
    return has_value_ ? now - changed_at_ : Duration{0};
  }
  /// Time since y₋ of (1); 0 if there is none.
  [[nodiscard]] double since_taken_s(TimePoint now) const noexcept {
    return taken_at_ ? to_seconds(now - *taken_at_) : 0.0;
  }
  [[nodiscard]] std::int64_t outliers() const noexcept { return outliers_; }
  [[nodiscard]] std::int64_t repeated() const noexcept { return repeated_; }

 private:
  static constexpr Duration kMostHeldBack{50'000};
  static constexpr double kGate = 8.0;
  static constexpr double kClip = 5.0;
  static constexpr double kVarianceTime_s = 1.0;

  [[nodiscard]] bool jumps(const Values& value, const Values& reach, double dt_s) noexcept {
    bool any = false;
    for (std::size_t i = 0; i < value.size(); ++i) {
      const double sigma = std::numbers::sqrt2 * std::sqrt(std::max(least_variance_, variance_[i]));
      const double jump = std::abs(value[i] - taken_[i]);
      any = any || jump > kGate * sigma + reach[i];  // (1)
      const double clipped = std::min(jump, kClip * sigma);
      variance_[i] += (0.5 * clipped * clipped - variance_[i]) * dt_s / (dt_s + kVarianceTime_s);  // (2)
    }
    return any;
  }

  double least_variance_;
  Values variance_{};
  Values value_{};
  Values taken_{};
  TimePoint changed_at_{};
  std::optional<TimePoint> taken_at_;
  std::int64_t outliers_ = 0;
  std::int64_t repeated_ = 0;
  bool has_value_ = false;
};

}  // namespace airworthy::actuator
