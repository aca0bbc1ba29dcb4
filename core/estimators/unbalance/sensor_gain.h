#pragma once

#include <cmath>
#include <numbers>

#include "core/math/elementary.h"

namespace airworthy {

/// What the way from the rotor to the sample is known to do to a vibration; 0 = nothing known, taken as no loss.
struct SensorGainParams {
  double filter_cutoff_Hz = 0.0;    ///< −3 dB of the accelerometer's low-pass, Butterworth of second order
  double averaging_window_s = 0.0;  ///< each sample is the mean over this time
};

/// Power gain of accelerometer and averaging at a rotor speed.
///   |G(ω)|² = 1/(1 + (ω/ω_c)⁴) · (sin(ωT/2)/(ωT/2))²                                                     (1)
///   Symbols    ω_c → cutoff_rad_s_;  T → window_s_
///   Valid for  a filter that runs well above the rotor speed. Sampling afterwards changes no power: aliasing
///              moves the frequency of a rotating vector and keeps its length
template <class Scalar>
class SensorGain {
 public:
  explicit SensorGain(const SensorGainParams& params) noexcept
      : cutoff_rad_s_{static_cast<Scalar>(2.0 * std::numbers::pi * params.filter_cutoff_Hz)},
        window_s_{static_cast<Scalar>(params.averaging_window_s)} {}

  [[nodiscard]] Scalar power(Scalar speed_rad_s) const noexcept {
    Scalar gain{1};
    if (cutoff_rad_s_ > Scalar{0}) {
      const Scalar ratio = speed_rad_s / cutoff_rad_s_;
      const Scalar square = ratio * ratio;
      gain /= Scalar{1} + square * square;
    }
    // Below 1e-3 the second factor is 1 − 3e-7 or more.
    const Scalar half_angle = static_cast<Scalar>(0.5) * speed_rad_s * window_s_;
    if (std::abs(half_angle) > static_cast<Scalar>(1e-3)) {
      const Scalar mean = sincos(half_angle).sin / half_angle;
      gain *= mean * mean;
    }
    return gain;
  }

 private:
  Scalar cutoff_rad_s_;
  Scalar window_s_;
};

}  // namespace airworthy
