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
///               order reversed, and an axis upside down. For the sense of rotation see SpinRegression
///   Odds        n/4·ln((1 − R²_a)/(1 − R²_b)) of b over a, with n intervals of the sums, whose changes share ends
///   Implausible odds of another over the described above the threshold that follows from the rate of false alarms;
///               plausible: of the described over all others > 4
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
  static constexpr Scalar kPlausible = Scalar(4);  ///< nats
  using Order = std::array<std::size_t, kMost>;

  struct Verdict {
    Mapping mapping = Mapping::kUnknown;
    // What explains the motion best: rotor i acts as the file describes rotor order[i]; −1: the axis is upside down.
    Order order{};
    Scalar roll_sign = 1;
    Scalar pitch_sign = 1;
  };

  /// How many other numberings are compared.
  [[nodiscard]] static constexpr std::size_t hypotheses(std::size_t n) noexcept {
    return n * (n - 1) / 2 + 2 * n + 2;
  }

  [[nodiscard]] static Verdict judge(const Regression& tilt, const EffectivenessMatrix<Scalar>& matrix,
                                     Scalar threshold) noexcept {
    const std::size_t n = matrix.rotor_count;
    const std::int64_t intervals = 2 * tilt.sums(kRollRow).intervals;
    Verdict verdict;
    if (intervals < 2 * kLeastIntervals) return verdict;
    const Scalar described = tilting(tilt, matrix, identity(n), 1, 1);
    const Scalar other = best_numbering(tilt, matrix, verdict);
    if (other > kLeastExplained && odds(other, described, intervals) > threshold) {
      verdict.mapping = Mapping::kWrongNumbers;
    } else if (described > kLeastExplained && odds(described, other, intervals) > kPlausible) {
      verdict.mapping = Mapping::kPlausible;
    }
    return verdict;
  }

 private:
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

  static Scalar best_numbering(const Regression& regression, const EffectivenessMatrix<Scalar>& matrix,
                               Verdict& verdict) noexcept {
    const std::size_t n = matrix.rotor_count;
    Scalar best{0};
    const auto consider = [&](const Order& order, Scalar roll, Scalar pitch) {
      const Scalar explained = tilting(regression, matrix, order, roll, pitch);
      if (explained <= best) return;
      best = explained;
      verdict.order = order;
      verdict.roll_sign = roll;
      verdict.pitch_sign = pitch;
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
