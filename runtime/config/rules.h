#pragma once

#include <cstddef>
#include <limits>
#include <string>

namespace airworthy::rt {

/// Which numbers are allowed; bounds belong to the range unless said otherwise. NaN and infinity are
/// rejected, also by the default range, unless or_not_finite().
class Range {
 public:
  constexpr Range() = default;
  constexpr Range(double min, double max) : min_{min}, max_{max} {}

  static constexpr Range at_least(double min) { return {min, kInfinity}; }
  static constexpr Range at_most(double max) { return {-kInfinity, max}; }
  static constexpr Range above(double min) { return at_least(min).without_min(); }
  static constexpr Range below(double max) { return at_most(max).without_max(); }
  /// Neither bound belongs to it.
  static constexpr Range between(double min, double max) {
    return Range{min, max}.without_min().without_max();
  }

  [[nodiscard]] constexpr Range without_min() const {
    Range result = *this;
    result.min_excluded_ = true;
    return result;
  }
  [[nodiscard]] constexpr Range without_max() const {
    Range result = *this;
    result.max_excluded_ = true;
    return result;
  }
  /// NaN and infinity are values too.
  [[nodiscard]] constexpr Range or_not_finite() const {
    Range result = *this;
    result.not_finite_allowed_ = true;
    return result;
  }
  /// This range, but no wider than [min, max].
  [[nodiscard]] constexpr Range within(double min, double max) const {
    Range result = *this;
    if (min > min_) {
      result.min_ = min;
      result.min_excluded_ = false;
    }
    if (max < max_) {
      result.max_ = max;
      result.max_excluded_ = false;
    }
    return result;
  }

  [[nodiscard]] bool contains(double value) const;
  /// What a value must do: "must lie in [0.01, 10]", "must be greater than 0", "must be finite".
  [[nodiscard]] std::string requirement(double value) const;

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  double min_ = -kInfinity;
  double max_ = kInfinity;
  bool min_excluded_ = false;
  bool max_excluded_ = false;
  bool not_finite_allowed_ = false;
};

/// How many elements an array may have.
struct Count {
  static constexpr std::size_t kAnyNumber = std::numeric_limits<std::size_t>::max();

  static constexpr Count exactly(std::size_t n) { return {n, n}; }
  static constexpr Count at_least(std::size_t n) { return {n, kAnyNumber}; }
  static constexpr Count at_most(std::size_t n) { return {0, n}; }

  [[nodiscard]] constexpr bool contains(std::size_t n) const { return n >= min && n <= max; }
  /// "must have 3 elements", "must have 1 to 8 elements".
  [[nodiscard]] std::string requirement() const;

  std::size_t min = 0;
  std::size_t max = kAnyNumber;
};

}  // namespace airworthy::rt
