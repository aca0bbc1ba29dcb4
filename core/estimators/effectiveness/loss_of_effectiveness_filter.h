#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <span>

#include "core/estimators/effectiveness/effectiveness_matrix.h"
#include "core/estimators/effectiveness/second_order_lowpass.h"
#include "core/estimators/update_status.h"

namespace airworthy {

template <class Scalar>
struct LossOfEffectivenessParams {
  Scalar filter_frequency_rad_s = 50;
  Scalar filter_damping_ratio = Scalar(0.55);
  /// R of each row; infinite = the row is not used.
  std::array<Scalar, kEffectivenessRows> measurement_variance{1, 1, std::numeric_limits<Scalar>::infinity(),
                                                              1};
  Scalar process_variance = Scalar(0.01);  ///< Q, per step
  Scalar most_effectiveness = Scalar(1.5);
  Scalar lost_below = Scalar(0.25);
  /// Share of the way back to 1 that k goes each step; 0 = the random walk of the source.
  Scalar pull_ratio = 0;
  Scalar reference_memory_s = 3;  ///< τ
};

/// Kalman filter for the effectiveness of every rotor.
///   Inputs      ω, p, q, (r,) a_z, each through the same low-pass; ṗ, q̇, (ṙ) by backward difference       (1)
///   Model       k ← 1 + (1 − α)·(k − 1) + w,  w ~ N(0, Q);  z = B·diag(ω²)·k + v,  v ~ N(0, R)             (2)
///   Update      row by row: K = P·h/(hᵀ·P·h + R);  k ← k + K·(z − hᵀ·k);  P ← P − K·hᵀ·P                    (3)
///   Limits      0 ≤ k ≤ 1.5                                                                             (4)
///   Decision    P(kᵢ < t) = ½·(1 + erf((t − kᵢ)/(σᵢ·√2)))                                                (5)
///   One fault   if only rotor i is off, its most probable effectiveness and what that leaves unexplained:
///               κᵢ = 1 + eᵢᵀP⁻¹d/(k̄ᵢ·eᵢᵀP⁻¹eᵢ),  var κᵢ = 1/(k̄ᵢ²·eᵢᵀP⁻¹eᵢ),
///               Dᵢ = dᵀP⁻¹d − (eᵢᵀP⁻¹d)²/(eᵢᵀP⁻¹eᵢ),  d = k − k̄                                          (6)
///   Reference   what a healthy flight makes of k where B is wrong:  k̄ ← k̄ + Δt/min(τ, t)·(k − k̄),
///               t the time of all such steps; k̄ = 1 before the first                                (7)
///   Source      (1)–(5) [Strack2023], with α = 0 and rows p, q, a_z; (6), (7) ours, docs/equations/effectiveness.md
///   Symbols     k → k_, P → p_ (N × N), k̄ → reference_, h = B row · ω², R → measurement_variance,
///               Q → process_variance, α → pull_ratio, τ → reference_memory_s, t in (5) → lost_below
///   Deviations  one rotor or eight, any geometry; the yaw row if its R is finite. Three or four rows cannot
///               tell N > rows rotors apart: with α = 0 the variance of what they do not see grows without
///               bound. α > 0 bounds it at Q/(1 − (1 − α)²) and leads k back to 1 there, and (6) reads one lost
///               rotor from what is seen, where k itself shares the loss among rotors
///   Errata      docs/equations/effectiveness.md#errata
///   Valid for   Δt in (0, 0.1 s]; a longer gap starts the low-passes over. Cost with N rotors and m rows:
///               3·m·N² flops and (6) N³; no heap
template <class Scalar, std::size_t kMost = kMaxRotors>
class LossOfEffectivenessFilter {
 public:
  using Params = LossOfEffectivenessParams<Scalar>;
  struct SingleFault {
    Scalar effectiveness = 1;  ///< κᵢ; of what rotor i gave before, if that was learned
    Scalar variance = 0;
    Scalar unexplained = 0;  ///< Dᵢ; χ² with N − 1 degrees of freedom if only rotor i is off
  };
  static constexpr Scalar kLongestStep_s = Scalar(0.1);
  /// A rotor that gives less than this is no reference for anything.
  static constexpr Scalar kLeastReference = Scalar(0.5);

  LossOfEffectivenessFilter(const EffectivenessMatrix<Scalar>& effectiveness, const Params& params) noexcept
      : effectiveness_{effectiveness},
        params_{params},
        rates_{lowpass(), lowpass(), lowpass()},
        vertical_{lowpass()},
        n_{effectiveness.rotor_count} {
    speed_.fill(lowpass());
    k_.fill(Scalar{1});
    reference_.fill(Scalar{1});
    for (std::size_t i = 0; i < n_; ++i) p_[i][i] = params.process_variance;
  }

  /// One sample, Δt after the last (ignored for the first). kConverging: taken, no difference yet.
  UpdateStatus update(Scalar dt_s, std::span<const Scalar> speed_rad_s,
                      const std::array<Scalar, 3>& gyro_rad_s, Scalar vertical_m_s2) noexcept {
    if (!all_finite(dt_s, speed_rad_s, gyro_rad_s, vertical_m_s2)) return UpdateStatus::kNotFinite;
    if (!started_ || dt_s > kLongestStep_s) {
      start(speed_rad_s, gyro_rad_s, vertical_m_s2);
      return UpdateStatus::kConverging;
    }
    if (!(dt_s > Scalar{0})) return UpdateStatus::kTimeBackward;
    std::array<Scalar, kEffectivenessRows> z{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Scalar before = rates_[axis].value();
      z[axis] = (rates_[axis].step(gyro_rad_s[axis], dt_s) - before) / dt_s;  // (1)
    }
    z[kVerticalRow] = vertical_.step(vertical_m_s2, dt_s);
    std::array<Scalar, kMost> speed2{};
    for (std::size_t i = 0; i < n_; ++i) {
      const Scalar speed = speed_[i].step(speed_rad_s[i], dt_s);
      speed2[i] = speed * speed;
    }
    predict();
    for (std::size_t row = 0; row < kEffectivenessRows; ++row) fuse(row, z[row], speed2);
    limit();
    return UpdateStatus::kFused;
  }

  /// (7): the vehicle flies, and so far as one knows its rotors are as they were. Without, faults are measured from 1.
  void learn_reference(Scalar dt_s) noexcept {
    if (!(dt_s > Scalar{0})) return;
    learned_s_ = std::min(learned_s_ + dt_s, params_.reference_memory_s);
    for (std::size_t i = 0; i < n_; ++i) {
      const Scalar towards = std::min(dt_s / learned_s_, Scalar{1}) * (k_[i] - reference_[i]);
      reference_[i] = std::clamp(reference_[i] + towards, kLeastReference, params_.most_effectiveness);
    }
  }

  [[nodiscard]] std::size_t rotor_count() const noexcept { return n_; }
  /// k̄ᵢ
  [[nodiscard]] Scalar reference(std::size_t i) const noexcept { return reference_[i]; }
  [[nodiscard]] Scalar effectiveness(std::size_t i) const noexcept { return k_[i]; }
  [[nodiscard]] Scalar covariance(std::size_t i, std::size_t j) const noexcept { return p_[i][j]; }
  /// (5) from the marginal of rotor i.
  [[nodiscard]] Scalar probability_lost(std::size_t i) const noexcept {
    return probability_below(params_.lost_below, k_[i], p_[i][i]);
  }
  /// (6) for every rotor; nothing where P is singular.
  [[nodiscard]] std::optional<std::array<SingleFault, kMost>> single_faults() const noexcept;
  /// The rotor whose loss alone explains most, if (5) on (6) exceeds `probability` for it and it leaves no more than the
  /// share `unexplained` of dᵀP⁻¹d.
  [[nodiscard]] std::optional<std::size_t> single_lost(Scalar probability,
                                                       Scalar unexplained = Scalar{1}) const noexcept {
    const auto faults = single_faults();
    if (!faults) return std::nullopt;
    std::size_t best = 0;
    for (std::size_t i = 1; i < n_; ++i) {
      if ((*faults)[i].unexplained < (*faults)[best].unexplained) best = i;
    }
    const SingleFault& fault = (*faults)[best];
    const Scalar loss = Scalar{1} - fault.effectiveness;  // over its deviation the same for any k̄
    if (fault.unexplained > unexplained * (fault.unexplained + loss * loss / fault.variance))
      return std::nullopt;
    if (probability_below(params_.lost_below, fault.effectiveness, fault.variance) > probability) return best;
    return std::nullopt;
  }
  /// How often (4) changed k: a filter that lives at its limits says less than its variance.
  [[nodiscard]] std::int64_t limited() const noexcept { return limited_; }

  [[nodiscard]] static Scalar probability_below(Scalar threshold, Scalar mean, Scalar variance) noexcept {
    const Scalar sigma = std::sqrt(variance);
    return (Scalar{1} + std::erf((threshold - mean) / (sigma * std::numbers::sqrt2_v<Scalar>))) /
           Scalar{2};  // (5)
  }

 private:
  using Matrix = std::array<std::array<Scalar, kMost>, kMost>;

  [[nodiscard]] SecondOrderLowpass<Scalar> lowpass() const noexcept {
    return {params_.filter_frequency_rad_s, params_.filter_damping_ratio};
  }

  [[nodiscard]] bool all_finite(Scalar dt_s, std::span<const Scalar> speed, const std::array<Scalar, 3>& gyro,
                                Scalar vertical) const noexcept {
    if (speed.size() != n_) return false;
    const auto finite = [](Scalar value) { return std::isfinite(value); };
    return (!started_ || finite(dt_s)) && finite(vertical) && std::all_of(gyro.begin(), gyro.end(), finite) &&
           std::all_of(speed.begin(), speed.end(), finite);
  }

  void start(std::span<const Scalar> speed, const std::array<Scalar, 3>& gyro, Scalar vertical) noexcept {
    for (std::size_t axis = 0; axis < 3; ++axis) rates_[axis].start(gyro[axis]);
    vertical_.start(vertical);
    for (std::size_t i = 0; i < n_; ++i) speed_[i].start(speed[i]);
    started_ = true;
  }

  void predict() noexcept {  // (2)
    const Scalar keep = Scalar{1} - params_.pull_ratio;
    for (std::size_t i = 0; i < n_; ++i) {
      k_[i] = Scalar{1} + keep * (k_[i] - Scalar{1});
      for (std::size_t j = 0; j < n_; ++j) p_[i][j] *= keep * keep;
      p_[i][i] += params_.process_variance;
    }
  }

  void fuse(std::size_t row, Scalar z, const std::array<Scalar, kMost>& speed2) noexcept {  // (3)
    const Scalar r = params_.measurement_variance[row];
    if (!std::isfinite(r)) return;
    std::array<Scalar, kMost> h{};
    std::array<Scalar, kMost> ph{};
    Scalar innovation = z;
    Scalar variance = r;
    for (std::size_t i = 0; i < n_; ++i) {
      h[i] = effectiveness_.per_speed2[row][i] * speed2[i];
      innovation -= h[i] * k_[i];
    }
    for (std::size_t i = 0; i < n_; ++i) {
      for (std::size_t j = 0; j < n_; ++j) ph[i] += p_[i][j] * h[j];
      variance += h[i] * ph[i];
    }
    for (std::size_t i = 0; i < n_; ++i) {
      const Scalar gain = ph[i] / variance;
      k_[i] += gain * innovation;
      for (std::size_t j = 0; j <= i; ++j) {
        p_[i][j] -= gain * ph[j];
        p_[j][i] = p_[i][j];
      }
    }
  }

  void limit() noexcept {  // (4)
    for (std::size_t i = 0; i < n_; ++i) {
      const Scalar limited = std::clamp(k_[i], Scalar{0}, params_.most_effectiveness);
      if (limited != k_[i]) ++limited_;
      k_[i] = limited;
    }
  }

  EffectivenessMatrix<Scalar> effectiveness_;
  Params params_;
  std::array<SecondOrderLowpass<Scalar>, 3> rates_;
  SecondOrderLowpass<Scalar> vertical_;
  std::array<SecondOrderLowpass<Scalar>, kMost> speed_{};
  std::array<Scalar, kMost> k_{};
  std::array<Scalar, kMost> reference_{};
  Scalar learned_s_ = 0;
  Matrix p_{};
  std::size_t n_;
  bool started_ = false;
  std::int64_t limited_ = 0;
};

template <class Scalar, std::size_t kMost>
std::optional<std::array<typename LossOfEffectivenessFilter<Scalar, kMost>::SingleFault, kMost>>
LossOfEffectivenessFilter<Scalar, kMost>::single_faults() const noexcept {
  // L of P = L·Lᵀ, then P⁻¹d = L⁻ᵀ·(L⁻¹d) and eᵢᵀP⁻¹eᵢ = |L⁻¹eᵢ|².
  Matrix l{};
  for (std::size_t j = 0; j < n_; ++j) {
    for (std::size_t i = j; i < n_; ++i) {
      Scalar sum = p_[i][j];
      for (std::size_t m = 0; m < j; ++m) sum -= l[i][m] * l[j][m];
      if (i == j && !(sum > Scalar{0})) return std::nullopt;
      l[i][j] = i == j ? std::sqrt(sum) : sum / l[j][j];
    }
  }
  const auto solve = [&](std::array<Scalar, kMost> b) {
    for (std::size_t i = 0; i < n_; ++i) {
      for (std::size_t m = 0; m < i; ++m) b[i] -= l[i][m] * b[m];
      b[i] /= l[i][i];
    }
    return b;
  };
  std::array<Scalar, kMost> d{};
  for (std::size_t i = 0; i < n_; ++i) d[i] = k_[i] - reference_[i];
  const auto whitened = solve(d);
  Scalar total{0};
  for (std::size_t i = 0; i < n_; ++i) total += whitened[i] * whitened[i];
  std::array<SingleFault, kMost> faults{};
  for (std::size_t i = 0; i < n_; ++i) {
    std::array<Scalar, kMost> unit{};
    unit[i] = Scalar{1};
    const auto direction = solve(unit);
    Scalar information{0};
    Scalar projection{0};
    for (std::size_t m = i; m < n_; ++m) {
      information += direction[m] * direction[m];
      projection += direction[m] * whitened[m];
    }
    faults[i] = {Scalar{1} + projection / (reference_[i] * information),
                 Scalar{1} / (reference_[i] * reference_[i] * information),
                 total - projection * projection / information};  // (6)
  }
  return faults;
}

}  // namespace airworthy
