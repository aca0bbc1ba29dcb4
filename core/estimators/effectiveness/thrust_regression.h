#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "core/estimators/effectiveness/disturbed_axis.h"
#include "core/estimators/effectiveness/effectiveness_matrix.h"
#include "core/estimators/effectiveness/information_sums.h"
#include "core/math/cholesky.h"

namespace airworthy {

/// One inertial sample beside what the described rotors give at that moment.
template <class Scalar, std::size_t kMost = kMaxRotors>
struct ThrustSample {
  Scalar dt_s = 0;
  std::array<Scalar, 2> rate_rad_s{};         ///< p, q
  std::array<Scalar, 2> gyroscopic_rad_s2{};  ///< of ṗ, q̇, of the turning body
  Scalar vertical_m_s2 = 0;  ///< a_z, less what the turning body adds beside the centre of mass
  Scalar lift_m_s2 = 0;      ///< Σ of the rotors' a_z at the centre of mass, negative
  std::array<std::array<Scalar, 3>, kMost> contribution{};  ///< of each rotor: ṗ, q̇, a_z
};

template <class Scalar>
struct ThrustRegressionParams {
  std::size_t rotor_count = 0;
  std::array<Scalar, 3> authority{};  ///< what one rotor gives in hover: rad/s², rad/s², m/s²
  std::array<Scalar, 2>
      offset_rad_s2_per_m_s2{};  ///< moment of the lift whose arm is the mean arm of the rotors
  // Noise of the model, in shares of the authority.
  Scalar acceleration_ratio = Scalar(0.03);  ///< never explained, correlated over correlation_s
  Scalar correlation_s = Scalar(0.01);
  Scalar disturbance_ratio_per_sqrt_s = Scalar(0.04);  ///< of roll and pitch; what lasts is an offset of (3)
  Scalar vertical_ratio_per_sqrt_s = Scalar(0.6);
  Scalar gyro_rad_s = Scalar(0.03);  ///< first guess; adapts
  Scalar accel_m_s2 = Scalar(0.7);
  // How far a healthy vehicle may be from its file: standard deviations.
  Scalar spread = Scalar(0.04);       ///< of one rotor against the others
  Scalar gain = Scalar(0.2);          ///< of an axis: inertia, mass, battery, density of the air
  Scalar offset = Scalar(0.04);       ///< centre of mass / mean arm
  Scalar lateness_s = Scalar(0.005);  ///< of the speeds against the inertial data
};

/// How much each rotor's thrust differs from the vehicle file, from minutes of flight.
///   Model     RateAxis and ForceAxis under the described rotors, u = Σ cⱼ; what they do not explain is
///             Σ δⱼ·cⱼ + γ_axis·Σ cⱼ + o_axis·(moment of the lift) + λ·d/dt Σ cⱼ + a disturbance that wanders    (1)
///   Trace     of each of these in the innovations by their signatures; sums by InformationSums                  (2)
///   Healthy   δⱼ ~ N(0, spread²), γ ~ N(0, gain²), o ~ N(0, offset²), λ ~ N(0, lateness²)                   (3)
///   Rotor i   (M + Λ)⁻¹ of (3), its mean d and variance v at δᵢ, less the prior of δᵢ itself:
///             1/vᵢ = 1/v − 1/spread²,  mᵢ = vᵢ·d/v                                                     (4)
///             log-likelihood ratio of "δᵢ is any" over "healthy": ℓᵢ = mᵢ²/(2(vᵢ + spread²))                   (5)
///   Symbols   δ: effectiveness − 1; c → contribution; λ: how late the speeds are; Λ: inverse variances of (3)
///   Source    derived in docs/equations/effectiveness.md
/// The speeds must be those of the moment, not predictions: an error of a motor's lag would look like an error of
/// its thrust. Cost of a sample: 3·(N + 2)·(N + 13) flops, of an estimate (N + 6)³: one inversion serves all rotors.
/// No heap.
template <class Scalar, std::size_t kMost = kMaxRotors>
class ThrustRegression {
 public:
  using Params = ThrustRegressionParams<Scalar>;
  using Sample = ThrustSample<Scalar, kMost>;
  struct Deviation {
    Scalar mean = 0;      ///< mᵢ of (4)
    Scalar variance = 1;  ///< vᵢ
    Scalar evidence = 0;  ///< ℓᵢ of (5), nats
  };

  explicit ThrustRegression(const Params& params) noexcept : params_{params}, n_{params.rotor_count} {
    for (auto& variance : gyro_variance_) variance = adaptive(params.gyro_rad_s);
    accel_variance_ = adaptive(params.accel_m_s2);
  }

  /// A flight begins, or something is now known of a rotor: all starts over.
  void start(const std::array<Scalar, 2>& rate_rad_s) noexcept {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const Scalar sigma = kFirstDisturbance * params_.authority[axis];
      rate_[axis].start(rate_rad_s[axis], gyro_variance_[axis].value, sigma * sigma);
    }
    const Scalar sigma = kFirstDisturbance * params_.authority[2];
    vertical_.start(sigma * sigma);
    for (auto& trace : rate_trace_) trace = {};
    vertical_trace_ = {};
    has_before_ = false;
    for (auto& sums : sums_) sums = {};
  }

  /// After a gap: what was learned stays.
  void resume(const std::array<Scalar, 2>& rate_rad_s) noexcept {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      rate_[axis].resume(rate_rad_s[axis], gyro_variance_[axis].value);
      for (auto& trace : rate_trace_[axis]) trace.rate = Scalar{0};
    }
    has_before_ = false;
  }

  void step(const Sample& sample) noexcept {
    for (std::size_t axis = 0; axis < 2; ++axis) step_rate(axis, sample);
    step_vertical(sample);
    has_before_ = true;
  }

  void fade(Scalar keep) noexcept {
    for (auto& sums : sums_) sums.fade(keep, n_ + 2);
  }

  /// (4) and (5) for every rotor; nothing where the sums are not finite.
  [[nodiscard]] std::optional<std::array<Deviation, kMost>> deviations() const noexcept;

 private:
  static constexpr int kParameters = static_cast<int>(kMost) + 6;
  static constexpr Scalar kFirstDisturbance = Scalar(0.5);
  static constexpr Scalar kVarianceTime_s = 2;
  static constexpr Scalar kLeastVarianceRatio = Scalar(0.01);
  static constexpr Scalar kMostVarianceRatio = 1000;
  using Sums = InformationSums<Scalar, kMost + 2>;  // of an axis: δ of every rotor, λ, o
  using Row = std::array<Scalar, kMost + 2>;

  static AdaptiveVariance<Scalar> adaptive(Scalar sigma) noexcept {
    const Scalar guess = sigma * sigma;
    return {guess, kLeastVarianceRatio * guess, kMostVarianceRatio * guess, kVarianceTime_s};
  }

  void step_rate(std::size_t axis, const Sample& sample) noexcept {
    const Scalar rotors = sum(sample, axis);
    const Scalar change = changed(axis, rotors, sample.dt_s);
    const Scalar white = params_.acceleration_ratio * params_.authority[axis];
    const Scalar wander = params_.disturbance_ratio_per_sqrt_s * params_.authority[axis];
    const auto seen =
        rate_[axis].step(sample.dt_s, rotors + sample.gyroscopic_rad_s2[axis], sample.rate_rad_s[axis],
                         {Scalar{2} * white * white * params_.correlation_s, wander * wander},
                         gyro_variance_[axis].value);  // (1)
    gyro_variance_[axis].step(seen.innovation, seen.variance, sample.dt_s);
    Row h{};
    for (std::size_t i = 0; i < n_; ++i)
      h[i] = rate_trace_[axis][i].step(seen, sample.contribution[i][axis]);  // (2)
    h[n_] = rate_trace_[axis][n_].step(seen, change);
    h[n_ + 1] =
        rate_trace_[axis][n_ + 1].step(seen, -sample.lift_m_s2 * params_.offset_rad_s2_per_m_s2[axis]);
    sums_[axis].add(h, n_ + 2, seen.innovation, seen.variance);
  }

  void step_vertical(const Sample& sample) noexcept {
    const Scalar u = sum(sample, 2);
    const Scalar change = changed(2, u, sample.dt_s);
    const Scalar wander = params_.vertical_ratio_per_sqrt_s * params_.authority[2];
    const auto seen =
        vertical_.step(sample.dt_s, u, sample.vertical_m_s2, wander * wander, accel_variance_.value);
    accel_variance_.step(seen.innovation, seen.variance, sample.dt_s);
    Row h{};
    for (std::size_t i = 0; i < n_; ++i) h[i] = vertical_trace_[i].step(seen, sample.contribution[i][2]);
    h[n_] = vertical_trace_[n_].step(seen, change);
    sums_[2].add(h, n_ + 1, seen.innovation, seen.variance);
  }

  Scalar sum(const Sample& sample, std::size_t axis) const noexcept {
    Scalar total{0};
    for (std::size_t i = 0; i < n_; ++i) total += sample.contribution[i][axis];
    return total;
  }

  /// d/dt of what the rotors give.
  Scalar changed(std::size_t axis, Scalar now, Scalar dt_s) noexcept {
    const Scalar rate = has_before_ ? (now - before_[axis]) / dt_s : Scalar{0};
    before_[axis] = now;
    return rate;
  }

  Params params_;
  std::size_t n_;
  std::array<RateAxis<Scalar>, 2> rate_;
  ForceAxis<Scalar> vertical_;
  std::array<AdaptiveVariance<Scalar>, 2> gyro_variance_;
  AdaptiveVariance<Scalar> accel_variance_;
  std::array<std::array<typename RateAxis<Scalar>::Signature, kMost + 2>, 2> rate_trace_{};
  std::array<typename ForceAxis<Scalar>::Signature, kMost + 1> vertical_trace_{};
  std::array<Scalar, 3> before_{};
  bool has_before_ = false;
  std::array<Sums, 3> sums_{};
};

template <class Scalar, std::size_t kMost>
std::optional<std::array<typename ThrustRegression<Scalar, kMost>::Deviation, kMost>>
ThrustRegression<Scalar, kMost>::deviations() const noexcept {
  const auto n = static_cast<Eigen::Index>(n_);
  // Parameters: δ of every rotor, λ, o of roll and pitch, γ of the three axes.
  const Eigen::Index lateness = n;
  const Eigen::Index offsets = n + 1;
  const Eigen::Index gains = n + 3;
  const Eigen::Index size = n + 6;
  BoundedMatrix<Scalar, kParameters> information = BoundedMatrix<Scalar, kParameters>::Zero(size, size);
  BoundedVector<Scalar, kParameters> vector = BoundedVector<Scalar, kParameters>::Zero(size);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Sums& sums = sums_[axis];
    const Eigen::Index gain = gains + static_cast<Eigen::Index>(axis);
    const std::size_t count = axis < 2 ? n_ + 2 : n_ + 1;
    const auto place = [&](std::size_t i) {
      return i < n_    ? static_cast<Eigen::Index>(i)
             : i == n_ ? lateness
                       : offsets + static_cast<Eigen::Index>(axis);
    };
    for (std::size_t i = 0; i < count; ++i) {
      vector(place(i)) += sums.vector[i];
      for (std::size_t j = 0; j <= i; ++j) information(place(i), place(j)) += sums.at(i, j);
      // The gain of an axis moves all rotors alike: its trace is the sum of theirs.
      for (std::size_t j = 0; j < n_; ++j) information(gain, place(i)) += sums.at(i, j);
      if (i >= n_) continue;
      vector(gain) += sums.vector[i];
      for (std::size_t j = 0; j < n_; ++j) information(gain, gain) += sums.at(i, j);
    }
  }
  const auto precision = [](Scalar sigma) { return Scalar{1} / (sigma * sigma); };
  for (Eigen::Index i = 0; i < n; ++i) information(i, i) += precision(params_.spread);  // (3)
  information(lateness, lateness) += precision(params_.lateness_s);
  for (Eigen::Index i = offsets; i < gains; ++i) information(i, i) += precision(params_.offset);
  for (Eigen::Index i = gains; i < size; ++i) information(i, i) += precision(params_.gain);
  BoundedMatrix<Scalar, kParameters> covariance;
  if (!invert_positive_definite<Scalar, kParameters>(information, covariance)) return std::nullopt;
  std::array<Deviation, kMost> result{};
  for (Eigen::Index i = 0; i < n; ++i) {
    Scalar mean{0};
    for (Eigen::Index j = 0; j < size; ++j) mean += covariance(i, j) * vector(j);
    const Scalar known = Scalar{1} / covariance(i, i) - precision(params_.spread);
    if (!(known > Scalar{0})) continue;
    Deviation& one = result[static_cast<std::size_t>(i)];
    one.variance = Scalar{1} / known;
    one.mean = one.variance * mean / covariance(i, i);  // (4)
    one.evidence =
        one.mean * one.mean / (Scalar{2} * (one.variance + params_.spread * params_.spread));  // (5)
  }
  return result;
}

}  // namespace airworthy
