#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/math/elementary.h"
#include "core/math/phasor.h"

namespace airworthy {

/// What a group of rotors that turn alike make together. Nobody can say how much of it is whose; but propellers that
/// make no more than their baselines never make more together than the sum of these, however they stand to each other.
///   Sum        A = Σᵢ A₊ᵢ·e^{jθᵢ} over the group, for one sense of rotation; of all its rotors, as the tracker deals the
///              sum out over those of the other sense too                                                      (1)
///   Variance   of a real part:  ¼·Σᵢⱼ (cos δ·(P_rr + P_ii) + sin δ·(P_ri − P_ir)),  δ = θᵢ − θⱼ,  P of (i, j)  (2)
///   Source     order_tracker.h (1), (4); docs/equations/order_tracking.md, "Equal speeds"
///   Symbols    A₊ᵢ, θᵢ, P → turning_m_s2(), phase_rad(), covariance_m2_s4() of the tracker; group: bit i = rotor i + 1
template <class Scalar>
struct RotorsTogether {
  Scalar amplitude_m_s2 = 0;
  Scalar sigma_m_s2 = 0;
};

template <class Scalar, class Tracker>
[[nodiscard]] RotorsTogether<Scalar> rotors_together(const Tracker& tracker, std::uint32_t group,
                                                     int spin) noexcept {
  Phasor<Scalar> sum{};
  Scalar trace = 0;
  for (std::size_t i = 0; i < Tracker::kRotors; ++i) {
    if ((group >> i & 1U) == 0U) continue;
    const SinCos<Scalar> turn = sincos(tracker.phase_rad(i));
    sum = sum + tracker.turning_m_s2(i, spin) * Phasor<Scalar>{turn.cos, turn.sin};  // (1)
    for (std::size_t j = 0; j < Tracker::kRotors; ++j) {
      if ((group >> j & 1U) == 0U) continue;
      const SinCos<Scalar> between = sincos(tracker.phase_rad(i) - tracker.phase_rad(j));
      const auto P = [&](std::size_t a, std::size_t b) {
        return tracker.covariance_m2_s4(2 * i + a, 2 * j + b);
      };
      trace += between.cos * (P(0, 0) + P(1, 1)) + between.sin * (P(0, 1) - P(1, 0));  // (2)
    }
  }
  return {sum.magnitude(), std::sqrt(std::max(Scalar{0}, static_cast<Scalar>(0.25) * trace))};
}

}  // namespace airworthy
