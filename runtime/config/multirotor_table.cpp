#include "runtime/config/multirotor_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/vehicle/gravity.h"

namespace airworthy::rt {
namespace {

constexpr Range kPositive{1e-12, 1e6};
constexpr Range kNotNegative{0.0, 1e6};
constexpr Range kThrust_N_s2{1e-10, 0.1};  // of a propeller of 1 cm to one of 2 m
constexpr Range kLength_m{-10.0, 10.0};
constexpr std::size_t kMinRotors = 3;

Rotor read_rotor(ConfigTable table) {
  Rotor rotor;
  rotor.position_m = table.required<std::array<double, 3>>("position_m", kLength_m);
  rotor.spin = table.choice<int>("spin", {{"clockwise", 1}, {"counter_clockwise", -1}});
  rotor.thrust_axis =
      table.optional<std::array<double, 3>>("thrust_axis", {0.0, 0.0, -1.0}, Range{-1.0, 1.0});
  const auto& axis = rotor.thrust_axis;
  const double norm = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
  if (std::abs(norm - 1.0) > 1e-3) {
    table.fail("thrust_axis", fmt::format("must be a unit vector, has length {:.4g}", norm));
  } else {
    for (double& component : rotor.thrust_axis) component /= norm;
    if (rotor.thrust_axis[2] > -0.5) table.fail("thrust_axis", "must point upward, within 60 degrees of -z");
  }
  return rotor;
}

/// Two rotors in one place are a slip of the pen; without rotors all around nothing holds the vehicle level.
void check_places(ConfigTable table, const Multirotor& vehicle) {
  constexpr double kLeastDistance_m = 1e-3;
  constexpr double kCentral_m = 1e-3;
  const auto rotors = vehicle.rotors();
  std::vector<double> azimuths_rad;
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    const auto& hub = rotors[i].position_m;
    for (std::size_t k = 0; k < i; ++k) {
      const auto& other = rotors[k].position_m;
      if (std::hypot(hub[0] - other[0], hub[1] - other[1], hub[2] - other[2]) < kLeastDistance_m) {
        table.fail(fmt::format("rotor[{}].position_m", i), fmt::format("is that of rotor[{}]", k));
      }
    }
    if (std::hypot(hub[0], hub[1]) > kCentral_m) azimuths_rad.push_back(std::atan2(hub[1], hub[0]));
  }
  std::sort(azimuths_rad.begin(), azimuths_rad.end());
  double widest_rad = azimuths_rad.empty() ? 2.0 * std::numbers::pi : 0.0;
  for (std::size_t i = 0; i < azimuths_rad.size(); ++i) {
    const bool is_last = i + 1 == azimuths_rad.size();
    const double next_rad = is_last ? azimuths_rad.front() + 2.0 * std::numbers::pi : azimuths_rad[i + 1];
    widest_rad = std::max(widest_rad, next_rad - azimuths_rad[i]);
  }
  if (widest_rad > std::numbers::pi - 1e-3) {
    table.fail("rotor", "the centre of mass must lie between the hubs, or nothing holds the vehicle level");
  }
}

/// Hovering, the rotors turn at a speed that the motors have.
void check_hover(ConfigTable table, const Multirotor& vehicle) {
  double lifting_rotors = 0.0;  // each by its share upward
  for (const Rotor& rotor : vehicle.rotors()) lifting_rotors -= rotor.thrust_axis[2];
  const double weight_N = vehicle.mass_kg * kGravity_m_s2;
  const double lift_N_s2 = lifting_rotors * vehicle.thrust_coefficient_N_s2;
  const double most_thrust_N = lift_N_s2 * vehicle.speed_max_rad_s * vehicle.speed_max_rad_s;
  if (most_thrust_N < weight_N) {
    table.fail("speed_max_rad_s",
               fmt::format("all rotors at full speed lift {:.3g} N, less than the weight of {:.3g} N",
                           most_thrust_N, weight_N),
               {"mass_kg", "thrust_coefficient_N_s2", "speed_min_rad_s", "rotor"});
    return;
  }
  const double hover_rad_s = std::sqrt(weight_N / lift_N_s2);
  if (!(hover_rad_s > vehicle.speed_min_rad_s)) {
    table.fail("speed_min_rad_s",
               fmt::format(
                   "{:g} must be less than the {:.4g} rad/s at which the rotors lift the weight of {:.3g} N: "
                   "idling, the vehicle would climb",
                   vehicle.speed_min_rad_s, hover_rad_s, weight_N),
               {"mass_kg", "thrust_coefficient_N_s2", "speed_max_rad_s", "rotor"});
  }
}

}  // namespace

Multirotor read_multirotor(ConfigTable table) {
  Multirotor vehicle;
  vehicle.mass_kg = table.required<double>("mass_kg", Range{1e-3, 1e3});
  vehicle.inertia_kg_m2 = table.required<std::array<double, 3>>("inertia_kg_m2", kPositive);
  vehicle.thrust_coefficient_N_s2 = table.required<double>("thrust_coefficient_N_s2", kThrust_N_s2);
  vehicle.torque_ratio_m = table.required<double>("torque_ratio_m", Range{0.0, 1.0});
  vehicle.propeller_radius_m = table.required<double>("propeller_radius_m", Range{1e-3, 5.0});
  vehicle.propeller_inertia_kg_m2 = table.required<double>("propeller_inertia_kg_m2", kNotNegative);
  vehicle.motor_time_constant_s = table.required<double>("motor_time_constant_s", Range{1e-3, 1.0});
  vehicle.speed_min_rad_s = table.required<double>("speed_min_rad_s", Range{0.0, 1e4});
  vehicle.speed_max_rad_s = table.required<double>("speed_max_rad_s", Range{1.0, 1e4});
  if (!(vehicle.speed_max_rad_s > vehicle.speed_min_rad_s)) {
    table.fail("speed_max_rad_s",
               fmt::format("{:g} must exceed speed_min_rad_s ({:g})", vehicle.speed_max_rad_s,
                           vehicle.speed_min_rad_s),
               {"speed_min_rad_s"});
  }
  vehicle.imu_position_m =
      table.optional<std::array<double, 3>>("imu_position_m", {0.0, 0.0, 0.0}, kLength_m);
  vehicle.vibration_response =
      table.optional<std::array<double, 3>>("vibration_response", {1.0, 1.0, 1.0}, Range{0.0, 100.0});
  vehicle.inflow_ratio = table.optional<double>("inflow_ratio", 0.0, Range{0.0, 100.0});
  vehicle.rotor_drag_ratio = table.optional<double>("rotor_drag_ratio", 0.0, Range{0.0, 100.0});
  vehicle.body_drag_N_s2_m2 =
      table.optional<std::array<double, 3>>("body_drag_N_s2_m2", {0.0, 0.0, 0.0}, kNotNegative);
  vehicle.gear_height_m = table.required<double>("gear_height_m", Range{1e-3, 10.0});
  vehicle.gear_radius_m = table.required<double>("gear_radius_m", Range{1e-3, 10.0});
  const auto rotors = table.tables("rotor", {.count = Count{kMinRotors, kMaxRotors}});
  for (const ConfigTable& rotor : rotors) {
    const Rotor read = read_rotor(rotor);  // those beyond the limit too, or their keys would count as unknown
    if (vehicle.rotor_count < kMaxRotors) vehicle.rotor[vehicle.rotor_count++] = read;
  }
  check_places(table, vehicle);
  check_hover(table, vehicle);
  return vehicle;
}

}  // namespace airworthy::rt
