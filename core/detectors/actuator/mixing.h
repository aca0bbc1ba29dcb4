#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>

#include "core/vehicle/multirotor.h"

namespace airworthy::actuator {

enum Axis : std::uint8_t { kRoll, kPitch, kYaw, kHeight };
inline constexpr std::size_t kAxes = 4;
inline constexpr int kRotorColumns = static_cast<int>(kMaxRotors);

/// What each rotor's specific thrust sⱼ = thrust/mass does: rows roll, pitch, yaw acceleration in rad/s² per m/s²,
/// and specific force upward in m/s² per m/s².
///   moment of rotor j = Tⱼ·(r × a + spin·λ·a),  a: thrust axis, r: hub, λ: torque ratio
/// A clockwise rotor turns about +z (down), so that the body feels its drag about −z, along a. Columns of rotors that
/// the vehicle does not have are 0.
using MixingMatrix = Eigen::Matrix<double, static_cast<int>(kAxes), kRotorColumns>;

inline MixingMatrix mixing_matrix(const Multirotor& vehicle) noexcept {
  MixingMatrix mixing = MixingMatrix::Zero();
  int column = 0;
  for (const Rotor& rotor : vehicle.rotors()) {
    const auto& r = rotor.position_m;
    const auto& a = rotor.thrust_axis;
    const double drag = rotor.spin * vehicle.torque_ratio_m;
    const double moment[3] = {r[1] * a[2] - r[2] * a[1] + drag * a[0],
                              r[2] * a[0] - r[0] * a[2] + drag * a[1],
                              r[0] * a[1] - r[1] * a[0] + drag * a[2]};
    for (int axis = 0; axis < 3; ++axis) {
      mixing(axis, column) =
          vehicle.mass_kg / vehicle.inertia_kg_m2[static_cast<std::size_t>(axis)] * moment[axis];
    }
    mixing(kHeight, column) = -a[2];
    ++column;
  }
  return mixing;
}

}  // namespace airworthy::actuator
