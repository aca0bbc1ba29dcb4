#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace airworthy {

/// Which rotors are out of balance by what the signal-power filter tells of their powers (Uᵢ/U₀)².
///
/// A rotor is named when for kHold_s its least unbalance, kSigmas below what is read, is above its baseline by the
/// smallest growth and by kLeak of the largest growth of another rotor: of rotors that turn alike, one may pass for
/// another. Not before kLeast_s of learning, in which the filter finds the scale of the speeds.
template <std::size_t N>
class PowerPolicy {
 public:
  static constexpr double kSigmas = 2.0;
  static constexpr double kLeak = 0.5;
  static constexpr double kHold_s = 1.0;
  static constexpr double kLeast_s = 5.0;
  using Rotors = std::array<double, N>;

  /// U₀, the unbalance of the healthy vehicle, and the growth that is reported.
  PowerPolicy(double reference_kg_m, const Rotors& baseline_kg_m, double smallest_kg_m) noexcept
      : reference_kg_m_{reference_kg_m}, baseline_kg_m_{baseline_kg_m}, smallest_kg_m_{smallest_kg_m} {}

  struct Verdict {
    Rotors unbalance_kg_m{};
    Rotors sigma_kg_m{};
    Rotors growth_kg_m{};  ///< over the baseline
    std::array<bool, N> is_named{};
  };

  /// A new flight, or nobody asks for a while: what has grown must last anew.
  void restart() noexcept { held_s_.fill(0.0); }

  /// `information` is that about the power, 1/σ². To be asked every `dt_s`; `learned_s`: what the powers rest upon.
  [[nodiscard]] Verdict judge(const Rotors& power, const Rotors& information, double learned_s,
                              double dt_s) noexcept {
    Verdict verdict;
    Rotors least_growth{};
    for (std::size_t i = 0; i < N; ++i) {
      const double sigma = 1.0 / std::sqrt(information[i]);  // infinite where nothing is told
      const double at_least = std::max(0.0, power[i]);       // noise may make a power negative
      verdict.unbalance_kg_m[i] = unbalance_kg_m(power[i]);
      verdict.growth_kg_m[i] = verdict.unbalance_kg_m[i] - baseline_kg_m_[i];
      const double width = unbalance_kg_m(at_least + sigma) - unbalance_kg_m(at_least - sigma);
      verdict.sigma_kg_m[i] = at_least > sigma ? 0.5 * width : width;  // at zero there is but one side
      least_growth[i] = unbalance_kg_m(power[i] - kSigmas * sigma) - baseline_kg_m_[i];
    }
    for (std::size_t i = 0; i < N; ++i) {
      double others_kg_m = 0.0;
      for (std::size_t j = 0; j < N; ++j) {
        if (j != i) others_kg_m = std::max(others_kg_m, verdict.growth_kg_m[j]);
      }
      const bool has_grown = learned_s >= kLeast_s && least_growth[i] > smallest_kg_m_ + kLeak * others_kg_m;
      held_s_[i] = has_grown ? held_s_[i] + dt_s : 0.0;
      verdict.is_named[i] = held_s_[i] >= kHold_s;
    }
    return verdict;
  }

 private:
  [[nodiscard]] double unbalance_kg_m(double power) const noexcept {
    return reference_kg_m_ * std::sqrt(std::max(0.0, power));
  }

  double reference_kg_m_;
  Rotors baseline_kg_m_;
  double smallest_kg_m_;
  Rotors held_s_{};
};

}  // namespace airworthy
