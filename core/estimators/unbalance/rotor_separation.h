#pragma once

#include <array>
#include <cstddef>

namespace airworthy {

/// Which rotors have turned differently enough to be told apart by their phases, whatever their telemetry's noise.
///   Turned     Dᵢ ← Dᵢ·(1 − Δt/T) + ωᵢ·Δt;  its noise Vᵢ ← Vᵢ·(1 − 2·Δt/T) + qᵢ·Δt                          (1)
///   Apart      (Dᵢ − Dⱼ)² > 5²·(Vᵢ + Vⱼ) within the last 5 s                                               (2)
///   Source     our own; docs/equations/order_tracking.md, "Equal speeds"
///   Symbols    Dᵢ → turned_ [rad]; Vᵢ → variance_ [rad²]; qᵢ: random walk of the phase by noise of the telemetry [rad²/s];
///              T = 1 s
/// Two rotors of one speed have phases that seem to drift apart by that noise alone. A filter that believes the
/// phases takes the drift for information, and which of the two it then blames is a matter of luck.
template <class Scalar, std::size_t N>
class RotorSeparation {
 public:
  void reset() noexcept { *this = {}; }

  void step(const std::array<Scalar, N>& speed_rad_s, const std::array<Scalar, N>& phase_walk_rad2_s,
            Scalar dt_s) noexcept {
    const Scalar share = dt_s / kWindow_s;
    for (std::size_t i = 0; i < N; ++i) {
      turned_[i] += dt_s * speed_rad_s[i] - share * turned_[i];  // (1)
      variance_[i] += dt_s * phase_walk_rad2_s[i] - Scalar{2} * share * variance_[i];
    }
    for (std::size_t i = 0; i < N; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const Scalar between = turned_[i] - turned_[j];
        const bool is_apart = between * between > kSigmas * kSigmas * (variance_[i] + variance_[j]);  // (2)
        remembered_s_[i][j] = is_apart ? kMemory_s : remembered_s_[i][j] - dt_s;
      }
    }
  }

  [[nodiscard]] bool are_apart(std::size_t i, std::size_t j) const noexcept {
    return i > j ? remembered_s_[i][j] > Scalar{0} : remembered_s_[j][i] > Scalar{0};
  }

 private:
  static constexpr Scalar kWindow_s = 1;
  static constexpr Scalar kMemory_s = 5;
  static constexpr Scalar kSigmas = 5;

  std::array<Scalar, N> turned_{};
  std::array<Scalar, N> variance_{};
  std::array<std::array<Scalar, N>, N> remembered_s_{};
};

}  // namespace airworthy
