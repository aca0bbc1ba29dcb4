#pragma once

#include <algorithm>

namespace airworthy {

/// By how much the clock that times a rotor's turns is wrong, told by how its vibration turns against the reported
/// phase. A motor controller without a crystal is off by some 0.1 to 1 %: a few rad/s, which smears the amplitude of
/// a rotor that is followed for seconds.
///   Model      ω = (1 + ε)·ω_reported,  ε nearly constant                                                (1)
///   Turn       φ = Im[X*·ΔX + Y*·ΔY]/(|X|² + |Y|² + 4·σ²), what one update turns the amplitudes; σ² their variance
///              in all, so that noise alone turns little                                                   (2)
///   Update     ε ← clamp(ε + φ/(ω·τ), ε₀ ± most);  τ = 1.5 s                                             (3)
///   Source     our own: a frequency-locked loop around the Kalman filter. The amplitude turns by the whole of
///              (1) even where the filter is too slow to follow it, so (3) pulls in from afar
///   Symbols    ε → error_ratio_;  ε₀ → start_, from earlier flights
///   Valid for  ε within ε₀ ± most; a rotor must not take another's vibration for its own, so most is kept small
template <class Scalar>
class SpeedScale {
 public:
  /// (3); `turn_rad` from (2).
  void learn(Scalar turn_rad, Scalar speed_rad_s, Scalar most_ratio) noexcept {
    if (!(speed_rad_s > Scalar{1})) return;
    error_ratio_ = std::clamp(error_ratio_ + turn_rad / (speed_rad_s * kTimeConstant_s), start_ - most_ratio,
                              start_ + most_ratio);
  }

  void start_at(Scalar error_ratio) noexcept { error_ratio_ = start_ = error_ratio; }

  /// ε of (1).
  [[nodiscard]] Scalar error_ratio() const noexcept { return error_ratio_; }

 private:
  static constexpr Scalar kTimeConstant_s = static_cast<Scalar>(1.5);
  Scalar error_ratio_ = 0;
  Scalar start_ = 0;
};

}  // namespace airworthy
