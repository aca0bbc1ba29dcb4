#pragma once

#include <array>
#include <cstddef>

#include "core/estimators/effectiveness/effectiveness_matrix.h"
#include "core/vehicle/multirotor.h"

namespace airworthy::testing {

/// For evidence only: turns the inertial data of a healthy flight into what they would have been had one rotor given
/// less thrust from now on, with everything else, speeds and commands too, as it was recorded.
///   Missing   f = −s·bᵢ·ωᵢ², bᵢ the column of rotor i in the effectiveness matrix: ṗ, q̇, ṙ and a_z              (1)
///   Rates     δ̇ = f + g(Ω + δ) − g(Ω),  g(Ω) = −I⁻¹·(Ω × I·Ω);  gyro + δ                                  (2)
///   Force     accelerometer + f_z, + (δ̇ × r + Ω'×(Ω'×r) − Ω×(Ω×r)) at r from the centre of mass             (3)
/// The vehicle does not react: neither does its controller answer δ, nor the air damp it, nor do the rotors change
/// speed. A roll of 100 rad/s² is 10 rad/s wrong after 0.1 s already, so that only the first tenths of a second
/// after a great loss, and half a second after a small one, mean anything.
class ScaledOutRotor {
 public:
  using Vector = std::array<double, 3>;

  ScaledOutRotor(const EffectivenessMatrix<double>& matrix, const Multirotor& vehicle, std::size_t rotor,
                 double loss) noexcept
      : matrix_{matrix}, vehicle_{vehicle}, rotor_{rotor}, loss_{loss} {}

  /// One inertial sample, dt_s after the one before; speeds of the rotor at that one and at this, rad/s.
  void step(double dt_s, double speed_before_rad_s, double speed_rad_s, Vector& accel_m_s2,
            Vector& gyro_rad_s) noexcept;

  /// δ of (2), rad/s.
  [[nodiscard]] const Vector& rate_change() const noexcept { return delta_; }

 private:
  [[nodiscard]] Vector gyroscopic(const Vector& rate) const noexcept;

  EffectivenessMatrix<double> matrix_;
  Multirotor vehicle_;
  std::size_t rotor_;
  double loss_;
  Vector delta_{};
};

}  // namespace airworthy::testing
