#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace airworthy {

/// Mean and variance of all values seen, in one pass and without cancellation.
///   m ← m + (v − m)/N;  M ← M + (v − m_old)·(v − m);  variance = M/(N − 1)                              (1)
///   Source  B. P. Welford, Note on a Method for Calculating Corrected Sums of Squares and Products,
///           Technometrics 4 (1962), by name; (1) follows from Σ(v − m)² by adding one value
class RunningMoments {
 public:
  void add(double value) noexcept {
    ++count_;
    const double from_old_mean = value - mean_;
    mean_ += from_old_mean / static_cast<double>(count_);
    squares_ += from_old_mean * (value - mean_);
  }

  [[nodiscard]] std::int64_t count() const noexcept { return count_; }
  [[nodiscard]] double mean() const noexcept { return mean_; }
  /// NaN for fewer than two values.
  [[nodiscard]] double variance() const noexcept {
    return count_ > 1 ? squares_ / static_cast<double>(count_ - 1) : std::numeric_limits<double>::quiet_NaN();
  }
  [[nodiscard]] double deviation() const noexcept { return std::sqrt(variance()); }

 private:
  std::int64_t count_ = 0;
  double mean_ = 0;
  double squares_ = 0;
};

}  // namespace airworthy
