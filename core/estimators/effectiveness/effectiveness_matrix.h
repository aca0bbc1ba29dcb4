#pragma once

#include <array>
#include <cstddef>

#include "core/vehicle/multirotor.h"

namespace airworthy {

/// What a rotor acts on: body rates p, q, r and the vertical specific force (FRD, down positive).
enum EffectivenessRow : std::size_t { kRollRow, kPitchRow, kYawRow, kVerticalRow };
inline constexpr std::size_t kEffectivenessRows = 4;

/// Control effectiveness of every rotor, B.
///   (ṗ, q̇, ṙ, a_z)ᵀ = B·(ω₁² … ω_N²)ᵀ                                                                (1)
///   column i of a vehicle file:  I⁻¹·κ·(hub × axis + spin·κ_m·axis),  κ/m·axis_z                        (2)
/// Rates in rad/s² and force in m/s² per (rad/s)². Without inertia of the rotors, gyroscopic terms and air speed.
template <class Scalar>
struct EffectivenessMatrix {
  std::array<std::array<Scalar, kMaxRotors>, kEffectivenessRows> per_speed2{};
  std::size_t rotor_count = 0;

  [[nodiscard]] static EffectivenessMatrix of(const Multirotor& vehicle) noexcept {
    EffectivenessMatrix matrix;
    matrix.rotor_count = vehicle.rotor_count;
    for (std::size_t i = 0; i < vehicle.rotor_count; ++i) {
      const auto& hub = vehicle.rotor[i].position_m;
      const auto& axis = vehicle.rotor[i].thrust_axis;
      const double drag = static_cast<double>(vehicle.rotor[i].spin) * vehicle.torque_ratio_m;
      const std::array moment{hub[1] * axis[2] - hub[2] * axis[1] + drag * axis[0],
                              hub[2] * axis[0] - hub[0] * axis[2] + drag * axis[1],
                              hub[0] * axis[1] - hub[1] * axis[0] + drag * axis[2]};
      for (std::size_t row = 0; row < 3; ++row) {
        matrix.per_speed2[row][i] = static_cast<Scalar>(vehicle.thrust_coefficient_N_s2 * moment[row] /
                                                        vehicle.inertia_kg_m2[row]);  // (2)
      }
      matrix.per_speed2[kVerticalRow][i] =
          static_cast<Scalar>(vehicle.thrust_coefficient_N_s2 * axis[2] / vehicle.mass_kg);
    }
    return matrix;
  }
};

/// How much faster the air meets rotor i when the body turns, over the speed of the rotor, per p and q: a rotor that moves
/// along its axis with v gives κω(ω − c_in·v/R), v = Ω·(hub × axis).
[[nodiscard]] inline std::array<double, 2> inflow_per_rate(const Multirotor& vehicle,
                                                           std::size_t i) noexcept {
  const auto& hub = vehicle.rotor[i].position_m;
  const auto& axis = vehicle.rotor[i].thrust_axis;
  const double per_speed =
      vehicle.propeller_radius_m > 0.0 ? vehicle.inflow_ratio / vehicle.propeller_radius_m : 0.0;
  return {per_speed * (hub[1] * axis[2] - hub[2] * axis[1]),
          per_speed * (hub[2] * axis[0] - hub[0] * axis[2])};
}

}  // namespace airworthy
