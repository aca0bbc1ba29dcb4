#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "core/vehicle/multirotor.h"

namespace airworthy {

/// What an accelerometer beside the centre of mass feels of the unbalance of one rotor, of a rigid body: the force
/// at the hub turns the vehicle too, and the accelerometer has a lever arm. On a small vehicle this is a sixth of an
/// axis.
///   Body       a = f/M + (J⁻¹·(c×f))×p,  f = E·(cos θ, s·sin θ, 0),  E = diag(1 + e, 1 − e)                  (1)
///   Columns    M·a = B·f:  B_xx = 1 + M·(c_z·p_z/J_y + c_y·p_y/J_z),  B_xy = −M·c_x·p_y/J_z,
///              B_yx = −M·c_y·p_x/J_z,  B_yy = 1 + M·(c_z·p_z/J_x + c_x·p_x/J_z)                               (2)
///   Response   M·|A₊|/|f| = ½·|B_xx·(1 + e) + B_yy·(1 − e) + j·s·(B_yx·(1 + e) − B_xy·(1 − e))|,
///              A₊ the part that turns with the rotor, order_tracker.h (4)                                     (3)
///   Source     Newton and Euler; docs/equations/order_tracking.md, "The way to the accelerometer"
///   Symbols    M → mass_kg; J → inertia_kg_m2; c → hub, p → accelerometer, from the centre of mass [m]; s → spin;
///              e → unevenness, of an airframe that answers x by 1 + e and y by 1 − e
///   Frame      body: x forward, y right, z down
/// 1 for an accelerometer in the centre of mass. Without moments of inertia the vehicle is taken not to turn.
[[nodiscard]] inline double rigid_body_response(const Multirotor& vehicle, std::size_t rotor,
                                                double unevenness = 0.0) noexcept {
  const std::array<double, 3>& hub = vehicle.rotor[rotor].position_m;
  const std::array<double, 3>& imu = vehicle.imu_position_m;
  const auto lever = [&](std::size_t of_hub, std::size_t of_imu, std::size_t about) {
    const double inertia = vehicle.inertia_kg_m2[about];
    return inertia > 0.0 ? vehicle.mass_kg * hub[of_hub] * imu[of_imu] / inertia : 0.0;
  };
  const double x = 1.0 + unevenness;
  const double y = 1.0 - unevenness;
  const double along =
      x * (1.0 + lever(2, 2, 1) + lever(1, 1, 2)) + y * (1.0 + lever(2, 2, 0) + lever(0, 0, 2));
  const double across = x * -lever(1, 0, 2) - y * -lever(0, 1, 2);
  return 0.5 * std::hypot(along, across);  // (3)
}

/// 1σ of what a trial mass on one rotor says of the response to another, of itself: the axes may answer unevenly, by
/// `against_ratio` either way, and moments of inertia and levers of a vehicle file are estimates.
[[nodiscard]] inline double response_transfer_sigma(const Multirotor& vehicle, std::size_t trial,
                                                    std::size_t rotor, double against_ratio) noexcept {
  constexpr double kGeometrySigma = 0.15;
  const auto transfer = [&](double unevenness) {
    return rigid_body_response(vehicle, rotor, unevenness) / rigid_body_response(vehicle, trial, unevenness);
  };
  const double even = transfer(0.0);
  const double more_x = transfer(against_ratio) / even - 1.0;
  const double more_y = transfer(-against_ratio) / even - 1.0;
  return std::hypot(std::sqrt(0.5 * (more_x * more_x + more_y * more_y)), kGeometrySigma * (even - 1.0));
}

}  // namespace airworthy
