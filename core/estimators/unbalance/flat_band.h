#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "core/estimators/unbalance/signal_power_params.h"
#include "core/math/phasor.h"

namespace airworthy {

/// What one band holds of a sample, and what a model of rotors and noise expects of it:
///   h = Σ gainᵢ·(Uᵢ/U₀)² + noise_gain·σ²
/// A bank of bands offers kBands, kLinesAreSteady, restart(), step() and follow(), as FlatBand and RotorBands do.
template <class Scalar, std::size_t N>
struct BandReading {
  Scalar power_m2_s4 = 0;              ///< z
  std::array<Scalar, N> gain_m2_s4{};  ///< of a rotor with U₀
  Scalar noise_gain = 0;               ///< of noise with σ = 1 m/s² per axis
  Scalar observations = 1;             ///< independent ones that this reading is worth
};

/// The source's own measurement: the power of the whole horizontal vibration.
///   z = ãx² + ãy²;  gainᵢ = (U₀ωᵢ²/m)²·|G(ωᵢ)|²;  noise_gain = 2                                           (1)
template <class Scalar, std::size_t N>
class FlatBand {
 public:
  static constexpr std::size_t kBands = 1;
  /// A rotor adds the same power to every sample; what varies is how it meets the others and the noise.
  static constexpr bool kLinesAreSteady = true;
  using Rotors = std::array<Scalar, N>;
  using Readings = std::array<BandReading<Scalar, N>, kBands>;

  explicit FlatBand(const SignalPowerParams& params) noexcept
      : reference_m_{static_cast<Scalar>(params.reference_m())}, sensor_{params.sensor} {}

  void restart() noexcept {}

  [[nodiscard]] Readings step(Phasor<Scalar> vibration_m_s2, const Rotors& speed_rad_s,
                              Scalar /*dt_s*/) noexcept {
    Readings result;
    result[0].power_m2_s4 = vibration_m_s2.squared();
    result[0].noise_gain = Scalar{2};
    for (std::size_t i = 0; i < N; ++i) {
      const Scalar acceleration = reference_m_ * speed_rad_s[i] * speed_rad_s[i];
      result[0].gain_m2_s4[i] = acceleration * acceleration * sensor_.power(speed_rad_s[i]);
    }
    return result;
  }

  template <class Powers>
  [[nodiscard]] bool follow(const Powers& /*power*/, const Readings& /*readings*/, Scalar /*dt_s*/) noexcept {
    return false;
  }

 private:
  Scalar reference_m_;  ///< U₀/m
  SensorGain<Scalar> sensor_;
};

}  // namespace airworthy
