#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/estimators/update_status.h"
#include "core/math/cholesky.h"

namespace airworthy {

struct DelayedRegressionParams {
  int terms = 0;              ///< length of x
  int delay_ticks = 20;       ///< D: a sample is learned only D ticks after it was seen
  int refit_ticks = 5;        ///< θ and P are recomputed this often
  double huber_sigmas = 2.0;  ///< residuals beyond are down-weighted
  double ridge = 0.1;         ///< weight of the pull of each coefficient to 0, in samples of its mean square
  double extrapolation_gain = 20;  ///< κ: inflates the predicted σ where x was not seen before
  int scale_start = 60;            ///< innovations behind the first σ
  double scale_memory = 400;       ///< ticks over which σ adapts
};

/// Linear regression learned in flight, on samples D ticks old, so that a fault younger than D ticks is not
/// absorbed into the model that is to expose it.
///   Model      y = xᵀθ + e,  e heavy-tailed with scale σ                                              (1)
///   Learning   w = min(1, c·σ/|yⱼ − xⱼᵀθ|);  A ← A + w·xⱼxⱼᵀ;  b ← b + w·yⱼxⱼ,  j = k − D             (2)
///   Refit      P = (A + ρ·diag(max(Aᵢᵢ/n, 10⁻⁶)))⁻¹;  θ = P·b                                         (3)
///   Prediction e = y − xᵀθ;  s = σ·√(1 + κ·xᵀP·x)                                                     (4)
///   Scale      first σ = 1.4826·median|eⱼ|;
///              then σ² ← σ² + a·(1.1·min(|eⱼ|, 2.5σ)² − σ²), a = max(1/M, 1/m)                        (5)
///   Warm start A = N₀·G₀;  b = N₀·G₀·θ₀;  n = N₀;  σ = σ₀, m = N₀                                      (6)
///   Symbols    D delay_ticks, c huber_sigmas, ρ ridge, κ extrapolation_gain, M scale_memory;
///              θ₀, σ₀, G₀ = mean of x·xᵀ from earlier flights, N₀ the samples they are worth
///   Source     weighted least squares with Huber's weights; derivation in docs/equations/response.md
///   Valid for  terms ≤ kMaxTerms, delay_ticks < kMaxDelay; no heap; n³ flops per refit, n² per tick
template <class Scalar, int kMaxTerms, int kMaxDelay>
class DelayedRegression {
 public:
  using Vector = BoundedVector<Scalar, kMaxTerms>;
  using Matrix = BoundedMatrix<Scalar, kMaxTerms>;

  struct Prediction {
    Scalar expected = 0;    ///< xᵀθ
    Scalar innovation = 0;  ///< e
    Scalar sigma = 0;       ///< s
  };

  explicit DelayedRegression(const DelayedRegressionParams& params) noexcept
      : params_{params},
        a_{Matrix::Zero(params.terms, params.terms)},
        p_{Matrix::Zero(params.terms, params.terms)},
        b_{Vector::Zero(params.terms)},
        theta_{Vector::Zero(params.terms)} {}

  /// Predicts y from x, then learns the sample seen D ticks ago. kConverging while there is no σ yet:
  /// `prediction` is then meaningless.
  UpdateStatus update(const Vector& x, Scalar y, Prediction& prediction) noexcept {
    if (!x.allFinite() || !std::isfinite(y)) return UpdateStatus::kNotFinite;
    Sample& slot = ring_[static_cast<std::size_t>(next_)];
    const Sample oldest = slot;
    const bool learn = filled_ == params_.delay_ticks;

    prediction.expected = has_theta_ ? x.dot(theta_) : Scalar{0};
    prediction.innovation = y - prediction.expected;
    prediction.sigma =
        sigma_ * std::sqrt(Scalar{1} + static_cast<Scalar>(params_.extrapolation_gain) * x.dot(p_ * x));

    slot = Sample{x, y, prediction.innovation, has_theta_};
    next_ = (next_ + 1) % params_.delay_ticks;
    filled_ = std::min(filled_ + 1, params_.delay_ticks);
    if (learn) {
      if (oldest.predicted) adapt_scale(std::abs(oldest.innovation));
      accumulate(oldest);
    }
    if (++ticks_ % params_.refit_ticks == 0) refit();
    return sigma_ > Scalar{0} ? UpdateStatus::kFused : UpdateStatus::kConverging;
  }

  /// Predicts without learning anything, now or later: while a fault is active.
  UpdateStatus predict(const Vector& x, Scalar y, Prediction& prediction) const noexcept {
    if (!x.allFinite() || !std::isfinite(y)) return UpdateStatus::kNotFinite;
    prediction.expected = x.dot(theta_);
    prediction.innovation = y - prediction.expected;
    prediction.sigma =
        sigma_ * std::sqrt(Scalar{1} + static_cast<Scalar>(params_.extrapolation_gain) * x.dot(p_ * x));
    return sigma_ > Scalar{0} ? UpdateStatus::kFused : UpdateStatus::kConverging;
  }

  /// Starts anew from what earlier flights say (6). `gram` is terms × terms, symmetric and positive definite.
  /// False, with nothing changed, where it is not, or where sizes differ.
  [[nodiscard]] bool warm_start(const Vector& theta, const Matrix& gram, Scalar sigma,
                                std::int64_t worth_samples) noexcept {
    if (theta.size() != params_.terms || gram.rows() != params_.terms || gram.cols() != params_.terms ||
        !(sigma > Scalar{0}) || worth_samples < std::int64_t{3} * params_.terms) {
      return false;
    }
    if (Matrix inverse; !invert_positive_definite<Scalar, kMaxTerms>(gram, inverse)) return false;
    const auto weight = static_cast<Scalar>(worth_samples);
    a_ = weight * gram;
    b_ = weight * (gram * theta);
    learned_ = worth_samples;
    drop_unlearned();
    sigma_ = sigma;
    scale_count_ = std::max<int>(params_.scale_start, static_cast<int>(worth_samples));
    refit();
    return true;
  }

  /// Forgets the samples that were seen but not yet learned: after a fault, or a gap.
  void drop_unlearned() noexcept { filled_ = next_ = 0; }

  [[nodiscard]] const Vector& theta() const noexcept { return theta_; }
  [[nodiscard]] const Matrix& covariance_shape() const noexcept {
    return p_;
  }  ///< P of (3); times σ² it is cov(θ)
  [[nodiscard]] Scalar sigma() const noexcept { return sigma_; }
  [[nodiscard]] std::int64_t learned() const noexcept { return learned_; }
  [[nodiscard]] std::int64_t refits_refused() const noexcept { return refits_refused_; }

 private:
  struct Sample {
    Vector x = Vector::Zero(0);
    Scalar y = 0;
    Scalar innovation = 0;
    bool predicted = false;
  };

  void accumulate(const Sample& sample) noexcept {  // (2)
    Scalar weight{1};
    if (has_theta_ && sigma_ > Scalar{0}) {
      const Scalar error = std::abs(sample.y - sample.x.dot(theta_));
      const Scalar limit = static_cast<Scalar>(params_.huber_sigmas) * sigma_;
      if (error > limit) weight = limit / error;
    }
    for (Eigen::Index i = 0; i < sample.x.size(); ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        a_(i, j) += weight * sample.x(i) * sample.x(j);
        a_(j, i) = a_(i, j);
      }
      b_(i) += weight * sample.y * sample.x(i);
    }
    ++learned_;
  }

  void refit() noexcept {  // (3)
    if (learned_ < std::int64_t{3} * params_.terms) return;
    Matrix regularised = a_;
    for (Eigen::Index i = 0; i < a_.rows(); ++i) {
      regularised(i, i) += static_cast<Scalar>(params_.ridge) *
                           std::max(a_(i, i) / static_cast<Scalar>(learned_), static_cast<Scalar>(1e-6));
    }
    if (!invert_positive_definite<Scalar, kMaxTerms>(regularised, p_)) {
      ++refits_refused_;
      return;
    }
    theta_ = p_ * b_;
    has_theta_ = true;
  }

  void adapt_scale(Scalar error) noexcept {  // (5)
    if (scale_count_ < params_.scale_start) {
      starting_errors_[static_cast<std::size_t>(scale_count_)] = error;
      if (++scale_count_ < params_.scale_start) return;
      Scalar* const first = starting_errors_.data();
      Scalar* const middle = first + params_.scale_start / 2;
      std::nth_element(first, middle, first + params_.scale_start);
      sigma_ = std::max(static_cast<Scalar>(1.4826) * *middle, static_cast<Scalar>(1e-6));
      return;
    }
    ++scale_count_;
    const Scalar gain = std::max(Scalar{1} / static_cast<Scalar>(params_.scale_memory),
                                 Scalar{1} / static_cast<Scalar>(scale_count_));
    const Scalar limited = std::min(error, static_cast<Scalar>(2.5) * sigma_);
    const Scalar variance = sigma_ * sigma_;
    sigma_ = std::sqrt(variance + gain * (static_cast<Scalar>(1.1) * limited * limited - variance));
  }

  static constexpr int kMostStartingErrors = 256;

  DelayedRegressionParams params_;
  Matrix a_;
  Matrix p_;
  Vector b_;
  Vector theta_;
  Scalar sigma_ = 0;  ///< 0 until known
  bool has_theta_ = false;
  std::array<Sample, static_cast<std::size_t>(kMaxDelay)> ring_{};
  int next_ = 0;
  int filled_ = 0;
  std::int64_t ticks_ = 0;
  std::int64_t learned_ = 0;
  std::int64_t refits_refused_ = 0;
  std::array<Scalar, kMostStartingErrors> starting_errors_{};
  int scale_count_ = 0;
};

}  // namespace airworthy
