#pragma once

#include <Eigen/Core>
#include <cmath>

namespace airworthy {

/// Matrix and vector whose size is known at run time and bounded at compile time: no heap.
template <class Scalar, int kMax>
using BoundedMatrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMax, kMax>;
template <class Scalar, int kMax>
using BoundedVector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1, Eigen::ColMajor, kMax, 1>;

/// Inverse of a symmetric positive definite matrix by its Cholesky factor, A = L·Lᵀ, A⁻¹ = L⁻ᵀ·L⁻¹. Only the
/// lower triangle of `a` is read. Returns false, with `inverse` untouched, where a pivot is not positive and
/// finite. Cost: n³ flops, no heap. Plain loops give the same bits on every machine.
template <class Scalar, int kMax>
[[nodiscard]] bool invert_positive_definite(const BoundedMatrix<Scalar, kMax>& a,
                                            BoundedMatrix<Scalar, kMax>& inverse) noexcept {
  const Eigen::Index n = a.rows();
  BoundedMatrix<Scalar, kMax> l = BoundedMatrix<Scalar, kMax>::Zero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    Scalar pivot = a(j, j);
    for (Eigen::Index k = 0; k < j; ++k) pivot -= l(j, k) * l(j, k);
    if (!(pivot > Scalar{0}) || !std::isfinite(pivot)) return false;
    l(j, j) = std::sqrt(pivot);
    for (Eigen::Index i = j + 1; i < n; ++i) {
      Scalar sum = a(i, j);
      for (Eigen::Index k = 0; k < j; ++k) sum -= l(i, k) * l(j, k);
      l(i, j) = sum / l(j, j);
    }
  }
  BoundedMatrix<Scalar, kMax> l_inverse = BoundedMatrix<Scalar, kMax>::Zero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    l_inverse(j, j) = Scalar{1} / l(j, j);
    for (Eigen::Index i = j + 1; i < n; ++i) {
      Scalar sum{0};
      for (Eigen::Index k = j; k < i; ++k) sum -= l(i, k) * l_inverse(k, j);
      l_inverse(i, j) = sum / l(i, i);
    }
  }
  inverse.resize(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      Scalar sum{0};
      for (Eigen::Index k = i; k < n; ++k) sum += l_inverse(k, i) * l_inverse(k, j);
      inverse(i, j) = sum;
      inverse(j, i) = sum;
    }
  }
  return true;
}

}  // namespace airworthy
