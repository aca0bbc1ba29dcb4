#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "core/time/time.h"

namespace airworthy {

/// How much later than the rotor speeds the inertial data are stamped, where the two come by separate messages of a link
/// that stamps on arrival: a constant of the session, not of the vehicle. The body itself tells.
///   Candidate   d of 0, 5, … 60 ms:  Δ²u(t − d), the roll and pitch acceleration that the described rows give for the
///               speeds of d before, from one interval to the next, against Δ²y, that of the gyroscope          (1)
///   Explained   R² = c²/(m·s),  m = Σ Δ²u², c = Σ Δ²u·Δ²y, s = Σ Δ²y², c > 0;  mean of roll and pitch          (2)
///   Known       R² > 0.3 and n/2·ln((1 − R²_other)/(1 − R²)) > 6 nats over all candidates 20 ms away or more, of
///               n intervals, 30 at least; then the vertex of the parabola through the best and its neighbours: 0 to
///               57.5 ms. Where the last candidate is the best, the delay may be longer, and is not known         (3)
///   Memory      all sums and n fade by 1/150 with every interval: a link's delay may drift                     (4)
/// Intervals overlap nowhere; no heap; 60 flops for each candidate and sample.
template <class Scalar>
class StreamDelay {
 public:
  static constexpr std::size_t kCandidates = 13;
  static constexpr Duration kStep{5'000};
  static constexpr Duration kMost = kStep * (static_cast<int>(kCandidates) - 1);
  static constexpr Scalar kLeastIntervals = Scalar(27);  ///< 30, faded
  static constexpr Scalar kKeep = Scalar(1) - Scalar(1) / Scalar(150);
  static constexpr Scalar kLeastExplained = Scalar(0.3);
  static constexpr Scalar kCertain = Scalar(6);  ///< nats
  static constexpr std::size_t kApart = 4;       ///< candidates

  /// Roll and pitch acceleration, rad/s², that the rotors gave d before the sample, for every candidate d.
  using Accelerations = std::array<std::array<Scalar, 2>, kCandidates>;

  explicit StreamDelay(Scalar interval_s) noexcept : interval_s_{interval_s} {}

  void interrupt() noexcept { open_ = has_previous_ = false; }

  void add(Scalar dt_s, const std::array<Scalar, 2>& gyro_rad_s, const Accelerations& u_rad_s2) noexcept {
    if (!open_) {
      start(gyro_rad_s);
      return;
    }
    seconds_ += dt_s;
    for (std::size_t k = 0; k < kCandidates; ++k) {
      for (std::size_t axis = 0; axis < 2; ++axis) sum_[k][axis] += dt_s * u_rad_s2[k][axis];
    }
    if (seconds_ < interval_s_) return;
    close(gyro_rad_s);
    start(gyro_rad_s);
  }

  /// By (3); nothing while it is not certain.
  [[nodiscard]] std::optional<Duration> delay() const noexcept {
    if (intervals_ < kLeastIntervals) return std::nullopt;
    std::size_t best = 0;
    for (std::size_t k = 1; k < kCandidates; ++k) best = explained(k) > explained(best) ? k : best;
    if (best + 1 == kCandidates || explained(best) < kLeastExplained) return std::nullopt;
    for (std::size_t k = 0; k < kCandidates; ++k) {
      const std::size_t apart = k > best ? k - best : best - k;
      if (apart >= kApart && odds(best, k) < kCertain) return std::nullopt;
    }
    Scalar vertex{0};
    if (best > 0) {
      const Scalar before = explained(best - 1);
      const Scalar after = explained(best + 1);
      const Scalar bend = Scalar{2} * explained(best) - before - after;
      if (bend > Scalar{0}) vertex = (after - before) / (Scalar{2} * bend);
    }
    return kStep * static_cast<int>(best) + from_seconds(static_cast<double>(vertex) * to_seconds(kStep));
  }

  /// R² of (2).
  [[nodiscard]] Scalar explained(std::size_t candidate) const noexcept {
    Scalar sum{0};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const Sums& sums = sums_[candidate][axis];
      if (sums.c > Scalar{0} && sums.m > Scalar{0}) sum += sums.c * sums.c / (sums.m * s_[axis]);
    }
    return sum / Scalar{2};
  }

 private:
  struct Sums {
    Scalar m = 0;
    Scalar c = 0;
  };

  [[nodiscard]] Scalar odds(std::size_t better, std::size_t worse) const noexcept {
    const auto left = [this](std::size_t k) { return std::max(Scalar{1} - explained(k), Scalar(1e-6)); };
    return intervals_ / Scalar{2} * std::log(left(worse) / left(better));
  }

  void start(const std::array<Scalar, 2>& gyro) noexcept {
    start_gyro_ = gyro;
    seconds_ = 0;
    sum_ = {};
    open_ = true;
  }

  void close(const std::array<Scalar, 2>& gyro) noexcept {
    std::array<Scalar, 2> y{};
    for (std::size_t axis = 0; axis < 2; ++axis) y[axis] = (gyro[axis] - start_gyro_[axis]) / seconds_;
    Accelerations u = sum_;
    for (auto& candidate : u) {
      for (Scalar& one : candidate) one /= seconds_;
    }
    if (has_previous_) {
      intervals_ = kKeep * intervals_ + Scalar{1};
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const Scalar dy = y[axis] - y_[axis];
        s_[axis] = kKeep * s_[axis] + dy * dy;
        for (std::size_t k = 0; k < kCandidates; ++k) {
          const Scalar du = u[k][axis] - u_[k][axis];
          sums_[k][axis].m = kKeep * sums_[k][axis].m + du * du;
          sums_[k][axis].c = kKeep * sums_[k][axis].c + du * dy;
        }
      }
    }
    y_ = y;
    u_ = u;
    has_previous_ = true;
  }

  Scalar interval_s_;
  Scalar seconds_ = 0;
  std::array<Scalar, 2> start_gyro_{};
  Accelerations sum_{};
  std::array<Scalar, 2> y_{};
  Accelerations u_{};
  std::array<Scalar, 2> s_{};
  std::array<std::array<Sums, 2>, kCandidates> sums_{};
  Scalar intervals_ = 0;
  bool open_ = false;
  bool has_previous_ = false;
};

}  // namespace airworthy
