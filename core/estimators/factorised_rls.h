#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/estimators/update_status.h"
#include "core/math/cholesky.h"

namespace airworthy {

struct FactorisedRlsParams {
  int terms = 0;                ///< n, length of x; at most kMaxTerms
  double prior_variance = 1e6;  ///< p₀ > 0: variance of each coefficient about 0 at first, in noise variances
  double forgetting = 1.0;      ///< λ in (0, 1]; 1 = every sample counts for ever
  /// η: a sample is learned only if xᵀPx ≥ η·(1 − λ). At 1 no sample leaves the prediction at its own x less
  /// certain than before; 0 = no such gate. Without forgetting it has no effect.
  double excitation_floor = 1.0;
};

/// Recursive least squares on the factors of P = U·D·Uᵀ (U unit upper triangular, D diagonal): P is never
/// formed, so that no rounding can make it asymmetric or indefinite.
///   Model       y = xᵀθ + e,  e ~ N(0, σ²),  prior θ ~ N(0, σ²·p₀·I)                                   (1)
///   Innovation  e = y − xᵀθ;  f = Uᵀx;  q = xᵀPx = Σ dⱼfⱼ²;  variance of e: σ²·(1 + q/λ)                 (2)
///   Update      α₀ = λ;  for j = 1…n:  g = dⱼfⱼ;  αⱼ = αⱼ₋₁ + fⱼg;  dⱼ ← dⱼ·αⱼ₋₁/(αⱼ·λ);
///               for i < j:  Uᵢⱼ ← Uᵢⱼ − bᵢ·fⱼ/αⱼ₋₁, bᵢ ← bᵢ + Uᵢⱼ(old)·g;  bⱼ = g;  at the end
///               θ ← θ + b·e/αₙ                                                                         (3)
///   Forgetting  with λ < 1 each learned sample also observes one coefficient c, in turn, to be 0, with the
///               information (1 − λⁿ)/p₀: (3) with x = unit vector c, e = −θ_c, α₀ = p₀/(1 − λⁿ)          (4)
///   Gate        no update where q < max(η·(1 − λ), ε), ε the rounding unit of Scalar                    (5)
///   Scale       σ² = mean of e²/(1 + q/λ) with weights λᵏ, without the first n samples                  (6)
///   Source      G. J. Bierman, Factorization Methods for Discrete Sequential Estimation (1977), by name;
///               derived, with (4) and (5), in docs/equations/rls.md
///   Symbols     θ → theta_; U → u_, by columns, without its diagonal; D → d_; λ → lambda_; p₀, η as in
///               FactorisedRlsParams
///   Deviations  plain exponential forgetting lets P of an unexcited coefficient grow without bound; (4) ends
///               that at p₀·λ⁻ⁿ, the prior, and (5) freezes everything where nothing is to be learned
///   Valid for   terms ≤ kMaxTerms; q/ε within the range of Scalar: a sample beyond it is refused
///   Cost        without forgetting 1.5·n² multiply-adds and n + 1 divisions; with it at most twice that. No
///               heap. Plain loops: the same bits on every machine
template <class Scalar, int kMaxTerms>
class FactorisedRls {
 public:
  using Vector = BoundedVector<Scalar, kMaxTerms>;

  struct Innovation {
    Scalar expected = 0;        ///< xᵀθ before the update
    Scalar innovation = 0;      ///< e
    Scalar variance_ratio = 0;  ///< 1 + q/λ: variance of e in noise variances
    Scalar largest_change = 0;  ///< ‖K·e‖∞: what the sample did to any coefficient; 0 if not learned
  };

  explicit FactorisedRls(const FactorisedRlsParams& params) noexcept
      : terms_{params.terms},
        lambda_{static_cast<Scalar>(params.forgetting)},
        prior_variance_{static_cast<Scalar>(params.prior_variance)},
        least_information_{std::max(static_cast<Scalar>(params.excitation_floor * (1.0 - params.forgetting)),
                                    std::numeric_limits<Scalar>::epsilon())},
        theta_{Vector::Zero(params.terms)} {
    std::fill_n(d_.begin(), terms_, prior_variance_);
    if (lambda_ < Scalar{1}) {
      recall_variance_ = prior_variance_ / (Scalar{1} - std::pow(lambda_, static_cast<Scalar>(terms_)));
    }
  }

  /// Predicts y from x, then learns the sample. kNotExcited: predicted only. kNotFinite: `innovation` is
  /// meaningless.
  UpdateStatus update(const Vector& x, Scalar y, Innovation& innovation) noexcept {
    Row f;
    Scalar information;
    if (!project(x, y, f, information, innovation)) {
      ++refused_;
      return UpdateStatus::kNotFinite;
    }
    if (information < least_information_) {  // (5)
      ++unexcited_;
      return UpdateStatus::kNotExcited;
    }
    innovation.largest_change = fold(f, 0, lambda_, innovation.innovation);
    for (int j = 0; j < terms_; ++j) d_[index(j)] /= lambda_;
    if (lambda_ < Scalar{1}) recall_prior();
    if (fused_ >= terms_) adapt_scale(innovation);
    ++fused_;
    return UpdateStatus::kFused;
  }

  /// Predicts without learning.
  UpdateStatus predict(const Vector& x, Scalar y, Innovation& innovation) const noexcept {
    Row f;
    Scalar information;
    return project(x, y, f, information, innovation) ? UpdateStatus::kFused : UpdateStatus::kNotFinite;
  }

  [[nodiscard]] const Vector& theta() const noexcept { return theta_; }
  /// P(i, j) of cov(θ) = σ²·P. Cost: n multiply-adds.
  [[nodiscard]] Scalar covariance(int i, int j) const noexcept {
    Scalar sum{0};
    for (int k = std::max(i, j); k < terms_; ++k) sum += factor(i, k) * d_[index(k)] * factor(j, k);
    return sum;
  }
  /// U(i, j).
  [[nodiscard]] Scalar factor(int i, int j) const noexcept {
    if (i == j) return Scalar{1};
    return i < j ? u_[column(j) + index(i)] : Scalar{0};
  }
  /// D(j): positive and normal after any sequence of samples.
  [[nodiscard]] Scalar diagonal(int j) const noexcept { return d_[index(j)]; }
  /// σ² of (6); NaN until known.
  [[nodiscard]] Scalar noise_variance() const noexcept {
    return scale_weight_ > Scalar{0} ? scale_sum_ / scale_weight_ : std::numeric_limits<Scalar>::quiet_NaN();
  }
  [[nodiscard]] std::int64_t fused() const noexcept { return fused_; }
  [[nodiscard]] std::int64_t unexcited() const noexcept { return unexcited_; }
  [[nodiscard]] std::int64_t refused() const noexcept { return refused_; }

 private:
  using Row = std::array<Scalar, static_cast<std::size_t>(kMaxTerms)>;

  static constexpr std::size_t index(int i) noexcept { return static_cast<std::size_t>(i); }
  /// Where column j of U begins: columns 0 … j − 1 have 0 … j − 1 entries above the diagonal.
  static constexpr std::size_t column(int j) noexcept { return index(j * (j - 1) / 2); }

  // (2). False if anything is not finite, or the update would underflow the smallest dⱼ.
  bool project(const Vector& x, Scalar y, Row& f, Scalar& information,
               Innovation& innovation) const noexcept {
    Scalar expected{0};
    Scalar least_d = std::numeric_limits<Scalar>::max();
    information = Scalar{0};
    for (int j = 0; j < terms_; ++j) {
      const Scalar* const u = u_.data() + column(j);
      Scalar sum = x(j);
      for (int i = 0; i < j; ++i) sum += u[i] * x(i);
      f[index(j)] = sum;
      information += d_[index(j)] * sum * sum;
      least_d = std::min(least_d, d_[index(j)]);
      expected += x(j) * theta_(j);
    }
    innovation.expected = expected;
    innovation.innovation = y - expected;
    innovation.variance_ratio = Scalar{1} + information / lambda_;
    innovation.largest_change = Scalar{0};
    // αⱼ₋₁/αⱼ ≥ λ/αₙ bounds every new dⱼ from below. |bᵢ·e/αₙ| ≤ √Pᵢᵢ·|e|, so a finite e² keeps θ finite.
    return std::isfinite(innovation.variance_ratio) &&
           std::isfinite(innovation.innovation * innovation.innovation) &&
           least_d / innovation.variance_ratio >= std::numeric_limits<Scalar>::min();
  }

  // (3), but for the division of D by λ. Entries of f before `first` are 0. Returns ‖b·e/αₙ‖∞.
  Scalar fold(const Row& f, int first, Scalar alpha, Scalar e) noexcept {
    Row b{};
    for (int j = first; j < terms_; ++j) {
      const Scalar g = d_[index(j)] * f[index(j)];
      const Scalar before = alpha;
      alpha += f[index(j)] * g;
      d_[index(j)] *= before / alpha;
      const Scalar ratio = f[index(j)] / before;
      Scalar* const u = u_.data() + column(j);
      for (int i = 0; i < j; ++i) {
        const Scalar old = u[i];
        u[i] = old - b[index(i)] * ratio;
        b[index(i)] += old * g;
      }
      b[index(j)] = g;
    }
    const Scalar step = e / alpha;
    Scalar largest{0};
    for (int i = 0; i < terms_; ++i) {
      const Scalar change = b[index(i)] * step;
      theta_(i) += change;
      largest = std::max(largest, std::abs(change));
    }
    return largest;
  }

  void recall_prior() noexcept {  // (4)
    Row f{};
    for (int j = recalled_; j < terms_; ++j) f[index(j)] = factor(recalled_, j);
    fold(f, recalled_, recall_variance_, -theta_(recalled_));
    recalled_ = (recalled_ + 1) % terms_;
  }

  void adapt_scale(const Innovation& innovation) noexcept {  // (6)
    scale_sum_ =
        lambda_ * scale_sum_ + innovation.innovation * innovation.innovation / innovation.variance_ratio;
    scale_weight_ = lambda_ * scale_weight_ + Scalar{1};
  }

  int terms_;
  Scalar lambda_;
  Scalar prior_variance_;
  Scalar least_information_;
  Scalar recall_variance_ = 0;  ///< of the pseudo-observation of (4)
  int recalled_ = 0;            ///< the coefficient it observes next
  Vector theta_;
  std::array<Scalar, static_cast<std::size_t>(kMaxTerms)> d_{};
  std::array<Scalar, static_cast<std::size_t>(kMaxTerms*(kMaxTerms - 1) / 2 + 1)> u_{};
  Scalar scale_sum_ = 0;
  Scalar scale_weight_ = 0;
  std::int64_t fused_ = 0;
  std::int64_t unexcited_ = 0;
  std::int64_t refused_ = 0;
};

}  // namespace airworthy
