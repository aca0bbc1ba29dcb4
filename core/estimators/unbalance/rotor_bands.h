#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/estimators/unbalance/flat_band.h"
#include "core/estimators/unbalance/sensor_gain.h"
#include "core/estimators/unbalance/signal_power_params.h"
#include "core/math/elementary.h"
#include "core/math/phasor.h"

namespace airworthy {

/// The horizontal vibration in N bands that follow the rotors, for SignalPowerEkf: rotors are told apart by speed and
/// sense of rotation. Their phases stay unknown, and their speeds need only be about right.
///   Band        yᵢ ← (1 − κᵢ)·yᵢ + κᵢ·ã·e^{−jφᵢ};  ã = ãx + j·ãy, φ̇ᵢ = sᵢωᵢ, κᵢ = 1 − e^{−εωᵢΔt};  zᵢ = |yᵢ|²   (1)
///   Line        of rotor j: aⱼ·e^{jθⱼ}, aⱼ = (U₀ωⱼ²/m)·|G(ωⱼ)|; θⱼ turns as φⱼ but for a random walk that makes the
///               line as wide as a band: E e^{j(θⱼ(t+Δt) − θⱼ(t))} = e^{jsⱼωⱼΔt − εωⱼΔt}                          (2)
///   Correlation cᵢⱼ = E[yᵢ*·e^{j(θⱼ − φᵢ)}]:  c⁻ = cᵢⱼ·e^{j(sⱼωⱼ − sᵢωᵢ)Δt − εωⱼΔt};  cᵢⱼ ← (1 − κᵢ)·c⁻ + κᵢ·aⱼ   (3)
///   Power       gᵢⱼ = E|yᵢ|² of rotor j alone:  gᵢⱼ ← (1 − κᵢ)²·gᵢⱼ + 2κᵢ(1 − κᵢ)·aⱼ·Re c⁻ + κᵢ²·aⱼ²             (4)
///   Noise       nᵢ ← (1 − κᵢ)²·nᵢ + 2κᵢ²; a step is worth Δt/τ independent observations                        (5)
///   Scale       the given speeds times μ:  μ ← μ + 2Δt/T_μ·Σᵢ sᵢ·(rᵢ − Σⱼ (Uⱼ/U₀)²·κᵢ·aⱼ·Im c⁻)/(ωᵢΔt)/Σᵢ(zᵢ + hᵢ),
///               rᵢ = Im(yᵢ⁻*·yᵢ),  hᵢ = Σⱼ (Uⱼ/U₀)²·gᵢⱼ:  by how much the bands turn more than the model says;
///               T_μ = 5 s, |μ − 1| ≤ 0.1                                                                        (6)
///   Source      ours; docs/equations/unbalance_power.md
///   Symbols     ε, τ, sᵢ → RotorBandsParams;  yᵢ → band_;  e^{jφᵢ} → phase_;  cᵢⱼ, gᵢⱼ → view_;  rᵢ, κᵢaⱼ·Im c⁻ →
///               turning_;  μ → speed_scale_
///   Valid for   any rate of sampling: all of it is of sampled signals, and a frequency beyond half the rate goes
///               where it is seen. (4) is exact for speeds that vary in any way and are held from sample to sample. μ takes what
///               all speeds share, as the sag of a battery; it is found from some 3 % away
///   Cost        N sincos, N exponentials and about 25·N² flops, no heap
template <class Scalar, std::size_t N>
class RotorBands {
 public:
  static constexpr std::size_t kBands = N;
  /// What is left of a line in a band comes and goes as the speed does: exponentially distributed, as noise is.
  static constexpr bool kLinesAreSteady = false;
  static constexpr Scalar kScaleTime_s = 5;
  static constexpr Scalar kMostScaleError = static_cast<Scalar>(0.1);
  using Rotors = std::array<Scalar, N>;
  using Readings = std::array<BandReading<Scalar, N>, kBands>;

  explicit RotorBands(const SignalPowerParams& params) noexcept
      : reference_m_{static_cast<Scalar>(params.reference_m())},
        speed_error_{static_cast<Scalar>(params.bands.speed_error_ratio)},
        correlation_s_{static_cast<Scalar>(params.bands.correlation_s)},
        sensor_{params.sensor} {
    for (std::size_t i = 0; i < N; ++i) spin_[i] = static_cast<Scalar>(params.bands.spin[i]);
    restart();
  }

  /// After a gap: the bands are empty, the scale is kept.
  void restart() noexcept {
    phase_.fill({1, 0});
    band_.fill({});
    view_ = {};
    noise_gain_.fill(0);
  }

  /// One sample of the high-passed vibration, `dt_s` after the last.
  [[nodiscard]] Readings step(Phasor<Scalar> vibration_m_s2, const Rotors& given_rad_s,
                              Scalar dt_s) noexcept {
    std::array<Phasor<Scalar>, N> turn;  // e^{jsᵢωᵢΔt}
    Rotors keep{};                       // 1 − κᵢ, and the factor by which (2) decays
    Rotors amplitude{};                  // aⱼ
    for (std::size_t i = 0; i < N; ++i) {
      const Scalar speed = speed_scale_ * given_rad_s[i];
      const SinCos<Scalar> angle = sincos(speed * dt_s);
      turn[i] = {angle.cos, spin_[i] * angle.sin};
      keep[i] = exp(-speed_error_ * std::abs(speed) * dt_s);
      amplitude[i] = reference_m_ * speed * speed * std::sqrt(sensor_.power(speed));
      turning_[i].angle_rad = spin_[i] * speed * dt_s;
    }
    Readings result;
    for (std::size_t i = 0; i < N; ++i) {
      const Scalar kappa = Scalar{1} - keep[i];
      const Phasor<Scalar> phase = phase_[i] * turn[i];
      phase_[i] = static_cast<Scalar>(0.5) * (Scalar{3} - phase.squared()) * phase;  // of length 1 again
      const Phasor<Scalar> before = band_[i];
      band_[i] = keep[i] * before + kappa * (vibration_m_s2 * conjugate(phase_[i]));  // (1)
      turning_[i].felt = (conjugate(before) * band_[i]).im;
      noise_gain_[i] = keep[i] * keep[i] * noise_gain_[i] + Scalar{2} * kappa * kappa;  // (5)
      result[i].power_m2_s4 = band_[i].squared();
      result[i].noise_gain = noise_gain_[i];
      result[i].observations = dt_s / correlation_s_;
      for (std::size_t j = 0; j < N; ++j) {
        View& view = view_[i][j];
        const Scalar drive = kappa * amplitude[j];
        const Phasor<Scalar> turned = keep[j] * (turn[j] * conjugate(turn[i]) * view.correlation);
        view.power = keep[i] * (keep[i] * view.power + Scalar{2} * drive * turned.re) + drive * drive;  // (4)
        view.correlation = keep[i] * turned + Phasor<Scalar>{drive, 0};                                 // (3)
        turning_[i].expected[j] = drive * turned.im;
        result[i].gain_m2_s4[j] = view.power;
      }
    }
    return result;
  }

  /// (6), for rotors of powers (Uⱼ/U₀)². True where the scale has moved by ε since the last time that this
  /// was true: what was learned before was learned in other bands.
  template <class Powers>
  [[nodiscard]] bool follow(const Powers& power, const Readings& readings, Scalar dt_s) noexcept {
    Scalar turned{0};
    Scalar total{0};
    for (std::size_t i = 0; i < N; ++i) {
      Scalar unexplained = turning_[i].felt;
      total += readings[i].power_m2_s4;
      for (std::size_t j = 0; j < N; ++j) {
        unexplained -= power[j] * turning_[i].expected[j];
        total += power[j] * readings[i].gain_m2_s4[j];
      }
      if (turning_[i].angle_rad != Scalar{0}) turned += unexplained / turning_[i].angle_rad;
    }
    if (!(total > Scalar{0})) return false;
    const Scalar step = Scalar{2} * dt_s / kScaleTime_s * turned / total;
    if (!std::isfinite(step)) return false;
    const Scalar scale =
        std::clamp<Scalar>(speed_scale_ + step, Scalar{1} - kMostScaleError, Scalar{1} + kMostScaleError);
    const bool has_moved = std::abs(scale - scale_learned_with_) > speed_error_;
    speed_scale_ = scale;
    if (has_moved) scale_learned_with_ = scale;
    return has_moved;
  }

  /// μ: true speeds over given ones.
  [[nodiscard]] Scalar speed_scale() const noexcept { return speed_scale_; }

 private:
  /// How a band sees a rotor of unbalance U₀.
  struct View {
    Phasor<Scalar> correlation;
    Scalar power = 0;
  };
  /// By how much the content of a band turns in a step, times its power.
  struct Turning {
    Scalar felt = 0;
    Rotors expected{};     ///< by a rotor of U₀
    Scalar angle_rad = 0;  ///< of the rotor
  };

  [[nodiscard]] static Phasor<Scalar> conjugate(Phasor<Scalar> a) noexcept { return {a.re, -a.im}; }

  Scalar reference_m_;  ///< U₀/m
  Scalar speed_error_;
  Scalar correlation_s_;
  SensorGain<Scalar> sensor_;
  Rotors spin_{};
  std::array<Phasor<Scalar>, N> phase_{};
  std::array<Phasor<Scalar>, N> band_{};
  std::array<std::array<View, N>, N> view_{};
  Rotors noise_gain_{};
  std::array<Turning, N> turning_{};
  Scalar speed_scale_ = 1;
  Scalar scale_learned_with_ = 1;
};

}  // namespace airworthy
