#pragma once

#include <algorithm>
#include <cmath>

namespace airworthy {

/// The amplitude of one rotor over the time since it last changed: for a mass, where the newest half second is for
/// alarms.
///   Power      p ← p + Δt/min(t, T)·(|Â|² − 2σ² − p),  t the time since a change, T = 20 s                     (1)
///   Sigma      σ/√max(1, min(t, T)/τ): errors of the tracker last for about τ = 1.6 s                          (2)
///   Change     newest amplitude, of the last t₀ = 0.5 s, more than 3σ from √p: p its square, t = t₀              (3)
///   Symbols    p → power_ [m²/s⁴];  σ → sigma_m_s2, of a real part of Â;  t → age_s_
class SteadyAmplitude {
 public:
  void restart() noexcept { age_s_ = 0.0; }

  /// `power` = |Â|² − 2σ² of this moment, `newest_m_s2` the amplitude that the last half second shows.
  void add(double power, double sigma_m_s2, double newest_m_s2, double dt_s) noexcept {
    if (std::abs(newest_m_s2 - amplitude_m_s2()) > kSigmas * sigma_m_s2) {  // (3)
      power_ = newest_m_s2 * newest_m_s2;
      age_s_ = kNewest_s;
    }
    age_s_ = std::min(age_s_ + dt_s, kMost_s);
    power_ += std::min(1.0, dt_s / age_s_) * (power - power_);
    sigma_m_s2_ = sigma_m_s2 / std::sqrt(std::max(1.0, age_s_ / kErrorsLast_s));
  }

  /// False before the first add() and after restart(): the rest means nothing.
  [[nodiscard]] bool has_value() const noexcept { return age_s_ > 0.0; }
  [[nodiscard]] double amplitude_m_s2() const noexcept { return std::sqrt(std::max(0.0, power_)); }
  [[nodiscard]] double sigma_m_s2() const noexcept { return sigma_m_s2_; }

 private:
  static constexpr double kMost_s = 20.0;
  static constexpr double kErrorsLast_s = 1.6;
  static constexpr double kNewest_s = 0.5;
  static constexpr double kSigmas = 3.0;
  double power_ = 0.0;
  double sigma_m_s2_ = 0.0;
  double age_s_ = 0.0;
};

}  // namespace airworthy
