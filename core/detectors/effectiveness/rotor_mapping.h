#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/estimators/effectiveness/control_regression.h"

namespace airworthy::effectiveness {

/// Judges whether the rotors are numbered, and the axes pointing, as the vehicle file says.
///   Numbering   R² of roll and pitch for the described rows against two rotors swapped, all shifted along the frame,
///               order reversed, and an axis upside down. Not the sense of rotation: what yaw shows within 10 to
///               20 ms is less than late telemetry hides, and the judgement of losses does not use it
///   Odds        n/4·ln((1 − R²_a)/(1 − R²_b)) of b over a, with n intervals of the sums, whose changes share ends
///   Implausible odds of another over the described > 12;  plausible: of the described over all others > 4
/// Healthy flights explain most of roll and pitch by themselves, so that another numbering cannot win there; a lost
/// rotor changes one column, which no renumbering repairs.
enum class Mapping : std::uint8_t { kUnknown, kPlausible, kWrongNumbers };

template <class Scalar, std::size_t kMost = kMaxRotors>
class RotorMapping {
 public:
  using Regression = ControlRegression<Scalar, kMost>;
  using Row = typename Regression::Row;

  static constexpr std::int64_t kLeastIntervals = 20;
  static constexpr std::int64_t kMostIntervals = 2500;  ///< sums fade: older ones no longer count
  static constexpr Scalar kLeastExplained = Scalar(0.2);
  static constexpr Scalar kImplausible = Scalar(12);  ///< nats
  static constexpr Scalar kPlausible = Scalar(4);

  [[nodiscard]] static Mapping judge(const Regression& tilt,
                                     const EffectivenessMatrix<Scalar>& matrix) noexcept {
    const std::size_t n = matrix.rotor_count;
    const std::int64_t intervals = 2 * tilt.sums(kRollRow).intervals;
    if (intervals < 2 * kLeastIntervals) return Mapping::kUnknown;
    const Scalar described = tilting(tilt, matrix, identity(n), 1, 1);
    const Scalar other = best_numbering(tilt, matrix);
    if (other > kLeastExplained && odds(other, described, intervals) > kImplausible)
      return Mapping::kWrongNumbers;
    const bool plausible = described > kLeastExplained && odds(described, other, intervals) > kPlausible;
    return plausible ? Mapping::kPlausible : Mapping::kUnknown;
  }

 private:
  using Order = std::array<std::size_t, kMost>;

  static Order identity(std::size_t n) noexcept {
    Order order{};
    for (std::size_t i = 0; i < n; ++i) order[i] = i;
    return order;
  }

  /// Of `better` over `worse`, two values of R².
  static Scalar odds(Scalar better, Scalar worse, std::int64_t intervals) noexcept {
    const auto left = [](Scalar explained) { return std::max(Scalar{1} - explained, Scalar(1e-6)); };
    return static_cast<Scalar>(std::min(intervals, kMostIntervals)) / Scalar{4} *
           std::log(left(worse) / left(better));
  }

  /// Mean R² of roll and pitch, weighted by nothing: both must move.
  static Scalar tilting(const Regression& regression, const EffectivenessMatrix<Scalar>& matrix,
                        const Order& order, Scalar roll_sign, Scalar pitch_sign) noexcept {
    Row roll{};
    Row pitch{};
    for (std::size_t i = 0; i < matrix.rotor_count; ++i) {
      roll[i] = roll_sign * matrix.per_speed2[kRollRow][order[i]];
      pitch[i] = pitch_sign * matrix.per_speed2[kPitchRow][order[i]];
    }
    return (regression.sums(kRollRow).explained(roll, matrix.rotor_count) +
            regression.sums(kPitchRow).explained(pitch, matrix.rotor_count)) /
           Scalar{2};
  }

  static Scalar best_numbering(const Regression& regression,
                               const EffectivenessMatrix<Scalar>& matrix) noexcept {
    const std::size_t n = matrix.rotor_count;
    Scalar best{0};
    const auto consider = [&](const Order& order, Scalar roll, Scalar pitch) {
      best = std::max(best, tilting(regression, matrix, order, roll, pitch));
    };
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        Order order = identity(n);
        std::swap(order[i], order[j]);
        consider(order, 1, 1);
      }
    }
    for (std::size_t shift = 0; shift < n; ++shift) {
      Order forward{};
      Order reversed{};
      for (std::size_t i = 0; i < n; ++i) {
        forward[i] = (i + shift) % n;
        reversed[i] = (n - 1 - i + shift) % n;
      }
      if (shift > 0) consider(forward, 1, 1);
      consider(reversed, 1, 1);
    }
    consider(identity(n), -1, 1);
    consider(identity(n), 1, -1);
    consider(identity(n), -1, -1);
    return best;
  }
};

}  // namespace airworthy::effectiveness
