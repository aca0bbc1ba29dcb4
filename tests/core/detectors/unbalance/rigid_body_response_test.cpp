#include "core/detectors/unbalance/rigid_body_response.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <numbers>

namespace airworthy {
namespace {

Multirotor small_vehicle() {
  Multirotor vehicle;
  vehicle.mass_kg = 0.039;
  vehicle.inertia_kg_m2 = {2.4e-5, 2.1e-5, 3.2e-5};
  vehicle.imu_position_m = {0.004, 0.002, 0.003};
  vehicle.rotor_count = 4;
  vehicle.rotor[0] = {.position_m = {0.0325, 0.0325, -0.010}, .spin = -1};
  vehicle.rotor[1] = {.position_m = {-0.0325, -0.0325, -0.010}, .spin = -1};
  vehicle.rotor[2] = {.position_m = {0.0325, -0.0325, -0.010}, .spin = 1};
  vehicle.rotor[3] = {.position_m = {-0.0325, 0.0325, -0.010}, .spin = 1};
  return vehicle;
}

/// The part of what is felt that turns with the rotor, by a Fourier sum over one turn of the force.
double by_turning_the_force(const Multirotor& vehicle, std::size_t rotor, double unevenness) {
  const auto vector = [](const std::array<double, 3>& v) { return Eigen::Vector3d{v[0], v[1], v[2]}; };
  const Eigen::Vector3d hub = vector(vehicle.rotor[rotor].position_m);
  const Eigen::Vector3d imu = vector(vehicle.imu_position_m);
  constexpr int kSteps = 64;
  std::complex<double> turning = 0.0;
  for (int k = 0; k < kSteps; ++k) {
    const double angle = vehicle.rotor[rotor].spin * 2.0 * std::numbers::pi * k / kSteps;
    const Eigen::Vector3d force{(1.0 + unevenness) * std::cos(angle), (1.0 - unevenness) * std::sin(angle),
                                0.0};
    const Eigen::Vector3d angular = hub.cross(force).cwiseQuotient(vector(vehicle.inertia_kg_m2));
    const Eigen::Vector3d felt = force / vehicle.mass_kg + angular.cross(imu);
    turning += std::complex<double>{felt.x(), felt.y()} * std::polar(1.0 / kSteps, -angle);
  }
  return vehicle.mass_kg * std::abs(turning);
}

TEST(RigidBodyResponse, IsWhatNewtonAndEulerSayOfAForceThatTurns) {
  const Multirotor vehicle = small_vehicle();
  for (const double unevenness : {0.0, 0.3, -0.3}) {
    for (std::size_t rotor = 0; rotor < 4; ++rotor) {
      EXPECT_NEAR(rigid_body_response(vehicle, rotor, unevenness),
                  by_turning_the_force(vehicle, rotor, unevenness), 1e-12)
          << rotor << " " << unevenness;
    }
  }
}

TEST(RigidBodyResponse, DiffersBetweenTheRotorsOfASmallVehicleByMoreThanATenth) {
  const Multirotor vehicle = small_vehicle();
  EXPECT_GT(rigid_body_response(vehicle, 0) / rigid_body_response(vehicle, 1), 1.1);
}

TEST(RigidBodyResponse, IsOneInTheCentreOfMassAndWithoutMomentsOfInertia) {
  Multirotor vehicle = small_vehicle();
  vehicle.imu_position_m = {};
  EXPECT_EQ(rigid_body_response(vehicle, 2), 1.0);
  vehicle = small_vehicle();
  vehicle.inertia_kg_m2 = {};
  EXPECT_EQ(rigid_body_response(vehicle, 2), 1.0);
}

TEST(RigidBodyResponse, ATrialSaysAllOfItsOwnRotorAndLessOfAnotherTheMoreUnevenTheAirframe) {
  const Multirotor vehicle = small_vehicle();
  EXPECT_EQ(response_transfer_sigma(vehicle, 1, 1, 0.3), 0.0);
  const double even = response_transfer_sigma(vehicle, 0, 1, 0.0);
  EXPECT_GT(even, 0.0);
  EXPECT_GT(response_transfer_sigma(vehicle, 0, 1, 0.3), even);
  EXPECT_LT(response_transfer_sigma(vehicle, 0, 1, 0.3), 0.1);
}

}  // namespace
}  // namespace airworthy
