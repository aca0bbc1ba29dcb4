#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace airworthy::reference {

/// A matrix of run-time size with the textbook's operations, each with every one of its multiplications.
template <class Scalar>
class DenseMatrix {
 public:
  DenseMatrix(int rows, int columns)
      : rows_{rows},
        columns_{columns},
        values_(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns), Scalar{0}) {}
  static DenseMatrix identity(int size) {
    DenseMatrix m{size, size};
    for (int i = 0; i < size; ++i) m(i, i) = Scalar{1};
    return m;
  }
  template <class Matrix>
  static DenseMatrix from(const Matrix& other) {
    DenseMatrix m{static_cast<int>(other.rows()), static_cast<int>(other.cols())};
    for (int i = 0; i < m.rows_; ++i) {
      for (int j = 0; j < m.columns_; ++j) m(i, j) = other(i, j);
    }
    return m;
  }

  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] int columns() const { return columns_; }
  Scalar& operator()(int i, int j) { return values_[at(i, j)]; }
  const Scalar& operator()(int i, int j) const { return values_[at(i, j)]; }

  /// Copies `block` to where its first element is at (i, j).
  void set(int i, int j, const DenseMatrix& block) {
    for (int r = 0; r < block.rows_; ++r) {
      for (int c = 0; c < block.columns_; ++c) (*this)(i + r, j + c) = block(r, c);
    }
  }

  // Not inlined: g++ 12 otherwise warns of indices that the sizes exclude.
  [[gnu::noinline]] friend DenseMatrix operator*(const DenseMatrix& a, const DenseMatrix& b) {
    DenseMatrix product{a.rows_, b.columns_};
    for (int i = 0; i < a.rows_; ++i) {
      for (int j = 0; j < b.columns_; ++j) {
        Scalar sum = a(i, 0) * b(0, j);
        for (int k = 1; k < a.columns_; ++k) sum += a(i, k) * b(k, j);
        product(i, j) = sum;
      }
    }
    return product;
  }
  friend DenseMatrix operator+(DenseMatrix a, const DenseMatrix& b) {
    for (std::size_t i = 0; i < a.values_.size(); ++i) a.values_[i] += b.values_[i];
    return a;
  }
  friend DenseMatrix operator-(DenseMatrix a, const DenseMatrix& b) {
    for (std::size_t i = 0; i < a.values_.size(); ++i) a.values_[i] -= b.values_[i];
    return a;
  }
  [[nodiscard]] DenseMatrix transposed() const {
    DenseMatrix t{columns_, rows_};
    for (int i = 0; i < rows_; ++i) {
      for (int j = 0; j < columns_; ++j) t(j, i) = (*this)(i, j);
    }
    return t;
  }
  /// By Gauss and Jordan with a diagonal pivot: for positive definite matrices.
  [[nodiscard]] DenseMatrix inverse() const {
    DenseMatrix a = *this;
    DenseMatrix result = identity(rows_);
    for (int k = 0; k < rows_; ++k) {
      const Scalar pivot = a(k, k);
      for (int j = 0; j < rows_; ++j) {
        if (j > k) a(k, j) /= pivot;
        if (j <= k) result(k, j) /= pivot;
      }
      for (int i = 0; i < rows_; ++i) {
        if (i == k) continue;
        const Scalar factor = a(i, k);
        for (int j = k + 1; j < rows_; ++j) a(i, j) -= factor * a(k, j);
        for (int j = 0; j <= k; ++j) result(i, j) -= factor * result(k, j);
      }
    }
    return result;
  }

 private:
  [[nodiscard]] std::size_t at(int i, int j) const { return static_cast<std::size_t>(i * columns_ + j); }

  int rows_;
  int columns_;
  std::vector<Scalar> values_;
};

/// The Kalman filter of the augmented state z = [x; γ], as any textbook prints it:
///   z' = Φ·z + Γ·u + g,  Φ = [A, −B·U; 0, I];  P⁻ = Φ·P·Φᵀ + diag(Q, q)
///   K = P⁻·Cᵀ·(C·P⁻·Cᵀ + R)⁻¹;  z = z⁻ + K·(y − C·z⁻);  P = (I − K·C)·P⁻
/// What the multi-stage observer must equal. No product is left out because a factor is known to be 0 or 1.
template <class Scalar>
class AugmentedFaultFilter {
 public:
  using Matrix = DenseMatrix<Scalar>;

  template <class Prior>
  explicit AugmentedFaultFilter(const Prior& prior)
      : states_{static_cast<int>(prior.state.rows())},
        inputs_{static_cast<int>(prior.fault.rows())},
        z_{states_ + inputs_, 1},
        p_{states_ + inputs_, states_ + inputs_} {
    z_.set(0, 0, Matrix::from(prior.state));
    z_.set(states_, 0, Matrix::from(prior.fault));
    p_.set(0, 0, Matrix::from(prior.state_covariance));
    for (int j = 0; j < inputs_; ++j) p_(states_ + j, states_ + j) = prior.fault_variance(j);
  }

  template <class Transition>
  void predict(const Transition& model) {
    const int size = states_ + inputs_;
    Matrix phi = Matrix::identity(size);
    Matrix gamma{size, inputs_};
    Matrix known{size, 1};
    Matrix noise{size, size};
    phi.set(0, 0, Matrix::from(model.a));
    for (int i = 0; i < states_; ++i) {
      for (int j = 0; j < inputs_; ++j) phi(i, states_ + j) = -(model.b(i, j) * model.u(j));
    }
    gamma.set(0, 0, Matrix::from(model.b));
    known.set(0, 0, Matrix::from(model.known));
    noise.set(0, 0, Matrix::from(model.noise));
    for (int j = 0; j < inputs_; ++j) noise(states_ + j, states_ + j) = model.fault_noise_variance(j);
    z_ = phi * z_ + gamma * Matrix::from(model.u) + known;
    p_ = phi * p_ * phi.transposed() + noise;
  }

  template <class Measurement>
  void correct(const Measurement& measurement) {
    Matrix c{static_cast<int>(measurement.c.rows()), states_ + inputs_};
    c.set(0, 0, Matrix::from(measurement.c));
    innovation_ = Matrix::from(measurement.y) - c * z_;
    const Matrix pc = p_ * c.transposed();
    innovation_covariance_ = c * pc + Matrix::from(measurement.noise);
    const Matrix s_inverse = innovation_covariance_.inverse();
    const Matrix k = pc * s_inverse;
    nis_ = (innovation_.transposed() * s_inverse * innovation_)(0, 0);
    z_ = z_ + k * innovation_;
    p_ = (Matrix::identity(states_ + inputs_) - k * c) * p_;
  }

  [[nodiscard]] const Matrix& estimate() const { return z_; }
  [[nodiscard]] const Matrix& covariance() const { return p_; }
  [[nodiscard]] const Matrix& innovation() const { return innovation_; }
  [[nodiscard]] const Matrix& innovation_covariance() const { return innovation_covariance_; }
  [[nodiscard]] Scalar nis() const { return nis_; }

 private:
  int states_;
  int inputs_;
  Matrix z_;
  Matrix p_;
  Matrix innovation_{0, 0};
  Matrix innovation_covariance_{0, 0};
  Scalar nis_{0};
};

}  // namespace airworthy::reference
