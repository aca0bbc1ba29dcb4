#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

#include "core/estimators/unbalance/flat_band.h"
#include "core/estimators/unbalance/signal_power_params.h"
#include "core/estimators/update_status.h"
#include "core/math/cholesky.h"
#include "core/math/elementary.h"
#include "core/time/time.h"

namespace airworthy {

/// Unbalance of every rotor from the power of the horizontal vibration, without knowledge of rotor phases. The bank
/// says in how many bands: FlatBand, the whole vibration at once, makes it the source's filter; RotorBands tells the rotors
/// apart by their frequencies.
///   State       x = [ln Uᵢ/U₀ (N rotors), ln σ/σ₀];  dx = q·dW                                            (1)
///   Measurement ã = high-pass(a), first order; of it z, g, n for each band, by the bank. Flat: z = ãx² + ãy²   (2)
///   Model       wᵢ = gᵢ·e^{2xᵢ};  h = E z = Σ wᵢ + n·σ²;  flat: gᵢ = (fᵢ·Δ₀)²·|G(ωᵢ)|², n = 2                 (3)
///   Jacobian    Hᵢ = ∂h/∂xᵢ = 2wᵢ;  H_{N+1} = 2nσ²                                                        (4)
///   Noise       flat: R = 4σ⁴ + ΣᵢΣ_{j≠i} wᵢwⱼ + 4σ²·Σ wᵢ + r₀ = h² − Σ wᵢ² + r₀;  RotorBands: R = h²·τ/Δt + r₀   (5)
///   Update      P ← P + Q·Δt;  S = H·P·Hᵀ + R;  x ← x + P·Hᵀ·S⁻¹·(z − h);  P ← P − P·Hᵀ·S⁻¹·H·P, all bands at once (6)
///   Information J ← J·e^{−Δt/T_J} + Σ_b g·gᵀ/R, of the powers uᵢ = (Uᵢ/U₀)² and (σ/σ₀)²;  g = ∂h/∂u = Hᵢ/(2uᵢ);
///               least squares of the same weights  u = J⁻¹·b,  b ← b·e^{−Δt/T_J} + Σ_b g·z/R. RotorBands: R times
///               max(1, z/h)², both summed over the bands and smoothed                                      (7)
///   Source      B. Ghalamchi, Z. Jia, M. W. Mueller, Real-Time Vibration-Based Propeller Fault Diagnosis for
///               Multicopters: (1) to (6), flat; the rest is ours. Entry in docs/equations/references.md, derivation in
///               docs/equations/unbalance_power.md
///   Symbols     Uᵢ → unbalance_kg_m(), mass times radius;  fᵢ = κωᵢ², Δᵢ = Uᵢ/(κm) [m/s² per N],
///               so that fᵢΔᵢ = Uᵢωᵢ²/m and κ cancels;  σ → noise_m_s2();
///               P → p_;  J → information_;  b → explained_;  T_J → memory_s_;  q_Δ, q_d, r₀, σ₀: SignalPowerParams
///   Deviations  |G|² in (3); a large innovation counts as innovation_limit_sigma·√S, or one knock would move the
///               log unbalance by whole units; x is held in [−kLowest, kHighest] and a variance at most 1, beyond which
///               the linearised exponential means nothing; all three are counted. Nothing is fused for three time
///               constants of the high-pass after the start or a gap
///   Errata      docs/equations/errata.md#ghalamchi2020
///   Valid for   Δt in (0, kLongestStep_s]; a longer gap restarts the high-pass and fuses nothing. Rotors that beat
///               slowly against each other make z correlated in time, which (5) does not know: r₀, or τ, stands for it
///   Cost        N + 1 exponentials and about 6·(N + 1)² flops for each band, and the bank's; no heap. Plain loops: the
///               same bits on every machine
template <class Scalar, std::size_t N, class Bank = FlatBand<Scalar, N>>
class SignalPowerEkf {
 public:
  static_assert(N >= 3 && N <= 8);
  static constexpr std::size_t kStates = N + 1;
  static constexpr double kLongestStep_s = 0.1;
  static constexpr double kLowest = 7.0;   ///< e⁻⁷: a thousandth of U₀
  static constexpr double kHighest = 7.0;  ///< a thousand times U₀
  static constexpr double kMisfitTime_s = 0.5;
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
    /// uᵢ = (Uᵢ/U₀)² by least squares: linear, so with neither prior nor convergence; noise may make it negative.
    Rotors power{};
    Rotors information{};  ///< 1/(J⁻¹)ᵢᵢ: about uᵢ, all other rotors and the noise unknown
    Rotors alone{};  ///< Jᵢᵢ: the same if all others were known. information/alone → 0: confounded
    std::array<Rotors, N> correlation{};  ///< of the errors of uᵢ, uⱼ; near −1: one can stand for the other
  };

  explicit SignalPowerEkf(const SignalPowerParams& params) noexcept
      : reference_kg_m_{static_cast<Scalar>(1e-6 * params.initial_tip_mass_mg * params.propeller_radius_m)},
        tip_mass_mg_per_kg_m_{static_cast<Scalar>(1e6 / params.propeller_radius_m)},
        reference_noise_m_s2_{static_cast<Scalar>(params.initial_noise_m_s2)},
        extra_variance_{static_cast<Scalar>(params.extra_variance_m4_s8)},
        high_pass_rad_s_{static_cast<Scalar>(2.0 * std::numbers::pi * params.high_pass_Hz)},
        memory_s_{static_cast<Scalar>(params.information_memory_s)},
        innovation_limit_{static_cast<Scalar>(params.innovation_limit_sigma)},
        settling_time_{from_seconds(3.0 / (2.0 * std::numbers::pi * params.high_pass_Hz))},
        bank_{params} {
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
    const Phasor<Scalar> passed = high_pass(sample, dt_s);
    Bank bank = bank_;
    const typename Bank::Readings readings = bank.step(passed, sample.speed_rad_s, dt_s);
    if (sample.time - settling_since_ < settling_time_) {
      take(sample, passed, bank);
      return UpdateStatus::kConverging;
    }
    const Vector square = squares(x_);
    Predictions predictions;
    for (std::size_t b = 0; b < Bank::kBands; ++b) predictions[b] = predict(square, readings[b]);
    Belief belief{x_, p_, limits_};
    if (!correct(readings, predictions, dt_s, belief, innovation)) return refuse(UpdateStatus::kNotFinite);
    inform(readings, predictions, square, dt_s);
    if (bank.follow(square, readings, dt_s)) {
      information_ = {};
      explained_ = {};
      learned_s_ = 0;
    }
    take(sample, passed, bank);
    x_ = belief.x;
    p_ = belief.p;
    limits_ = belief.limits;
    ++fused_;
    return UpdateStatus::kFused;
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
  [[nodiscard]] const Bank& bank() const noexcept { return bank_; }
  [[nodiscard]] const Limits& limits() const noexcept { return limits_; }
  [[nodiscard]] std::int64_t fused() const noexcept { return fused_; }
  [[nodiscard]] std::int64_t refused() const noexcept { return refused_; }

  /// What (7) tells of each rotor. Cost: an inversion of order N + 1; for the rate of a report.
  [[nodiscard]] Isolation isolation() const noexcept;
  /// Standard deviation of an unbalance of this size at an information Iᵢ of (7): u = (U/U₀)², so
  /// σ_U = U₀²/(2U·√Iᵢ). Infinite at no information.
  [[nodiscard]] Scalar unbalance_sigma_kg_m(Scalar information, Scalar unbalance_kg_m) const noexcept {
    return reference_kg_m_ * reference_kg_m_ / (Scalar{2} * unbalance_kg_m * std::sqrt(information));
  }
  /// For how long J has been learned.
  [[nodiscard]] Scalar learned_s() const noexcept { return learned_s_; }
  /// J of (7), by rotor and last the noise.
  [[nodiscard]] const Matrix& information() const noexcept { return information_; }

  /// Expected power h of a band, its derivative H and variance R.
  struct Prediction {
    Scalar power_m2_s4 = 0;
    Scalar variance_m4_s8 = 0;
    Vector jacobian{};
  };
  /// At a state given by squares().
  [[nodiscard]] Prediction predict(const Vector& square,
                                   const BandReading<Scalar, N>& reading) const noexcept;
  /// e^{2x}: (Uᵢ/U₀)², and last (σ/σ₀)².
  [[nodiscard]] static Vector squares(const Vector& x) noexcept {
    Vector result{};
    for (std::size_t i = 0; i < kStates; ++i) result[i] = exp(Scalar{2} * x[i]);
    return result;
  }

 private:
  using Predictions = std::array<Prediction, Bank::kBands>;

  struct Belief {
    Vector x{};
    Matrix p{};
    Limits limits;
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
    bank_.restart();
    take(sample, {}, bank_);
  }

  // First order by the exact pole, gain 1 at the Nyquist frequency.
  [[nodiscard]] Phasor<Scalar> high_pass(const Sample& sample, Scalar dt_s) const noexcept {
    const Scalar pole = exp(-high_pass_rad_s_ * dt_s);
    const Scalar gain = static_cast<Scalar>(0.5) * (Scalar{1} + pole);
    return {pole * passed_.re + gain * (sample.ax_m_s2 - last_.re),
            pole * passed_.im + gain * (sample.ay_m_s2 - last_.im)};
  }

  void take(const Sample& sample, const Phasor<Scalar>& passed, const Bank& bank) noexcept {
    time_ = sample.time;
    last_ = {sample.ax_m_s2, sample.ay_m_s2};
    passed_ = passed;
    bank_ = bank;
  }

  void drift(Scalar dt_s) noexcept {  // Q·Δt of (6)
    for (std::size_t i = 0; i < kStates; ++i) p_[i][i] += walk_[i] * dt_s;
    limit_variances(p_, limits_);
  }

  // (6) for all bands at once: their errors are independent, so one after the other gives the same.
  [[nodiscard]] bool correct(const typename Bank::Readings& readings, const Predictions& predictions,
                             Scalar dt_s, Belief& belief, Innovation& innovation) const noexcept {
    innovation = {};
    Scalar drift_s = dt_s;
    for (std::size_t b = 0; b < Bank::kBands; ++b) {
      const Prediction& predicted = predictions[b];
      Scalar residual = readings[b].power_m2_s4 - predicted.power_m2_s4;
      for (std::size_t i = 0; i < kStates; ++i) residual -= predicted.jacobian[i] * (belief.x[i] - x_[i]);
      if (!correct(predicted, residual, drift_s, belief, innovation)) return false;
      innovation.power_m2_s4 += readings[b].power_m2_s4;
      drift_s = 0;
    }
    innovation.nis /= static_cast<Scalar>(Bank::kBands);
    for (Scalar& x : belief.x) {
      const Scalar held = std::clamp(x, static_cast<Scalar>(-kLowest), static_cast<Scalar>(kHighest));
      if (held != x) ++belief.limits.state;
      x = held;
    }
    limit_variances(belief.p, belief.limits);
    return true;
  }

  [[nodiscard]] bool correct(const Prediction& predicted, Scalar residual, Scalar dt_s, Belief& belief,
                             Innovation& innovation) const noexcept {
    const Vector& h = predicted.jacobian;
    Vector ph{};
    Scalar s = predicted.variance_m4_s8;
    for (std::size_t i = 0; i < kStates; ++i) {
      Scalar sum{0};
      for (std::size_t j = 0; j < kStates; ++j) sum += belief.p[i][j] * h[j];
      ph[i] = sum + walk_[i] * dt_s * h[i];
      s += ph[i] * h[i];
    }
    const Scalar nis = residual * residual / s;
    if (!(s > Scalar{0}) || !std::isfinite(nis)) return false;
    innovation.innovation_m2_s4 += residual;
    innovation.variance_m4_s8 += s;
    innovation.measurement_variance_m4_s8 += predicted.variance_m4_s8;
    innovation.nis += nis;
    const Scalar limited_residual = limited(residual, s, belief.limits);
    const Scalar inverse = Scalar{1} / s;
    for (std::size_t i = 0; i < kStates; ++i) {
      belief.x[i] += ph[i] * inverse * limited_residual;
      belief.p[i][i] += walk_[i] * dt_s;
      // The product of two numbers does not depend on their order, so P stays symmetric to the bit.
      for (std::size_t j = 0; j < kStates; ++j) belief.p[i][j] -= ph[i] * ph[j] * inverse;
    }
    return true;
  }

  [[nodiscard]] Scalar limited(Scalar residual, Scalar s, Limits& limits) const noexcept {
    const Scalar most = innovation_limit_ * std::sqrt(s);
    if (std::abs(residual) <= most) return residual;
    ++limits.innovation;
    return std::copysign(most, residual);
  }

  static void limit_variances(Matrix& p, Limits& limits) noexcept {
    for (std::size_t i = 0; i < kStates; ++i) {
      if (p[i][i] <= Scalar{1}) continue;
      ++limits.variance;
      // Scaling a row and its column keeps P positive definite.
      const Scalar scale = Scalar{1} / std::sqrt(p[i][i]);
      for (std::size_t j = 0; j < kStates; ++j) {
        p[i][j] *= scale;
        p[j][i] = p[i][j];
      }
      p[i][i] = Scalar{1};
    }
  }

  void inform(const typename Bank::Readings& readings, const Predictions& predictions, const Vector& square,
              Scalar dt_s) noexcept {                                // (7)
    const Scalar keep = Scalar{1} / (Scalar{1} + dt_s / memory_s_);  // e^{−Δt/T_J} to (Δt/T_J)²/2
    for (std::size_t i = 0; i < kStates; ++i) {
      explained_[i] *= keep;
      for (Scalar& element : information_[i]) element *= keep;
    }
    learned_s_ += dt_s;
    const Scalar misfit = misfit_of(readings, predictions, dt_s);
    for (std::size_t b = 0; b < Bank::kBands; ++b) {
      const Scalar weight = Scalar{1} / (predictions[b].variance_m4_s8 * misfit * misfit);
      Vector g{};
      for (std::size_t i = 0; i < kStates; ++i) g[i] = predictions[b].jacobian[i] / (Scalar{2} * square[i]);
      for (std::size_t i = 0; i < kStates; ++i) {
        const Scalar weighted = g[i] * weight;
        explained_[i] += weighted * readings[b].power_m2_s4;
        for (std::size_t j = 0; j < kStates; ++j) information_[i][j] += weighted * g[j];
      }
    }
  }

  // Where R goes with h² alone, an h too low by far would make the first samples outweigh all that follow.
  [[nodiscard]] Scalar misfit_of(const typename Bank::Readings& readings, const Predictions& predictions,
                                 Scalar dt_s) noexcept {
    if (Bank::kLinesAreSteady) return Scalar{1};
    Scalar felt{0};
    Scalar expected{0};
    for (std::size_t b = 0; b < Bank::kBands; ++b) {
      felt += readings[b].power_m2_s4;
      expected += predictions[b].power_m2_s4;
    }
    const Scalar share = dt_s / (dt_s + static_cast<Scalar>(kMisfitTime_s));
    felt_m2_s4_ += share * (felt - felt_m2_s4_);
    expected_m2_s4_ += share * (expected - expected_m2_s4_);
    return std::max(Scalar{1}, felt_m2_s4_ / expected_m2_s4_);
  }

  Scalar reference_kg_m_;
  Scalar tip_mass_mg_per_kg_m_;
  Scalar reference_noise_m_s2_;
  Scalar extra_variance_;
  Scalar high_pass_rad_s_;
  Scalar memory_s_;
  Scalar innovation_limit_;
  Duration settling_time_;
  Vector walk_{};  ///< Q: variance per second

  bool has_sample_ = false;
  TimePoint time_;
  TimePoint settling_since_;
  Phasor<Scalar> last_;    ///< unfiltered
  Phasor<Scalar> passed_;  ///< filtered
  Bank bank_;
  Vector x_{};
  Matrix p_{};
  Matrix information_{};
  Vector explained_{};    ///< Σ g·z/R
  Scalar learned_s_ = 0;  ///< since J was empty
  Scalar felt_m2_s4_ = 0;
  Scalar expected_m2_s4_ = 0;
  Limits limits_;
  std::int64_t fused_ = 0;
  std::int64_t refused_ = 0;
};

template <class Scalar, std::size_t N, class Bank>
typename SignalPowerEkf<Scalar, N, Bank>::Prediction SignalPowerEkf<Scalar, N, Bank>::predict(
    const Vector& square, const BandReading<Scalar, N>& reading) const noexcept {
  Prediction result;
  Scalar rotors{0};
  Scalar pairs{0};  // Σ_{j<i} wᵢwⱼ: half of the double sum of (5), with nothing to cancel
  Scalar own{0};    // Σ wᵢ²
  for (std::size_t i = 0; i < N; ++i) {
    const Scalar w = reading.gain_m2_s4[i] * square[i];
    pairs += w * rotors;
    own += w * w;
    rotors += w;
    result.jacobian[i] = Scalar{2} * w;  // (4)
  }
  const Scalar noise = reading.noise_gain * reference_noise_m_s2_ * reference_noise_m_s2_ * square[N];
  result.jacobian[N] = Scalar{2} * noise;
  result.power_m2_s4 = rotors + noise;                                         // (3)
  Scalar variance = noise * (noise + Scalar{2} * rotors) + Scalar{2} * pairs;  // (5)
  if constexpr (!Bank::kLinesAreSteady) variance += own;
  result.variance_m4_s8 = variance / reading.observations + extra_variance_;
  return result;
}

template <class Scalar, std::size_t N, class Bank>
typename SignalPowerEkf<Scalar, N, Bank>::Isolation SignalPowerEkf<Scalar, N, Bank>::isolation()
    const noexcept {
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
    for (std::size_t k = 0; k < kStates; ++k)
      result.power[i] += inverse(a, static_cast<Eigen::Index>(k)) * explained_[k] / (unit[i] * unit[k]);
    for (std::size_t k = 0; k < N; ++k) {
      const auto b = static_cast<Eigen::Index>(k);
      result.correlation[i][k] = inverse(a, b) / std::sqrt(inverse(a, a) * inverse(b, b));
    }
  }
  return result;
}

}  // namespace airworthy
