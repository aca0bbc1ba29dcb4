#pragma once

#include <array>

#include "core/math/elementary.h"
#include "core/math/phasor.h"

namespace airworthy {

/// What becomes of a vibration e^{jωt} on its way into the samples that the order tracker fuses.
///   High-pass   twice yₖ = α·(yₖ₋₁ + uₖ − uₖ₋₁), α = 1/(1 + ω_c·Δt), so H = (α·(1 − z⁻¹)/(1 − α·z⁻¹))², z = e^{jωΔt}  (1)
///   Low-pass    of the sensor, Butterworth of second order: 1/(1 − x² + j·√2·x), x = ω/ω_lp                    (2)
///   Average     over the window T, seen from its middle: sin(ωT/2)/(ωT/2)                                      (3)
/// (1) is exact at a steady rate of sampling, beyond half of it too; (2) and (3) act ahead of the sampling, so they
/// are exact at any speed for an analogue filter.
template <class Scalar>
class SensorResponse {
 public:
  /// Zero for a filter that is not there.
  SensorResponse(Scalar high_pass_rad_s, Scalar low_pass_Hz) noexcept
      : high_pass_rad_s_{high_pass_rad_s}, low_pass_rad_s_{kTwoPi * low_pass_Hz} {}

  /// The high-passed sample of two axes, (1).
  std::array<Scalar, 2> high_pass(std::array<Scalar, 2> sample, Scalar dt_s) noexcept {
    alpha_ = Scalar{1} / (Scalar{1} + high_pass_rad_s_ * dt_s);
    std::array<Scalar, 2> result{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      Stage& stage = stage_[axis];
      const Scalar first = alpha_ * (stage.first + sample[axis] - stage.input);
      stage.second = alpha_ * (stage.second + first - stage.first);
      stage.first = first;
      stage.input = sample[axis];
      result[axis] = stage.second;
    }
    return result;
  }

  /// Starts at a sample as if it had always been so.
  void restart(std::array<Scalar, 2> sample) noexcept {
    for (std::size_t axis = 0; axis < 2; ++axis) stage_[axis] = {sample[axis], 0, 0};
  }

  /// G(jω) = (1)·(2)·(3) for the newest α.
  [[nodiscard]] Phasor<Scalar> at(Scalar speed_rad_s, Scalar dt_s, Scalar window_s) const noexcept {
    const SinCos<Scalar> z = sincos(speed_rad_s * dt_s);
    const Phasor<Scalar> step{Scalar{1} - z.cos, z.sin};
    const Phasor<Scalar> once = alpha_ * step / Phasor<Scalar>{Scalar{1} - alpha_ * z.cos, alpha_ * z.sin};
    return once * once * sensor(speed_rad_s, window_s);
  }

  /// (2)·(3): what the sensor leaves of a vibration.
  [[nodiscard]] Phasor<Scalar> sensor(Scalar speed_rad_s, Scalar window_s) const noexcept {
    Phasor<Scalar> gain{1, 0};
    if (low_pass_rad_s_ > Scalar{0}) {
      const Scalar x = speed_rad_s / low_pass_rad_s_;
      gain = gain / Phasor<Scalar>{Scalar{1} - x * x, static_cast<Scalar>(1.4142135623730951) * x};
    }
    const Scalar half = static_cast<Scalar>(0.5) * speed_rad_s * window_s;
    // sin(h)/h = 1 − h²/6 to better than 1e-9 below.
    if (half > static_cast<Scalar>(0.01)) return sincos(half).sin / half * gain;
    return (Scalar{1} - half * half / Scalar{6}) * gain;
  }

 private:
  static constexpr Scalar kTwoPi = static_cast<Scalar>(6.283185307179586);
  struct Stage {
    Scalar input = 0;
    Scalar first = 0;
    Scalar second = 0;
  };
  Scalar high_pass_rad_s_;
  Scalar low_pass_rad_s_;
  Scalar alpha_ = 1;
  std::array<Stage, 2> stage_{};
};

}  // namespace airworthy
