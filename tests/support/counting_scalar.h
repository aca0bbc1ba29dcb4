#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

namespace airworthy {

/// A double that counts what is done with it: each addition, subtraction, multiplication, division and root is one
/// operation. Comparisons, copies and changes of sign are none.
class CountingScalar {
 public:
  CountingScalar() = default;
  CountingScalar(double value) : value_{value} {}  // NOLINT(google-explicit-constructor): stands for a double

  [[nodiscard]] double value() const { return value_; }

  static inline std::int64_t operations = 0;

  friend CountingScalar operator+(CountingScalar a, CountingScalar b) { return counted(a.value_ + b.value_); }
  friend CountingScalar operator-(CountingScalar a, CountingScalar b) { return counted(a.value_ - b.value_); }
  friend CountingScalar operator*(CountingScalar a, CountingScalar b) { return counted(a.value_ * b.value_); }
  friend CountingScalar operator/(CountingScalar a, CountingScalar b) { return counted(a.value_ / b.value_); }
  friend CountingScalar operator-(CountingScalar a) { return -a.value_; }
  CountingScalar& operator+=(CountingScalar b) { return *this = *this + b; }
  CountingScalar& operator-=(CountingScalar b) { return *this = *this - b; }
  CountingScalar& operator*=(CountingScalar b) { return *this = *this * b; }
  CountingScalar& operator/=(CountingScalar b) { return *this = *this / b; }
  friend bool operator>(CountingScalar a, CountingScalar b) { return a.value_ > b.value_; }
  friend bool operator<(CountingScalar a, CountingScalar b) { return a.value_ < b.value_; }
  friend CountingScalar sqrt(CountingScalar a) { return counted(std::sqrt(a.value_)); }
  friend bool isfinite(CountingScalar a) { return std::isfinite(a.value_); }

 private:
  static CountingScalar counted(double value) {
    ++operations;
    return value;
  }

  double value_ = 0.0;
};

}  // namespace airworthy

namespace Eigen {
template <>
struct NumTraits<airworthy::CountingScalar> : NumTraits<double> {
  using Real = airworthy::CountingScalar;
  using NonInteger = airworthy::CountingScalar;
  using Nested = airworthy::CountingScalar;
};
}  // namespace Eigen
