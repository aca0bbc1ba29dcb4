#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "core/math/elementary.h"

namespace airworthy {

/// Speed of each rotor from its commanded speed, where no telemetry tells it.
///   τ·ω̇ = ω* − ω, the command held between samples:  ω ← ω + (1 − e^(−Δt/τ))·(ω* − ω)                      (1)
///   Symbols    τ → time_constant_s_;  ω → speed_rad_s_;  ω* → commanded_rad_s
///   Valid for  any Δt ≥ 0: (1) is the exact solution. What is not finite leaves a rotor as it was
template <class Scalar, std::size_t N>
class MotorLag {
 public:
  using Rotors = std::array<Scalar, N>;

  /// `time_constant_s` ≥ 0; at 0 the speed is the command.
  explicit MotorLag(Scalar time_constant_s) noexcept : time_constant_s_{time_constant_s} {}

  /// The first call takes the commands for the speeds.
  const Rotors& step(const Rotors& commanded_rad_s, Scalar dt_s) noexcept {
    const bool follows = has_speed_ && time_constant_s_ > Scalar{0};
    const Scalar share = follows ? Scalar{1} - exp(-dt_s / time_constant_s_) : Scalar{1};
    if (!(share >= Scalar{0})) return speed_rad_s_;
    for (std::size_t i = 0; i < N; ++i) {
      if (!std::isfinite(commanded_rad_s[i])) continue;
      speed_rad_s_[i] += share * (commanded_rad_s[i] - speed_rad_s_[i]);  // (1)
    }
    has_speed_ = true;
    return speed_rad_s_;
  }

  [[nodiscard]] const Rotors& speed_rad_s() const noexcept { return speed_rad_s_; }

 private:
  Scalar time_constant_s_;
  Rotors speed_rad_s_{};
  bool has_speed_ = false;
};

}  // namespace airworthy
