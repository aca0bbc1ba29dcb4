#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>

#include "core/vehicle/multirotor.h"

namespace airworthy::test {

/// Puts upright rotors on a circle, every second one turning the other way, the first of them clockwise and half a spacing
/// to the right of forward.
inline void put_on_ring(Multirotor& vehicle, std::size_t rotors, double arm_m, double z_m = 0.0) {
  vehicle.rotor_count = rotors;
  for (std::size_t i = 0; i < rotors; ++i) {
    const double azimuth_rad =
        2.0 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(rotors);
    vehicle.rotor[i] = {.position_m = {arm_m * std::cos(azimuth_rad), arm_m * std::sin(azimuth_rad), z_m},
                        .spin = i % 2 == 0 ? 1 : -1};
  }
}

/// Like a Bebop 2 in size, with any number of rotors; of its propellers only what they lift and how they twist.
inline Multirotor bebop_ring(std::size_t rotors) {
  Multirotor vehicle;
  vehicle.mass_kg = 0.5;
  vehicle.inertia_kg_m2 = {0.0023, 0.0018, 0.0036};
  vehicle.thrust_coefficient_N_s2 = 8e-6 / static_cast<double>(rotors);
  vehicle.torque_ratio_m = 0.012;
  put_on_ring(vehicle, rotors, 0.14, -0.01);
  return vehicle;
}

}  // namespace airworthy::test
