#include "tests/replay/scaled_out_rotor.h"

#include <gtest/gtest.h>

#include <cmath>

namespace airworthy::testing {
namespace {

using Vector = ScaledOutRotor::Vector;

/// Arms of 0.1 m along x and y; of 4 rotors each carries a quarter at 500 rad/s.
Multirotor quad() {
  Multirotor vehicle;
  vehicle.mass_kg = 1.0;
  vehicle.inertia_kg_m2 = {0.01, 0.01, 0.02};
  vehicle.thrust_coefficient_N_s2 = 9.81 / (4.0 * 500.0 * 500.0);
  vehicle.torque_ratio_m = 0.02;
  vehicle.rotor_count = 4;
  vehicle.rotor[0].position_m = {0.1, 0.1, 0.0};
  vehicle.rotor[1].position_m = {-0.1, -0.1, 0.0};
  vehicle.rotor[2].position_m = {0.1, -0.1, 0.0};
  vehicle.rotor[3].position_m = {-0.1, 0.1, 0.0};
  return vehicle;
}

TEST(ScaledOutRotor, TakesAQuarterOfTheWeightAndItsMomentByHand) {
  const Multirotor vehicle = quad();
  ScaledOutRotor scaled{EffectivenessMatrix<double>::of(vehicle), vehicle, 0, 0.4};
  Vector accel{0.0, 0.0, -9.81};
  Vector gyro{};
  for (int k = 0; k < 10; ++k) {
    accel = {0.0, 0.0, -9.81};
    gyro = {};
    scaled.step(0.002, 500.0, 500.0, accel, gyro);
  }
  EXPECT_NEAR(accel[2], -9.81 * (1.0 - 0.4 / 4.0), 1e-9);
  // 0.4 of 2.4525 N at 0.1 m is 0.0981 N·m: 9.81 rad/s² for 20 ms. Front right is lost: it rolls right and pitches down.
  EXPECT_NEAR(gyro[0], 9.81 * 0.02, 1e-3);
  EXPECT_NEAR(gyro[1], -9.81 * 0.02, 1e-3);
  EXPECT_LT(std::abs(gyro[2]), 0.02);
}

TEST(ScaledOutRotor, NothingIsLostWithoutALoss) {
  const Multirotor vehicle = quad();
  ScaledOutRotor scaled{EffectivenessMatrix<double>::of(vehicle), vehicle, 2, 0.0};
  Vector accel{1.0, 2.0, -9.0};
  Vector gyro{3.0, -2.0, 1.0};
  scaled.step(0.01, 600.0, 500.0, accel, gyro);
  EXPECT_EQ(accel, (Vector{1.0, 2.0, -9.0}));
  EXPECT_EQ(gyro, (Vector{3.0, -2.0, 1.0}));
}

// A body that is given a rate keeps to Euler's equations: the change between two free motions is itself one.
TEST(ScaledOutRotor, TheChangeOfATurningBodyKeepsItsMomentum) {
  Multirotor vehicle = quad();
  vehicle.inertia_kg_m2 = {0.01, 0.015, 0.022};
  const auto matrix = EffectivenessMatrix<double>::of(vehicle);
  // Free motion, integrated finely: healthy, and with the rotor's moment missing for the first 10 ms.
  const auto euler = [&vehicle](const Vector& w) {
    const auto& I = vehicle.inertia_kg_m2;
    return Vector{(I[1] - I[2]) / I[0] * w[1] * w[2], (I[2] - I[0]) / I[1] * w[0] * w[2],
                  (I[0] - I[1]) / I[2] * w[0] * w[1]};
  };
  Vector healthy{4.0, -3.0, 2.0};
  Vector faulty = healthy;
  ScaledOutRotor scaled{matrix, vehicle, 1, 1.0};
  Vector gyro{};
  constexpr double kStep_s = 1e-5;
  for (int k = 0; k < 20'000; ++k) {
    const Vector a = euler(healthy);
    const Vector b = euler(faulty);
    for (std::size_t i = 0; i < 3; ++i) {
      healthy[i] += kStep_s * a[i];
      faulty[i] += kStep_s * (b[i] - matrix.per_speed2[i][1] * 250.0 * 250.0);
    }
    gyro = healthy;
    Vector accel{};
    scaled.step(kStep_s, 250.0, 250.0, accel, gyro);
  }
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(gyro[i], faulty[i], 0.01) << i;
}

}  // namespace
}  // namespace airworthy::testing
