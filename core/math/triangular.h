#pragma once

#include <Eigen/Core>
#include <cmath>

namespace airworthy {

/// Lower triangular L with A = L·Lᵀ, of which only the lower triangle of A is read and that of `l` written. False
/// where a pivot is not positive and finite: A is not positive definite, or not finite. n³/3 flops.
template <class Scalar, int kSize>
[[nodiscard]] bool factor_cholesky(const Eigen::Matrix<Scalar, kSize, kSize>& a,
                                   Eigen::Matrix<Scalar, kSize, kSize>& l) noexcept {
  using std::isfinite;
  using std::sqrt;
  for (int j = 0; j < kSize; ++j) {
    Scalar pivot = a(j, j);
    for (int k = 0; k < j; ++k) pivot -= l(j, k) * l(j, k);
    if (!(pivot > Scalar{0}) || !isfinite(pivot)) return false;
    l(j, j) = sqrt(pivot);
    const Scalar inverse = Scalar{1} / l(j, j);
    for (int i = j + 1; i < kSize; ++i) {
      Scalar sum = a(i, j);
      for (int k = 0; k < j; ++k) sum -= l(i, k) * l(j, k);
      l(i, j) = sum * inverse;
    }
  }
  return true;
}

/// x ← L⁻¹·x, column by column. n² flops each.
template <class Scalar, int kSize, int kColumns>
void solve_lower(const Eigen::Matrix<Scalar, kSize, kSize>& l,
                 Eigen::Matrix<Scalar, kSize, kColumns>& x) noexcept {
  for (int i = 0; i < kSize; ++i) {
    const Scalar inverse = Scalar{1} / l(i, i);
    for (int c = 0; c < kColumns; ++c) {
      Scalar sum = x(i, c);
      for (int k = 0; k < i; ++k) sum -= l(i, k) * x(k, c);
      x(i, c) = sum * inverse;
    }
  }
}

/// A⁻¹ = L⁻ᵀ·L⁻¹, both triangles. 2n³/3 flops.
template <class Scalar, int kSize>
void invert_from_factor(const Eigen::Matrix<Scalar, kSize, kSize>& l,
                        Eigen::Matrix<Scalar, kSize, kSize>& inverse) noexcept {
  Eigen::Matrix<Scalar, kSize, kSize> m;  // L⁻¹, lower triangle
  for (int j = 0; j < kSize; ++j) {
    m(j, j) = Scalar{1} / l(j, j);
    for (int i = j + 1; i < kSize; ++i) {
      Scalar sum = l(i, j) * m(j, j);
      for (int k = j + 1; k < i; ++k) sum += l(i, k) * m(k, j);
      m(i, j) = -sum / l(i, i);
    }
  }
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j <= i; ++j) {
      Scalar sum = m(i, i) * m(i, j);
      for (int k = i + 1; k < kSize; ++k) sum += m(k, i) * m(k, j);
      inverse(i, j) = sum;
      inverse(j, i) = sum;
    }
  }
}

}  // namespace airworthy
