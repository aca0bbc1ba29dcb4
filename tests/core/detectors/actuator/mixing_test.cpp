#include "core/detectors/actuator/mixing.h"

#include <gtest/gtest.h>

#include <cmath>

namespace airworthy::actuator {
namespace {

Multirotor quad() {
  Multirotor vehicle;
  vehicle.mass_kg = 2.0;
  vehicle.inertia_kg_m2 = {0.02, 0.04, 0.05};
  vehicle.torque_ratio_m = 0.01;
  vehicle.rotor_count = 4;
  vehicle.rotor[0] = {{0.1, 0.2, 0.0}, {0, 0, -1}, -1};    // front right, counter-clockwise
  vehicle.rotor[1] = {{-0.1, -0.2, 0.0}, {0, 0, -1}, -1};  // rear left
  vehicle.rotor[2] = {{0.1, -0.2, 0.0}, {0, 0, -1}, 1};    // front left, clockwise
  vehicle.rotor[3] = {{-0.1, 0.2, 0.0}, {0, 0, -1}, 1};    // rear right
  return vehicle;
}

// A rotor in front and right lifts the nose (+q) and the right side (−p); turning counter-clockwise, it turns the body
// clockwise seen from above (+r).
TEST(MixingMatrix, OfAFlatQuadrotorFollowsFromLeverArms) {
  const MixingMatrix mixing = mixing_matrix(quad());
  for (int rotor = 0; rotor < 4; ++rotor) {
    const bool front = rotor == 0 || rotor == 2;
    const bool right = rotor == 0 || rotor == 3;
    EXPECT_DOUBLE_EQ(mixing(kRoll, rotor), (right ? -1 : 1) * 2.0 * 0.2 / 0.02);
    EXPECT_DOUBLE_EQ(mixing(kPitch, rotor), (front ? 1 : -1) * 2.0 * 0.1 / 0.04);
    EXPECT_DOUBLE_EQ(mixing(kYaw, rotor), (rotor < 2 ? 1 : -1) * 2.0 * 0.01 / 0.05);
    EXPECT_DOUBLE_EQ(mixing(kHeight, rotor), 1.0);
  }
}

TEST(MixingMatrix, HasNothingForRotorsThatAreNotThere) {
  EXPECT_EQ(mixing_matrix(quad()).rightCols<4>().norm(), 0.0);
}

// A rotor on the right arm whose thrust leans forward pulls the nose to the left and lifts less.
TEST(MixingMatrix, KnowsATiltedRotor) {
  Multirotor vehicle = quad();
  vehicle.torque_ratio_m = 0.0;
  vehicle.rotor_count = 1;
  vehicle.rotor[0] = {{0.0, 0.3, 0.0}, {0.6, 0.0, -0.8}, 1};
  const MixingMatrix mixing = mixing_matrix(vehicle);
  EXPECT_DOUBLE_EQ(mixing(kHeight, 0), 0.8);
  EXPECT_DOUBLE_EQ(mixing(kRoll, 0), -2.0 / 0.02 * 0.3 * 0.8);
  EXPECT_DOUBLE_EQ(mixing(kYaw, 0), -2.0 / 0.05 * 0.3 * 0.6);
}

}  // namespace
}  // namespace airworthy::actuator
