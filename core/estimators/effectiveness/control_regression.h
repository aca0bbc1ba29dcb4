#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/estimators/effectiveness/effectiveness_matrix.h"
#include "core/time/time.h"

namespace airworthy {

/// How the body's motion goes with the rotor speeds: sums over intervals of a healthy flight, for learning the control
/// effectiveness and for noticing that the rotors are numbered or turning otherwise than described.
///   Interval   mean over some 20 to 100 ms:  xᵢ of ωᵢ²;  y of ṗ, q̇ (from rate differences) and a_z            (1)
///   Change     Δx, Δy from one interval to the next: offsets and slow winds drop out                        (2)
///   Sums       M = Σ Δx·Δxᵀ,  c = Σ Δx·Δy,  s = Σ Δy²                                            (3)
///   Row        a row b explains the share R² = 1 − min over g > 0 of (s − 2g·bᵀc + g²·bᵀMb)/s              (4)
/// Cost 2·N² flops an interval; no heap.
template <class Scalar, std::size_t kMost = kMaxRotors>
class ControlRegression {
 public:
  using Row = std::array<Scalar, kMost>;
  struct Sums {
    std::array<std::array<Scalar, kMost>, kMost> m{};
    Row c{};
    Scalar s = 0;
    std::int64_t intervals = 0;

    /// bᵀc and bᵀMb.
    [[nodiscard]] Scalar along(const Row& b, std::size_t n) const noexcept {
      Scalar sum{0};
      for (std::size_t i = 0; i < n; ++i) sum += b[i] * c[i];
      return sum;
    }
    [[nodiscard]] Scalar power(const Row& b, std::size_t n) const noexcept {
      Scalar sum{0};
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j) sum += b[i] * m[i][j] * b[j];
      }
      return sum;
    }
    /// g of (4); 0 where b explains nothing with a positive gain.
    [[nodiscard]] Scalar gain(const Row& b, std::size_t n) const noexcept {
      const Scalar bc = along(b, n);
      const Scalar bmb = power(b, n);
      return bc > Scalar{0} && bmb > Scalar{0} ? bc / bmb : Scalar{0};
    }
    /// R² of (4).
    [[nodiscard]] Scalar explained(const Row& b, std::size_t n) const noexcept {
      return s > Scalar{0} ? gain(b, n) * along(b, n) / s : Scalar{0};
    }
    void fade(Scalar keep, std::size_t n) noexcept {
      s *= keep;
      for (std::size_t i = 0; i < n; ++i) {
        c[i] *= keep;
        for (std::size_t j = 0; j < n; ++j) m[i][j] *= keep;
      }
    }
  };

  /// Longer intervals hide the noise of the gyroscope, shorter ones follow the motors: twice their time constant for
  /// is a good choice.
  ControlRegression(std::size_t rotor_count, Scalar interval_s) noexcept
      : n_{rotor_count}, interval_s_{interval_s} {}

  /// Starts over between flights, mutings and gaps; the sums stay.
  void interrupt() noexcept { open_ = has_previous_ = false; }

  void add(Scalar dt_s, std::span<const Scalar> speed_rad_s, const std::array<Scalar, 3>& gyro_rad_s,
           Scalar vertical_m_s2) noexcept {
    if (!open_) {
      now_ = Interval{};
      start_gyro_ = gyro_rad_s;
      open_ = true;
      return;
    }
    now_.seconds += dt_s;
    for (std::size_t i = 0; i < n_; ++i) now_.speed2[i] += dt_s * speed_rad_s[i] * speed_rad_s[i];
    now_.y[kVerticalRow] += dt_s * vertical_m_s2;
    if (now_.seconds < interval_s_) return;
    close(gyro_rad_s);
  }

  [[nodiscard]] const Sums& sums(EffectivenessRow row) const noexcept { return sums_[row]; }
  void fade(Scalar keep) noexcept {
    for (Sums& sums : sums_) sums.fade(keep, n_);
  }

 private:
  struct Interval {
    Scalar seconds = 0;
    Row speed2{};
    std::array<Scalar, kEffectivenessRows> y{};
  };

  void close(const std::array<Scalar, 3>& gyro) noexcept {
    for (std::size_t axis = 0; axis < 3; ++axis)
      now_.y[axis] = (gyro[axis] - start_gyro_[axis]) / now_.seconds;
    now_.y[kVerticalRow] /= now_.seconds;
    for (std::size_t i = 0; i < n_; ++i) now_.speed2[i] /= now_.seconds;
    if (has_previous_) accumulate();  // (2)
    previous_ = now_;
    has_previous_ = true;
    now_ = Interval{};
    start_gyro_ = gyro;
  }

  void accumulate() noexcept {  // (3)
    Row x{};
    for (std::size_t i = 0; i < n_; ++i) x[i] = now_.speed2[i] - previous_.speed2[i];
    for (std::size_t row = 0; row < kEffectivenessRows; ++row) {
      const Scalar y = now_.y[row] - previous_.y[row];
      Sums& sums = sums_[row];
      ++sums.intervals;
      sums.s += y * y;
      for (std::size_t i = 0; i < n_; ++i) {
        sums.c[i] += x[i] * y;
        for (std::size_t j = 0; j < n_; ++j) sums.m[i][j] += x[i] * x[j];
      }
    }
  }

  std::size_t n_;
  Scalar interval_s_;
  std::array<Sums, kEffectivenessRows> sums_{};
  Interval now_;
  Interval previous_;
  std::array<Scalar, 3> start_gyro_{};
  bool open_ = false;
  bool has_previous_ = false;
};

}  // namespace airworthy
