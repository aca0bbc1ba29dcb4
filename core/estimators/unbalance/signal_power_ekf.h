#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

#include "core/estimators/unbalance/sensor_gain.h"
#include "core/estimators/update_status.h"
#include "core/math/cholesky.h"
#include "core/math/elementary.h"
#include "core/time/time.h"

namespace airworthy {

/// Defaults are those of the source, for its 690 g and 1170 g vehicles.
struct SignalPowerParams {
  static constexpr double kSqrtMinute = 7.7459666924148338;  ///< √60, in √s

  double mass_kg = 0.0;
  double propeller_radius_m = 0.0;
  double initial_tip_mass_mg = 20.0;  ///< Δ₀, as a mass at the tip; 2 for the 39 g vehicle
  double initial_noise_m_s2 = 1.0;    ///< σ₀, per axis
  double unbalance_sigma = 0.1;       ///< √P₀ of each log unbalance
  double noise_sigma = 0.05;          ///< √P₀ of the log noise
  double unbalance_walk_per_sqrt_s = 0.2 / kSqrtMinute;  ///< q_Δ: 20 % in a minute
  double noise_walk_per_sqrt_s = 0.05 / kSqrtMinute;     ///< q_d: 5 % in a minute
  double extra_variance_m4_s8 = 100.0;                   ///< r₀: what the model does not know of z
  double high_pass_Hz = 1.0;
  SensorGainParams sensor;               ///< not in the source
  double information_memory_s = 60.0;    ///< time constant of forgetting of the Fisher information
  double innovation_limit_sigma = 10.0;  ///< innovations beyond it count as this many √S; infinite = no limit
};

/// Unbalance of every rotor from the power of the horizontal vibration, without knowledge of rotor phases.
///   State       x = [ln Uᵢ/U₀ (N rotors), ln σ/σ₀];  dx = q·dW                                            (1)
///   Measurement z = ãx² + ãy², ã = high-pass(a), first order                                              (2)
///   Model       wᵢ = (fᵢ·Δ₀·e^{xᵢ})²·|G(ωᵢ)|²;  h = E z = Σ wᵢ + 2σ²                                       (3)
///   Jacobian    Hᵢ = ∂h/∂xᵢ = 2wᵢ;  H_{N+1} = 4σ²                                                          (4)
///   Noise       R = 4σ⁴ + ΣᵢΣ_{j≠i} wᵢwⱼ + 4σ²·Σ wᵢ + r₀                                                   (5)
///   Update      P ← P + Q·Δt;  S = H·P·Hᵀ + R;  x ← x + P·Hᵀ·S⁻¹·(z − h);  P ← P − P·Hᵀ·H·P/S              (6)
///   Information J ← J·e^{−Δt/T} + g·gᵀ/R, of the powers sᵢ = (Uᵢ/U₀)² and (σ/σ₀)²;  g = ∂h/∂s = Hᵢ/(2sᵢ)   (7)
///   Culprit     the same weighted least squares with one rotor apart:  z ≈ Σⱼ sⱼᵇ·gⱼ + c·Σⱼ gⱼ + pᵢ·gᵢ + n·g_{N+1},
///               baseline sᵇ known; common change c, noise n and growth pᵢ ≥ 0 free. Evidence: half of what pᵢ takes
///               off the sum of squares, over the mean square left without it: a log likelihood ratio. Linear in
///               c, n, pᵢ: it needs neither prior nor convergence                                           (8)
///   Source      B. Ghalamchi, Z. Jia, M. W. Mueller, Real-Time Vibration-Based Propeller Fault Diagnosis for
///               Multicopters; entry in docs/equations/references.md, derivation in docs/equations/unbalance_power.md
///   Symbols     Uᵢ → unbalance_kg_m(), mass times radius;  fᵢ = κωᵢ², Δᵢ = Uᵢ/(κm) [m/s² per N],
///               so that fᵢΔᵢ = Uᵢωᵢ²/m and κ cancels;  σ → noise_m_s2();
///               P → p_;  J → information_;  q_Δ, q_d, r₀, σ₀: SignalPowerParams
///   Deviations  |G|² in (3); a large innovation counts as innovation_limit_sigma·√S, or one knock would move the
///               log unbalance by whole units; x is held in [−kLowest, kHighest] and a variance at most 1, beyond which
///               the linearised exponential means nothing; all three are counted. Nothing is fused for three time
///               constants of the high-pass after the start or a gap
///   Errata      docs/equations/errata.md#ghalamchi2020
///   Valid for   Δt in (0, kLongestStep_s]; a longer gap restarts the high-pass and fuses nothing. Rotors that beat
///               slowly against each other make z correlated in time, which (5) does not know: r₀ stands for it
///   Cost        N + 1 exponentials and about 4·(N + 1)² flops, no heap. Plain loops: the same bits on every machine
template <class Scalar, std::size_t N>
class SignalPowerEkf {
 public:
  static_assert(N >= 3 && N <= 8);
  static constexpr std::size_t kStates = N + 1;
  static constexpr double kLongestStep_s = 0.1;
  static constexpr double kLowest = 7.0;   ///< e⁻⁷: a thousandth of U₀
  static constexpr double kHighest = 7.0;  ///< a thousand times U₀
  using Rotors = std::array<Scalar, N>;
  using Vector = std::array<Scalar, kStates>;
  using Matrix = std::array<Vector, kStates>;

  struct Sample {
    TimePoint time;
    Scalar ax_m_s2 = 0;  ///< specific force, body x and y
    Scalar ay_m_s2 = 0;
    Rotors speed_rad_s{};  ///< measured, or commanded and sent through MotorLag
  };

  /// What the log needs to recompute a step.
  struct Innovation {
    Scalar power_m2_s4 = 0;                 ///< z
    Scalar innovation_m2_s4 = 0;            ///< z − h
    Scalar variance_m4_s8 = 0;              ///< S
    Scalar measurement_variance_m4_s8 = 0;  ///< R
    Scalar nis = 0;                         ///< (z − h)²/S
  };

  /// Times a limit acted.
  struct Limits {
    std::int64_t innovation = 0;
    std::int64_t state = 0;
    std::int64_t variance = 0;
  };

  /// What the flight since some memory_s has told about each rotor; see isolation().
  struct Isolation {
    Rotors information{};  ///< 1/(J⁻¹)ᵢᵢ: about sᵢ = (Uᵢ/U₀)², all other rotors and the noise unknown
    Rotors alone{};  ///< Jᵢᵢ: the same if all others were known. information/alone → 0: confounded
    std::array<Rotors, N> correlation{};  ///< of the errors of sᵢ, sⱼ; near −1: one can stand for the other
  };

  /// (8): what speaks for each rotor as the only one that differs from the others, or from the baseline.
  struct Culprits {
    Rotors evidence{};        ///< log likelihood ratio; 0 where the rotor would have to shake less
    Rotors unbalance_kg_m{};  ///< of this rotor if it is the one: baseline, common change and growth
  };

  explicit SignalPowerEkf(const SignalPowerParams& params) noexcept
      : reference_kg_m_{static_cast<Scalar>(1e-6 * params.initial_tip_mass_mg * params.propeller_radius_m)},
        tip_mass_mg_per_kg_m_{static_cast<Scalar>(1e6 / params.propeller_radius_m)},
        reference_acceleration_{static_cast<Scalar>(1e-6 * params.initial_tip_mass_mg *
                                                    params.propeller_radius_m / params.mass_kg)},
        reference_noise_m_s2_{static_cast<Scalar>(params.initial_noise_m_s2)},
        extra_variance_{static_cast<Scalar>(params.extra_variance_m4_s8)},
        high_pass_rad_s_{static_cast<Scalar>(2.0 * std::numbers::pi * params.high_pass_Hz)},
        memory_s_{static_cast<Scalar>(params.information_memory_s)},
        innovation_limit_{static_cast<Scalar>(params.innovation_limit_sigma)},
        settling_time_{from_seconds(3.0 / (2.0 * std::numbers::pi * params.high_pass_Hz))},
        sensor_{params.sensor} {
    for (std::size_t i = 0; i < kStates; ++i) {
      const bool is_noise = i == N;
      const double sigma = is_noise ? params.noise_sigma : params.unbalance_sigma;
      const double walk = is_noise ? params.noise_walk_per_sqrt_s : params.unbalance_walk_per_sqrt_s;
      p_[i][i] = static_cast<Scalar>(sigma * sigma);
      walk_[i] = static_cast<Scalar>(walk * walk);
    }
  }

  /// Fuses one sample. kConverging: the high-pass settles, nothing fused. On kNotFinite and kTimeBackward everything
  /// is as before, and `innovation` is meaningless on anything but kFused.
  UpdateStatus update(const Sample& sample, Innovation& innovation) noexcept {
    if (!is_finite(sample)) return refuse(UpdateStatus::kNotFinite);
    if (!has_sample_) {
      restart(sample);
      return UpdateStatus::kConverging;
    }
    if (sample.time <= time_) return refuse(UpdateStatus::kTimeBackward);
    const auto dt_s = static_cast<Scalar>(to_seconds(sample.time - time_));
    if (dt_s > static_cast<Scalar>(kLongestStep_s)) {
      drift(dt_s);
      restart(sample);
      return UpdateStatus::kConverging;
    }
    const HighPass passed = high_pass(sample, dt_s);
    if (sample.time - settling_since_ < settling_time_) {
      take(sample, passed);
      return UpdateStatus::kConverging;
    }
    return fuse(sample, passed, dt_s, innovation);
  }

  /// Uᵢ, mass times radius.
  [[nodiscard]] Scalar unbalance_kg_m(std::size_t rotor) const noexcept {
    return reference_kg_m_ * exp(x_[rotor]);
  }
  /// Uᵢ as a mass at the tip.
  [[nodiscard]] Scalar tip_mass_mg(std::size_t rotor) const noexcept {
    return unbalance_kg_m(rotor) * tip_mass_mg_per_kg_m_;
  }
  /// σ, per axis.
  [[nodiscard]] Scalar noise_m_s2() const noexcept { return reference_noise_m_s2_ * exp(x_[N]); }
  /// ln Uᵢ/U₀, and at N ln σ/σ₀.
  [[nodiscard]] const Vector& state() const noexcept { return x_; }
  [[nodiscard]] const Matrix& covariance() const noexcept { return p_; }
  /// Standard deviation of ln Uᵢ, so the relative one of Uᵢ.
  [[nodiscard]] Scalar relative_sigma(std::size_t rotor) const noexcept {
    return std::sqrt(p_[rotor][rotor]);
  }
  [[nodiscard]] const Limits& limits() const noexcept { return limits_; }
  [[nodiscard]] std::int64_t fused() const noexcept { return fused_; }
  [[nodiscard]] std::int64_t refused() const noexcept { return refused_; }

  /// What (7) tells of each rotor. Cost: an inversion of order N + 1; for the rate of a report.
  [[nodiscard]] Isolation isolation() const noexcept;
  /// Standard deviation of an unbalance of this size at an information Iᵢ of (7): s = (U/U₀)², so
  /// σ_U = U₀²/(2U·√Iᵢ). Infinite at no information.
  [[nodiscard]] Scalar unbalance_sigma_kg_m(Scalar information, Scalar unbalance_kg_m) const noexcept {
    return reference_kg_m_ * reference_kg_m_ / (Scalar{2} * unbalance_kg_m * std::sqrt(information));
  }
  /// (8). `baseline`: powers() of a healthy flight; zero where there is none. Cost: N + 1 solutions of order 2; for the
  /// rate of a report.
  [[nodiscard]] Culprits culprits(const Rotors& baseline) const noexcept;
  /// sⱼ = (Uⱼ/U₀)² by the least squares of (7), all rotors at once, each within about 1 of their mean (a priori): what
  /// the flight cannot tell apart stays alike. Negative values are noise. Cost as isolation().
  [[nodiscard]] Rotors powers() const noexcept;
  /// J of (7), by rotor and last the noise.
  [[nodiscard]] const Matrix& information() const noexcept { return information_; }

  /// Expected power h, its derivative H and variance R at a state, with e^{2x} at hand for (7).
  struct Prediction {
    Scalar power_m2_s4 = 0;
    Scalar variance_m4_s8 = 0;
    Vector jacobian{};
    Vector square{};  ///< e^{2x}
  };
  [[nodiscard]] Prediction predict(const Vector& x, const Rotors& speed_rad_s) const noexcept;

 private:
  struct HighPass {
    Scalar x = 0;
    Scalar y = 0;
  };

  [[nodiscard]] static bool is_finite(const Sample& sample) noexcept {
    Scalar sum = sample.ax_m_s2 * sample.ax_m_s2 + sample.ay_m_s2 * sample.ay_m_s2;
    for (const Scalar speed : sample.speed_rad_s) sum += speed * speed;
    return std::isfinite(sum);
  }

  UpdateStatus refuse(UpdateStatus why) noexcept {
    ++refused_;
    return why;
  }

  void restart(const Sample& sample) noexcept {
    has_sample_ = true;
    settling_since_ = sample.time;
    take(sample, {});
  }

  // First order by the exact pole, gain 1 at the Nyquist frequency.
  [[nodiscard]] HighPass high_pass(const Sample& sample, Scalar dt_s) const noexcept {
    const Scalar pole = exp(-high_pass_rad_s_ * dt_s);
    const Scalar gain = static_cast<Scalar>(0.5) * (Scalar{1} + pole);
    return {pole * passed_.x + gain * (sample.ax_m_s2 - last_.x),
            pole * passed_.y + gain * (sample.ay_m_s2 - last_.y)};
  }

  void take(const Sample& sample, const HighPass& passed) noexcept {
    time_ = sample.time;
    last_ = {sample.ax_m_s2, sample.ay_m_s2};
    passed_ = passed;
  }

  void drift(Scalar dt_s) noexcept {  // Q·Δt of (6)
    for (std::size_t i = 0; i < kStates; ++i) p_[i][i] += walk_[i] * dt_s;
    limit_variances();
  }

  UpdateStatus fuse(const Sample& sample, const HighPass& passed, Scalar dt_s,
                    Innovation& innovation) noexcept {
    const Prediction predicted = predict(x_, sample.speed_rad_s);
    const Vector& h = predicted.jacobian;
    Vector ph{};
    Scalar s = predicted.variance_m4_s8;
    for (std::size_t i = 0; i < kStates; ++i) {
      Scalar sum{0};
      for (std::size_t j = 0; j < kStates; ++j) sum += p_[i][j] * h[j];
      ph[i] = sum + walk_[i] * dt_s * h[i];
      s += ph[i] * h[i];
    }
    const Scalar z = passed.x * passed.x + passed.y * passed.y;
    innovation.power_m2_s4 = z;
    innovation.innovation_m2_s4 = z - predicted.power_m2_s4;
    innovation.variance_m4_s8 = s;
    innovation.measurement_variance_m4_s8 = predicted.variance_m4_s8;
    innovation.nis = innovation.innovation_m2_s4 * innovation.innovation_m2_s4 / s;
    if (!(s > Scalar{0}) || !std::isfinite(innovation.nis)) return refuse(UpdateStatus::kNotFinite);
    take(sample, passed);
    correct(ph, s, limited(innovation.innovation_m2_s4, s), dt_s);
    inform(predicted, z, dt_s);
    ++fused_;
    return UpdateStatus::kFused;
  }

  [[nodiscard]] Scalar limited(Scalar innovation, Scalar s) noexcept {
    const Scalar most = innovation_limit_ * std::sqrt(s);
    if (std::abs(innovation) <= most) return innovation;
    ++limits_.innovation;
    return std::copysign(most, innovation);
  }

  void correct(const Vector& ph, Scalar s, Scalar innovation, Scalar dt_s) noexcept {  // (6)
    const Scalar inverse = Scalar{1} / s;
    for (std::size_t i = 0; i < kStates; ++i) {
      x_[i] += ph[i] * inverse * innovation;
      p_[i][i] += walk_[i] * dt_s;
      // The product of two numbers does not depend on their order, so P stays symmetric to the bit.
      for (std::size_t j = 0; j < kStates; ++j) p_[i][j] -= ph[i] * ph[j] * inverse;
    }
    for (Scalar& x : x_) {
      const Scalar held = std::clamp(x, static_cast<Scalar>(-kLowest), static_cast<Scalar>(kHighest));
      if (held != x) ++limits_.state;
      x = held;
    }
    limit_variances();
  }

  void limit_variances() noexcept {
    for (std::size_t i = 0; i < kStates; ++i) {
      if (p_[i][i] <= Scalar{1}) continue;
      ++limits_.variance;
      // Scaling a row and its column keeps P positive definite.
      const Scalar scale = Scalar{1} / std::sqrt(p_[i][i]);
      for (std::size_t j = 0; j < kStates; ++j) {
        p_[i][j] *= scale;
        p_[j][i] = p_[i][j];
      }
      p_[i][i] = Scalar{1};
    }
  }

  void inform(const Prediction& predicted, Scalar z, Scalar dt_s) noexcept {  // (7)
    const Scalar keep = Scalar{1} / (Scalar{1} + dt_s / memory_s_);           // e^{−Δt/T} to (Δt/T)²/2
    const Scalar weight = Scalar{1} / predicted.variance_m4_s8;
    count_ = count_ * keep + Scalar{1};
    squares_ = squares_ * keep + z * z * weight;
    Vector g{};
    for (std::size_t i = 0; i < kStates; ++i)
      g[i] = predicted.jacobian[i] / (Scalar{2} * predicted.square[i]);
    for (std::size_t i = 0; i < kStates; ++i) {
      const Scalar weighted = g[i] * weight;
      explained_[i] = explained_[i] * keep + weighted * z;
      for (std::size_t j = 0; j < kStates; ++j)
        information_[i][j] = information_[i][j] * keep + weighted * g[j];
    }
  }

  Scalar reference_kg_m_;
  Scalar tip_mass_mg_per_kg_m_;
  Scalar reference_acceleration_;  ///< U₀/m: fᵢ·Δ₀ = reference_acceleration_·ωᵢ², κ cancels
  Scalar reference_noise_m_s2_;
  Scalar extra_variance_;
  Scalar high_pass_rad_s_;
  Scalar memory_s_;
  Scalar innovation_limit_;
  Duration settling_time_;
  SensorGain<Scalar> sensor_;
  Vector walk_{};  ///< Q: variance per second

  bool has_sample_ = false;
  TimePoint time_;
  TimePoint settling_since_;
  HighPass last_;    ///< unfiltered
  HighPass passed_;  ///< filtered
  Vector x_{};
  Matrix p_{};
  Matrix information_{};
  // Forgotten as J: Σ g·z/R, Σ z²/R, Σ 1.
  Vector explained_{};
  Scalar squares_ = 0;
  Scalar count_ = 0;
  Limits limits_;
  std::int64_t fused_ = 0;
  std::int64_t refused_ = 0;
};

template <class Scalar, std::size_t N>
typename SignalPowerEkf<Scalar, N>::Prediction SignalPowerEkf<Scalar, N>::predict(
    const Vector& x, const Rotors& speed_rad_s) const noexcept {
  Prediction result;
  Scalar rotors{0};
  Scalar pairs{0};  // Σ_{j<i} wᵢwⱼ: half of the double sum of (5), with nothing to cancel
  for (std::size_t i = 0; i < N; ++i) {
    result.square[i] = exp(Scalar{2} * x[i]);
    const Scalar acceleration = reference_acceleration_ * speed_rad_s[i] * speed_rad_s[i];
    const Scalar w = acceleration * acceleration * result.square[i] * sensor_.power(speed_rad_s[i]);
    pairs += w * rotors;
    rotors += w;
    result.jacobian[i] = Scalar{2} * w;  // (4)
  }
  result.square[N] = exp(Scalar{2} * x[N]);
  const Scalar noise = reference_noise_m_s2_ * reference_noise_m_s2_ * result.square[N];
  result.jacobian[N] = Scalar{4} * noise;
  result.power_m2_s4 = rotors + Scalar{2} * noise;                                                     // (3)
  result.variance_m4_s8 = Scalar{4} * noise * (noise + rotors) + Scalar{2} * pairs + extra_variance_;  // (5)
  return result;
}

template <class Scalar, std::size_t N>
typename SignalPowerEkf<Scalar, N>::Isolation SignalPowerEkf<Scalar, N>::isolation() const noexcept {
  Isolation result;
  BoundedMatrix<Scalar, static_cast<int>(kStates)> j(kStates, kStates);
  BoundedMatrix<Scalar, static_cast<int>(kStates)> inverse;
  // In units of √Jᵢᵢ, so that rounding treats all rotors alike. A rotor nothing is known of stands apart.
  Vector unit{};
  for (std::size_t i = 0; i < kStates; ++i) {
    const bool is_told = information_[i][i] > Scalar{0};
    unit[i] = is_told ? std::sqrt(information_[i][i]) : Scalar{1};
  }
  constexpr Scalar kRounding = Scalar{16} * std::numeric_limits<Scalar>::epsilon();
  for (std::size_t i = 0; i < kStates; ++i) {
    for (std::size_t k = 0; k < kStates; ++k) {
      const Scalar ridge = i != k ? Scalar{0} : (information_[i][i] > Scalar{0} ? kRounding : Scalar{1});
      j(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          information_[i][k] / (unit[i] * unit[k]) + ridge;
    }
  }
  if (!invert_positive_definite<Scalar, static_cast<int>(kStates)>(j, inverse)) return result;
  for (std::size_t i = 0; i < N; ++i) {
    const auto a = static_cast<Eigen::Index>(i);
    result.alone[i] = information_[i][i];
    result.information[i] = information_[i][i] / inverse(a, a);
    for (std::size_t k = 0; k < N; ++k) {
      const auto b = static_cast<Eigen::Index>(k);
      result.correlation[i][k] = inverse(a, b) / std::sqrt(inverse(a, a) * inverse(b, b));
    }
  }
  return result;
}

template <class Scalar, std::size_t N>
typename SignalPowerEkf<Scalar, N>::Rotors SignalPowerEkf<Scalar, N>::powers() const noexcept {
  using Square = BoundedMatrix<Scalar, static_cast<int>(kStates)>;
  Square a(kStates, kStates);
  Square inverse;
  for (std::size_t i = 0; i < kStates; ++i) {
    for (std::size_t j = 0; j < kStates; ++j) {
      // The prior is on the deviations from the mean: I − 1·1ᵀ/N for the rotors, nothing for the noise.
      Scalar prior{0};
      if (i < N && j < N) prior = (i == j ? Scalar{1} : Scalar{0}) - Scalar{1} / static_cast<Scalar>(N);
      a(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = information_[i][j] + prior;
    }
  }
  Rotors result{};
  if (!invert_positive_definite<Scalar, static_cast<int>(kStates)>(a, inverse)) return result;
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < kStates; ++j) {
      result[i] += inverse(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) * explained_[j];
    }
  }
  return result;
}

template <class Scalar, std::size_t N>
typename SignalPowerEkf<Scalar, N>::Culprits SignalPowerEkf<Scalar, N>::culprits(
    const Rotors& baseline) const noexcept {
  // What the baseline leaves to explain, r, and the normal equations of [common, noise].
  Vector r = explained_;
  Rotors with_common{};
  Scalar common{0};
  Scalar common_noise{0};
  Scalar common_r{0};
  Scalar squares = squares_;
  for (std::size_t j = 0; j < N; ++j) {
    for (std::size_t i = 0; i < kStates; ++i) r[i] -= information_[i][j] * baseline[j];
  }
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < N; ++j) with_common[i] += information_[i][j];
    common += with_common[i];
    common_noise += information_[i][N];
    common_r += r[i];
    squares -= baseline[i] * (explained_[i] + r[i]);
  }
  Culprits result;
  const Scalar noise = information_[N][N];
  const Scalar determinant = common * noise - common_noise * common_noise;
  if (!(determinant > Scalar{0})) return result;
  const auto solve = [&](Scalar a, Scalar b) {
    return std::array{(noise * a - common_noise * b) / determinant,
                      (common * b - common_noise * a) / determinant};
  };
  const auto without = solve(common_r, r[N]);
  const Scalar mean_square = (squares - without[0] * common_r - without[1] * r[N]) / count_;
  if (!(mean_square > Scalar{0})) return result;
  constexpr Scalar kRounding = Scalar{64} * std::numeric_limits<Scalar>::epsilon();
  for (std::size_t i = 0; i < N; ++i) {
    // Rotor i projected off [common, noise]: what is left of its regressor and of r.
    const auto share = solve(with_common[i], information_[i][N]);
    const Scalar left = information_[i][i] - with_common[i] * share[0] - information_[i][N] * share[1];
    const Scalar told = r[i] - with_common[i] * without[0] - information_[i][N] * without[1];
    if (!(left > kRounding * information_[i][i]) || !(told > Scalar{0})) continue;
    const Scalar growth = told / left;
    result.evidence[i] = static_cast<Scalar>(0.5) * told * growth / mean_square;
    const Scalar power = baseline[i] + without[0] + growth * (Scalar{1} - share[0]);
    result.unbalance_kg_m[i] = reference_kg_m_ * std::sqrt(std::max(power, Scalar{0}));
  }
  return result;
}

}  // namespace airworthy
