#pragma once

#include <array>
#include <cmath>
#include <random>

#include "core/vehicle/multirotor.h"
#include "tests/support/rotor_ring.h"

namespace airworthy::test {

/// A rigid multirotor of flat arms that hovers level: a rate controller, rotors with lag and, if the vehicle is given any,
/// inertia, and nothing else. Its physics
/// are written out again here, apart from what is tested. Even numbers of rotors, alternately turning.
class HoveringMultirotor {
 public:
  static constexpr double kStep_s = 0.002;
  static constexpr double kGravity_m_s2 = 9.81;

  HoveringMultirotor(std::size_t rotors, unsigned seed) : random_{seed} {
    vehicle.mass_kg = 1.5;
    vehicle.inertia_kg_m2 = {0.02, 0.02, 0.035};
    vehicle.thrust_coefficient_N_s2 = 1.2e-5;
    vehicle.torque_ratio_m = 0.016;
    vehicle.propeller_radius_m = 0.12;
    vehicle.motor_time_constant_s = 0.04;
    vehicle.speed_min_rad_s = 100;
    vehicle.speed_max_rad_s = 1000;
    put_on_ring(vehicle, rotors, 0.2);
    hover_rad_s_ = std::sqrt(vehicle.mass_kg * kGravity_m_s2 /
                             (static_cast<double>(rotors) * vehicle.thrust_coefficient_N_s2));
    speed_rad_s.fill(hover_rad_s_);
  }

  void step() {
    time_s += kStep_s;
    std::array<double, 3> moment_N_m{};
    double thrust_N = 0;
    for (std::size_t i = 0; i < vehicle.rotor_count; ++i) {
      // Commands: stay level, with some play about all axes.
      const auto& r = vehicle.rotor[i].position_m;
      const double play = excitation * (std::sin(2.1 * time_s) * r[1] + std::sin(2.7 * time_s + 1) * r[0]);
      const double yaw_play = yaw_excitation * vehicle.rotor[i].spin * std::sin(3.3 * time_s);
      const double wanted =
          1.0 + play + yaw_play + 0.15 * (rates_rad_s[0] * r[1] - rates_rad_s[1] * r[0]) / 0.2;
      const double target = hover_rad_s_ * std::sqrt(std::max(0.1, wanted));
      command_ratio[i] =
          (target - vehicle.speed_min_rad_s) / (vehicle.speed_max_rad_s - vehicle.speed_min_rad_s);
      const double before_rad_s = speed_rad_s[i];
      speed_rad_s[i] += (1 - std::exp(-kStep_s / vehicle.motor_time_constant_s)) * (target - speed_rad_s[i]);
      const double thrust =
          vehicle.thrust_coefficient_N_s2 * speed_rad_s[i] * speed_rad_s[i] * (1.0 - loss_ratio[i]);
      thrust_N += thrust;
      moment_N_m[0] -= r[1] * thrust;
      moment_N_m[1] += r[0] * thrust;
      moment_N_m[2] -= vehicle.rotor[i].spin * vehicle.torque_ratio_m * thrust;
      moment_N_m[2] -=
          vehicle.rotor[i].spin * vehicle.propeller_inertia_kg_m2 * (speed_rad_s[i] - before_rad_s) / kStep_s;
    }
    const auto& I = vehicle.inertia_kg_m2;
    const auto w = rates_rad_s;
    rates_rad_s[0] += kStep_s * (moment_N_m[0] + (I[1] - I[2]) * w[1] * w[2]) / I[0];
    rates_rad_s[1] += kStep_s * (moment_N_m[1] + (I[2] - I[0]) * w[0] * w[2]) / I[1];
    rates_rad_s[2] += kStep_s * (moment_N_m[2] - 0.05 * w[2]) / I[2];
    for (std::size_t i = 0; i < 3; ++i) gyro_rad_s[i] = rates_rad_s[i] + 0.01 * normal_(random_);
    accel_m_s2 = {0.1 * normal_(random_), 0.1 * normal_(random_),
                  -thrust_N / vehicle.mass_kg + 0.2 * normal_(random_)};
  }

  Multirotor vehicle;
  std::array<double, kMaxRotors> loss_ratio{};
  double excitation = 1.0;
  double yaw_excitation = 0.0;  ///< share of a rotor's thrust
  double time_s = 0;
  std::array<double, kMaxRotors> speed_rad_s{};
  std::array<double, kMaxRotors> command_ratio{};
  std::array<double, 3> rates_rad_s{};
  std::array<double, 3> gyro_rad_s{};
  std::array<double, 3> accel_m_s2{};

 private:
  double hover_rad_s_ = 0;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace airworthy::test
