#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace airworthy {

inline constexpr std::size_t kMaxRotors = 8;

/// Where a rotor is and which way it turns. Body frame: x forward, y right, z down, origin at the centre of mass.
struct Rotor {
  std::array<double, 3> position_m{};           ///< hub
  std::array<double, 3> thrust_axis{0, 0, -1};  ///< unit vector of the thrust; (0, 0, -1) = straight up
  int spin = 1;                                 ///< +1 clockwise seen from above, -1 counter-clockwise
};

/// A multirotor as its vehicle file describes it: rigid body, identical rotors. Plain data, shared by the
/// detectors, which take it as nominal, and the simulator, which flies one that differs from it.
struct Multirotor {
  double mass_kg = 0.0;
  std::array<double, 3> inertia_kg_m2{};  ///< about x, y, z, taken as principal axes
  double thrust_coefficient_N_s2 = 0.0;   ///< static thrust = coefficient · speed², speed in rad/s
  double torque_ratio_m = 0.0;            ///< drag torque / thrust
  double propeller_radius_m = 0.0;
  double propeller_inertia_kg_m2 = 0.0;    ///< of propeller and rotor bell about their axis
  double motor_time_constant_s = 0.0;      ///< commanded speed to speed, first order
  double speed_min_rad_s = 0.0;            ///< at command 0, armed
  double speed_max_rad_s = 0.0;            ///< at command 1
  std::array<double, 3> imu_position_m{};  ///< accelerometer, from the centre of mass
  std::array<double, 3>
      vibration_response{};   ///< force felt by the IMU / force at the hubs, per axis, near the rotor speed
  double inflow_ratio = 0.0;  ///< thrust lost = inflow_ratio · axial airspeed / tip speed · static thrust
  double rotor_drag_ratio =
      0.0;  ///< in-plane drag = rotor_drag_ratio · in-plane airspeed / tip speed · static thrust
  std::array<double, 3> body_drag_N_s2_m2{};  ///< drag = body_drag · |v| v, per axis
  double gear_height_m = 0.0;                 ///< centre of mass above the ground when standing
  double gear_radius_m = 0.0;                 ///< feet from the vertical through the centre of mass

  std::array<Rotor, kMaxRotors> rotor{};
  std::size_t rotor_count = 0;

  [[nodiscard]] std::span<const Rotor> rotors() const noexcept { return std::span{rotor}.first(rotor_count); }
};

}  // namespace airworthy
