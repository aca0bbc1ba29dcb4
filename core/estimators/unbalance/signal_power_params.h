#pragma once

#include <array>

#include "core/estimators/unbalance/sensor_gain.h"
#include "core/vehicle/multirotor.h"

namespace airworthy {

/// Of RotorBands; not in the source.
struct RotorBandsParams {
  std::array<int, kMaxRotors> spin{};  ///< +1 clockwise seen from above, −1 counter-clockwise
  /// ε: 1σ of the speeds that the filter is given, over the speeds: half the width of a band. Commands through the
  /// motor lag are right to 1 to 2 %.
  double speed_error_ratio = 0.02;
  double correlation_s = 0.3;  ///< τ: how long an error of the speeds lasts: about as long as a manoeuvre
};

/// Of SignalPowerEkf. Defaults are those of the source, for its 690 g and 1170 g vehicles.
struct SignalPowerParams {
  static constexpr double kSqrtMinute = 7.7459666924148338;  ///< √60, in √s

  double mass_kg = 0.0;
  double propeller_radius_m = 0.0;
  double initial_tip_mass_mg = 20.0;  ///< Δ₀, as a mass at the tip; 2 for the 39 g vehicle
  double initial_noise_m_s2 = 1.0;    ///< σ₀, per axis
  double unbalance_sigma = 0.1;       ///< √P₀ of each log unbalance
  double noise_sigma = 0.05;          ///< √P₀ of the log noise
  double unbalance_walk_per_sqrt_s = 0.2 / kSqrtMinute;  ///< q_Δ: 20 % in a minute
  double noise_walk_per_sqrt_s = 0.05 / kSqrtMinute;     ///< q_d: 5 % in a minute
  double extra_variance_m4_s8 = 100.0;                   ///< r₀: what the model does not know of z
  double high_pass_Hz = 1.0;
  SensorGainParams sensor;               ///< not in the source
  double information_memory_s = 60.0;    ///< time constant of forgetting of the Fisher information
  double innovation_limit_sigma = 10.0;  ///< innovations beyond it count as this many √S; infinite = no limit
  RotorBandsParams bands;

  /// For RotorBands: their readings are told apart by frequency, so that nothing need be known beforehand.
  void expect_nothing() noexcept {
    unbalance_sigma = noise_sigma = 0.8;
    extra_variance_m4_s8 = 0.0;
    noise_walk_per_sqrt_s = unbalance_walk_per_sqrt_s;
  }

  /// U₀.
  [[nodiscard]] constexpr double reference_kg_m() const noexcept {
    return 1e-6 * initial_tip_mass_mg * propeller_radius_m;
  }
  /// U₀/m: acceleration of the body by U₀ over the square of the rotor speed.
  [[nodiscard]] constexpr double reference_m() const noexcept {
    return 1e-6 * initial_tip_mass_mg * propeller_radius_m / mass_kg;
  }
};

}  // namespace airworthy
