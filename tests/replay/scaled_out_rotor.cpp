#include "tests/replay/scaled_out_rotor.h"

namespace airworthy::testing {
namespace {

using Vector = ScaledOutRotor::Vector;

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

}  // namespace

Vector ScaledOutRotor::gyroscopic(const Vector& rate) const noexcept {
  const auto& inertia = vehicle_.inertia_kg_m2;
  const Vector momentum{inertia[0] * rate[0], inertia[1] * rate[1], inertia[2] * rate[2]};
  const Vector turned = cross(rate, momentum);
  return {-turned[0] / inertia[0], -turned[1] / inertia[1], -turned[2] / inertia[2]};
}

void ScaledOutRotor::step(double dt_s, double speed_before_rad_s, double speed_rad_s, Vector& accel_m_s2,
                          Vector& gyro_rad_s) noexcept {
  const Vector healthy = gyro_rad_s;
  const double mean_speed2 = 0.5 * (speed_before_rad_s * speed_before_rad_s + speed_rad_s * speed_rad_s);
  Vector faulty{};
  for (std::size_t axis = 0; axis < 3; ++axis) faulty[axis] = healthy[axis] + delta_[axis];
  const Vector with = gyroscopic(faulty);
  const Vector without = gyroscopic(healthy);
  Vector change{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    change[axis] =
        -loss_ * matrix_.per_speed2[axis][rotor_] * mean_speed2 + with[axis] - without[axis];  // (2)
    delta_[axis] += dt_s * change[axis];
    gyro_rad_s[axis] = healthy[axis] + delta_[axis];
  }
  const Vector& arm = vehicle_.imu_position_m;
  const Vector turning = cross(change, arm);
  const Vector after = cross(gyro_rad_s, cross(gyro_rad_s, arm));
  const Vector before = cross(healthy, cross(healthy, arm));
  for (std::size_t axis = 0; axis < 3; ++axis) accel_m_s2[axis] += turning[axis] + after[axis] - before[axis];
  accel_m_s2[2] -= loss_ * matrix_.per_speed2[kVerticalRow][rotor_] * speed_rad_s * speed_rad_s;  // (3)
}

}  // namespace airworthy::testing
