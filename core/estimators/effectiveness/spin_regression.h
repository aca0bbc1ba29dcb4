#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "core/estimators/effectiveness/disturbed_axis.h"
#include "core/estimators/effectiveness/information_sums.h"
#include "core/math/cholesky.h"
#include "core/vehicle/multirotor.h"

namespace airworthy {

template <class Scalar>
struct SpinRegressionParams {
  // Noise of the model, in shares of the drag torque of one rotor in hover.
  Scalar acceleration_ratio = Scalar(0.03);
  Scalar correlation_s = Scalar(0.01);
  Scalar disturbance_ratio_per_sqrt_s = Scalar(0.1);
  Scalar gyro_rad_s = Scalar(0.03);  ///< first guess; adapts
  // How far a healthy vehicle may be from its file: standard deviations.
  Scalar gain = Scalar(0.5);            ///< of drag torque and of the rotors' inertia, alike for all rotors
  Scalar least_gain = Scalar(0.3);      ///< neither can have the other sign
  Scalar tilt_rad = Scalar(0.03);       ///< of one rotor's axis: its thrust then turns the body too
  Scalar inertia_spread = Scalar(0.1);  ///< of one rotor's inertia against the others
  Scalar coupling =
      Scalar(0.1);    ///< of roll and pitch into yaw: axes of the inertial unit, products of inertia
  Scalar offset = 1;  ///< steady moment, in the same shares
};

/// Which way the rotors turn, from how the body yaws, over minutes of flight.
///   Torque      of rotor j, turning as described (s = +1 clockwise):  dⱼ = −s·κ_m·κ·ω²/I_z (drag),
///               rⱼ = −s·J·ω̇/I_z (reaction to its acceleration)                                         (1)
///   Model       ṙ = Σ σⱼ·(g_d·dⱼ + g_r·rⱼ) + εⱼ·dⱼ + ηⱼ·rⱼ + m_p·ṗ + m_q·q̇ + o + disturbance,                 (2)
///               σⱼ = −1: turns the other way; ṗ, q̇ as the rotors give them
///               g ~ N(1, gain²), at least least_gain; ε ~ N(0, (tilt·armⱼ/κ_m)²); η ~ N(0, spread²); m ~ N(0, coupling²);
///               o ~ N(0, offset²)
///   Sums        traces of dⱼ, rⱼ, ṗ, q̇ and o in the innovations of a RateAxis without input, by InformationSums       (3)
///   Nuisance    M ← M − M·(M + Λ)⁻¹·M, c ← c − M·(M + Λ)⁻¹·c, with Λ the inverse variances of ε, η, m, o           (4)
///   Pattern     ℓ(σ) = max over g of cᵀθ − ½·θᵀMθ − ½·|g − 1|²/gain²,  θ = (σ·g_d, σ·g_r)                     (5)
///   Source      (1) as in a rigid body with rotors; derived in docs/equations/effectiveness.md
/// Cost of a sample: (2N + 3)·(2N + 12) flops; of all 2^N patterns 8·N²·2^N. No heap.
template <class Scalar, std::size_t kMost = kMaxRotors>
class SpinRegression {
 public:
  using Params = SpinRegressionParams<Scalar>;
  using Pattern = std::uint32_t;  ///< bit j: rotor j turns the other way than described
  struct Verdict {
    Pattern best = 0;
    Scalar over_described = 0;  ///< ℓ(best) − ℓ(0), nats
    Scalar over_second = 0;     ///< ℓ(best) − the best of all others
  };

  SpinRegression(const Multirotor& vehicle, Scalar hover_speed2, const Params& params) noexcept
      : params_{params}, n_{vehicle.rotor_count} {
    const double inertia = vehicle.inertia_kg_m2[2];
    const double drag = vehicle.thrust_coefficient_N_s2 * vehicle.torque_ratio_m;
    is_described_ = inertia > 0.0 && drag > 0.0;
    if (!is_described_) return;
    for (std::size_t i = 0; i < n_; ++i) {
      const Rotor& rotor = vehicle.rotor[i];
      const double spin = static_cast<double>(rotor.spin) * rotor.thrust_axis[2];
      drag_per_speed2_[i] = static_cast<Scalar>(spin * drag / inertia);
      inertia_ratio_[i] = static_cast<Scalar>(spin * vehicle.propeller_inertia_kg_m2 / inertia);
      const double arm = std::hypot(rotor.position_m[0], rotor.position_m[1]);
      tilt_[i] = params.tilt_rad * static_cast<Scalar>(arm / vehicle.torque_ratio_m);
    }
    authority_ = static_cast<Scalar>(drag / inertia) * hover_speed2;
    const Scalar guess = params.gyro_rad_s * params.gyro_rad_s;
    gyro_variance_ = {guess, kLeastVarianceRatio * guess, kMostVarianceRatio * guess, kVarianceTime_s};
  }

  void start(Scalar rate_rad_s) noexcept {
    rate_.start(rate_rad_s, gyro_variance_.value, authority_ * authority_);
    traces_ = {};
    sums_ = {};
  }

  /// After a gap: what was learned stays.
  void resume(Scalar rate_rad_s) noexcept {
    rate_.resume(rate_rad_s, gyro_variance_.value);
    for (auto& trace : traces_) trace.rate = Scalar{0};
  }

  /// Speeds at the sample and at the one before, rad/s; ṗ and q̇ that the rotors give; `gyroscopic` what the turning
  /// body adds to ṙ.
  void step(Scalar dt_s, std::span<const Scalar> speed, std::span<const Scalar> before, Scalar rate_rad_s,
            const std::array<Scalar, 2>& tilting_rad_s2, Scalar gyroscopic_rad_s2) noexcept {
    if (!is_described_) return;
    const Scalar white = params_.acceleration_ratio * authority_;
    const Scalar wander = params_.disturbance_ratio_per_sqrt_s * authority_;
    const auto seen = rate_.step(dt_s, gyroscopic_rad_s2, rate_rad_s,
                                 {Scalar{2} * white * white * params_.correlation_s, wander * wander},
                                 gyro_variance_.value);
    gyro_variance_.step(seen.innovation, seen.variance, dt_s);
    Row h{};
    for (std::size_t i = 0; i < n_; ++i) {
      const Scalar speed2 = (speed[i] * speed[i] + before[i] * before[i]) / Scalar{2};
      h[i] = traces_[i].step(seen, drag_per_speed2_[i] * speed2);  // (1), (3)
      h[n_ + i] = traces_[n_ + i].step(seen, inertia_ratio_[i] * (speed[i] - before[i]) / dt_s);
    }
    for (std::size_t axis = 0; axis < 2; ++axis)
      h[2 * n_ + axis] = traces_[2 * n_ + axis].step(seen, tilting_rad_s2[axis]);
    h[2 * n_ + 2] = traces_[2 * n_ + 2].step(seen, authority_);
    sums_.add(h, 2 * n_ + 3, seen.innovation, seen.variance);
  }

  void fade(Scalar keep) noexcept { sums_.fade(keep, 2 * n_ + 3); }

  /// (5) over all patterns; nothing where the sums are not finite.
  [[nodiscard]] std::optional<Verdict> judge() const noexcept;

 private:
  static constexpr std::size_t kParameters = 2 * kMost + 3;
  static constexpr int kSize = static_cast<int>(kParameters);
  static constexpr Scalar kVarianceTime_s = 2;
  static constexpr Scalar kLeastVarianceRatio = Scalar(0.01);
  static constexpr Scalar kMostVarianceRatio = 1000;
  using Row = std::array<Scalar, kParameters>;
  using Matrix = BoundedMatrix<Scalar, kSize>;
  using Vector = BoundedVector<Scalar, kSize>;

  [[nodiscard]] bool marginal(Matrix& m, Vector& c) const noexcept {  // (4)
    const auto n = static_cast<Eigen::Index>(n_);
    const Eigen::Index size = 2 * n + 3;
    m.resize(size, size);
    c.resize(size);
    for (Eigen::Index i = 0; i < size; ++i) {
      c(i) = sums_.vector[static_cast<std::size_t>(i)];
      for (Eigen::Index j = 0; j < size; ++j)
        m(i, j) = sums_.at(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
    }
    Matrix with_prior = m;
    for (Eigen::Index i = 0; i < size; ++i) {
      const Scalar sigma = i < n          ? tilt_[static_cast<std::size_t>(i)]
                           : i < 2 * n    ? params_.inertia_spread
                           : i < size - 1 ? params_.coupling
                                          : params_.offset;
      with_prior(i, i) += Scalar{1} / std::max(sigma * sigma, Scalar(1e-6));
    }
    Matrix inverse;
    if (!invert_positive_definite<Scalar, kSize>(with_prior, inverse)) return false;
    // Plain loops in place of blocked products: no heap, and the same bits on every machine.
    const Matrix gain = m.lazyProduct(inverse);
    c -= gain.lazyProduct(c).eval();
    m -= gain.lazyProduct(m).eval();
    return true;
  }

  Params params_;
  std::size_t n_;
  bool is_described_ = false;  ///< whether the vehicle file says enough to tell
  Scalar authority_ = 1;
  std::array<Scalar, kMost> drag_per_speed2_{};
  std::array<Scalar, kMost> inertia_ratio_{};
  std::array<Scalar, kMost> tilt_{};
  RateAxis<Scalar> rate_;
  AdaptiveVariance<Scalar> gyro_variance_;
  std::array<typename RateAxis<Scalar>::Signature, kParameters> traces_{};
  InformationSums<Scalar, kParameters> sums_;
};

template <class Scalar, std::size_t kMost>
std::optional<typename SpinRegression<Scalar, kMost>::Verdict> SpinRegression<Scalar, kMost>::judge()
    const noexcept {
  Matrix m;
  Vector c;
  if (!is_described_ || !marginal(m, c)) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(n_);
  const Scalar prior = Scalar{1} / (params_.gain * params_.gain);
  const auto likelihood = [&](Pattern pattern) {  // (5)
    const auto sign = [pattern](Eigen::Index i) {
      return (pattern >> static_cast<unsigned>(i)) & 1U ? Scalar{-1} : Scalar{1};
    };
    Scalar a0{prior}, a1{prior}, q00{prior}, q01{0}, q11{prior};
    for (Eigen::Index i = 0; i < n; ++i) {
      a0 += sign(i) * c(i);
      a1 += sign(i) * c(n + i);
      for (Eigen::Index j = 0; j < n; ++j) {
        const Scalar both = sign(i) * sign(j);
        q00 += both * m(i, j);
        q01 += both * m(i, n + j);
        q11 += both * m(n + i, n + j);
      }
    }
    const auto value = [&](Scalar x0, Scalar x1) {
      return a0 * x0 + a1 * x1 - (q00 * x0 * x0 + q11 * x1 * x1) / Scalar{2} - q01 * x0 * x1 - prior;
    };
    const Scalar least = params_.least_gain;
    const Scalar determinant = q00 * q11 - q01 * q01;
    const Scalar x0 = (q11 * a0 - q01 * a1) / determinant;
    const Scalar x1 = (q00 * a1 - q01 * a0) / determinant;
    if (x0 >= least && x1 >= least) return value(x0, x1);
    return std::max(value(least, std::max(least, (a1 - q01 * least) / q11)),
                    value(std::max(least, (a0 - q01 * least) / q00), least));
  };
  const Scalar described = likelihood(0);
  Verdict verdict;
  Scalar best = described;
  Scalar second = -std::numeric_limits<Scalar>::infinity();
  for (Pattern pattern = 1; pattern < (Pattern{1} << static_cast<unsigned>(n_)); ++pattern) {
    const Scalar now = likelihood(pattern);
    if (now > best) {
      second = best;
      best = now;
      verdict.best = pattern;
    } else {
      second = std::max(second, now);
    }
  }
  verdict.over_described = best - described;
  verdict.over_second = best - second;
  return verdict;
}

}  // namespace airworthy
