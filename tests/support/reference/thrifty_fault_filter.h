#pragma once

#include <Eigen/Core>

#include "core/math/triangular.h"

namespace airworthy::reference {

/// The same augmented Kalman filter as an attentive programmer writes it. Symmetric results are computed once, and the
/// gain comes from the Cholesky factor of S. With `kBlocks` no product with a known 0 or 1 of Φ and [C, 0] is formed
/// either. Only there to be counted and timed beside the others.
template <class Scalar, int kStates, int kInputs, int kOutputs, bool kBlocks>
class ThriftyFaultFilter {
 public:
  static constexpr int kSize = kStates + kInputs;
  template <class Prior>
  explicit ThriftyFaultFilter(const Prior& prior) {
    z_.setConstant(Scalar{0});
    p_.setConstant(Scalar{0});
    for (int i = 0; i < kStates; ++i) {
      z_(i) = prior.state(i);
      for (int j = 0; j < kStates; ++j) p_(i, j) = prior.state_covariance(i, j);
    }
    for (int j = 0; j < kInputs; ++j) {
      z_(kStates + j) = prior.fault(j);
      p_(kStates + j, kStates + j) = prior.fault_variance(j);
    }
  }

  template <class Transition>
  void predict(const Transition& model) {
    Eigen::Matrix<Scalar, kSize, kSize> phi;
    for (int i = 0; i < kSize; ++i) {
      for (int j = 0; j < kSize; ++j) phi(i, j) = Scalar{i == j ? 1.0 : 0.0};
    }
    for (int i = 0; i < kStates; ++i) {
      for (int j = 0; j < kStates; ++j) phi(i, j) = model.a(i, j);
      for (int j = 0; j < kInputs; ++j) phi(i, kStates + j) = -(model.b(i, j) * model.u(j));
    }
    // Rows of Φ that are not rows of the identity.
    constexpr int kMoving = kBlocks ? kStates : kSize;
    Eigen::Matrix<Scalar, kSize, 1> z = z_;
    Eigen::Matrix<Scalar, kSize, kSize> pp = p_;  // Φ·P
    for (int i = 0; i < kMoving; ++i) {
      z(i) = row(phi, i, z_, 0);
      for (int j = 0; j < kSize; ++j) pp(i, j) = row(phi, i, p_, j);
    }
    for (int i = 0; i < kStates; ++i) z(i) += row(model.b, i, model.u, 0) + model.known(i);
    z_ = z;
    for (int i = 0; i < kSize; ++i) {
      for (int j = 0; j <= i; ++j) {
        Scalar sum = pp(j, i);
        if (j < kMoving) {
          sum = pp(i, 0) * phi(j, 0);
          for (int k = 1; k < kSize; ++k) sum += pp(i, k) * phi(j, k);
        }
        p_(i, j) = p_(j, i) = sum;
      }
    }
    for (int i = 0; i < kStates; ++i) {
      for (int j = 0; j <= i; ++j) p_(i, j) = p_(j, i) = p_(i, j) + model.noise(i, j);
    }
    for (int j = 0; j < kInputs; ++j) p_(kStates + j, kStates + j) += model.fault_noise_variance(j);
  }

  template <class Measurement>
  void correct(const Measurement& measurement) {
    constexpr int kSeen = kBlocks ? kStates : kSize;  // columns of [C, 0] that are not known to be 0
    Eigen::Matrix<Scalar, kOutputs, kSeen> c;
    Eigen::Matrix<Scalar, kOutputs, kSize> m;
    Eigen::Matrix<Scalar, kOutputs, 1> e;
    Eigen::Matrix<Scalar, kOutputs, kOutputs> s;
    for (int i = 0; i < kOutputs; ++i) {
      for (int j = 0; j < kSeen; ++j) c(i, j) = j < kStates ? measurement.c(i, j) : Scalar{0};
      e(i) = measurement.y(i) - row(c, i, z_, 0);
      for (int j = 0; j < kSize; ++j) m(i, j) = row(c, i, p_, j);
    }
    for (int i = 0; i < kOutputs; ++i) {
      for (int j = 0; j <= i; ++j) {
        Scalar sum = measurement.noise(i, j);
        for (int k = 0; k < kSeen; ++k) sum += m(i, k) * c(j, k);
        s(i, j) = sum;
      }
    }
    Eigen::Matrix<Scalar, kOutputs, kOutputs> l;
    if (!factor_cholesky(s, l)) return;
    solve_lower(l, m);
    solve_lower(l, e);
    nis_ = Scalar{0};
    for (int k = 0; k < kOutputs; ++k) nis_ += e(k) * e(k);
    for (int i = 0; i < kSize; ++i) {
      for (int k = 0; k < kOutputs; ++k) z_(i) += m(k, i) * e(k);
      for (int j = 0; j <= i; ++j) {
        Scalar sum = p_(i, j);
        for (int k = 0; k < kOutputs; ++k) sum -= m(k, i) * m(k, j);
        p_(i, j) = p_(j, i) = sum;
      }
    }
  }

  [[nodiscard]] const Eigen::Matrix<Scalar, kSize, 1>& estimate() const { return z_; }
  [[nodiscard]] Scalar nis() const { return nis_; }

 private:
  template <class A, class B>
  static Scalar row(const A& a, int i, const B& b, int j) {
    Scalar sum = a(i, 0) * b(0, j);
    for (int k = 1; k < static_cast<int>(A::ColsAtCompileTime); ++k) sum += a(i, k) * b(k, j);
    return sum;
  }

  Eigen::Matrix<Scalar, kSize, 1> z_;
  Eigen::Matrix<Scalar, kSize, kSize> p_;
  Scalar nis_{0};
};

}  // namespace airworthy::reference
