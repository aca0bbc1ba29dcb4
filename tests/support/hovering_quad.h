#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <random>

#include "core/estimators/effectiveness/effectiveness_matrix.h"
#include "core/vehicle/multirotor.h"

namespace airworthy::test {

/// A body that answers the speeds of four rotors about hover exactly as EffectivenessMatrix describes, but for the
/// effectiveness of each. The speeds may wander, each on its own; then a controller keeps the body level.
class HoveringQuad {
 public:
  static constexpr double kHover_rad_s = 640.0;

  /// What it is, apart from what only some detectors are told of it.
  static Multirotor described() {
    Multirotor vehicle;
    vehicle.mass_kg = 0.5;
    vehicle.inertia_kg_m2 = {0.0023, 0.0018, 0.0036};
    vehicle.thrust_coefficient_N_s2 = 0.5 * 9.81 / (4.0 * kHover_rad_s * kHover_rad_s);
    vehicle.rotor_count = 4;
    constexpr std::array<std::array<double, 2>, 4> kPlaces{
        {{0.1, -0.1}, {0.1, 0.1}, {-0.1, 0.1}, {-0.1, -0.1}}};
    for (std::size_t i = 0; i < 4; ++i) {
      vehicle.rotor[i].position_m = {kPlaces[i][0], kPlaces[i][1], 0.0};
      vehicle.rotor[i].spin = i % 2 == 0 ? 1 : -1;
    }
    return vehicle;
  }

  explicit HoveringQuad(unsigned seed) : random_{seed} {}

  std::array<double, 4> effectiveness{1.0, 1.0, 1.0, 1.0};
  double wander_ratio = 0.0;  ///< standard deviation of each speed

  /// One step. `tell(rotor, speed_rad_s)` is called for each rotor as soon as its speed is known.
  template <class Tell>
  void step(double step_s, const Tell& tell) {
    std::array<double, 3> gives{};
    for (std::size_t axis = 0; axis < 2; ++axis) angle_rad_[axis] += step_s * rate_rad_s_[axis];
    for (std::size_t i = 0; i < 4; ++i) {
      const double speed_rad_s = kHover_rad_s * speed_ratio(i, step_s);
      tell(i, speed_rad_s);
      constexpr std::array kRows{kRollRow, kPitchRow, kVerticalRow};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        gives[axis] += effectiveness[i] * matrix_.per_speed2[kRows[axis]][i] * speed_rad_s * speed_rad_s;
      }
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
      turning_rad_s2_[axis] = gives[axis];
      rate_rad_s_[axis] += step_s * gives[axis];
    }
    vertical_m_s2_ = gives[2];
  }

  /// White noise of this standard deviation.
  double noise(double sigma) { return sigma * normal_(random_); }

  /// Level and at rest again.
  void settle() {
    rate_rad_s_ = {};
    angle_rad_ = {};
  }

  /// Roll and pitch acceleration in the step.
  [[nodiscard]] const std::array<double, 2>& turning_rad_s2() const { return turning_rad_s2_; }

  /// What the sensors measure after a step, with their noise: specific force along z; rates.
  double measured_vertical_m_s2() { return vertical_m_s2_ + noise(0.5); }
  std::array<double, 3> measured_rates_rad_s() {
    return {rate_rad_s_[0] + noise(0.02), rate_rad_s_[1] + noise(0.02), 0.0};
  }

 private:
  double speed_ratio(std::size_t rotor, double step_s) {
    if (!(wander_ratio > 0.0)) return 1.0;
    constexpr double kLasts_s = 0.15;
    wander_[rotor] +=
        -step_s / kLasts_s * wander_[rotor] + noise(wander_ratio * std::sqrt(2.0 * step_s / kLasts_s));
    double ratio = 1.0 + wander_[rotor];
    for (std::size_t axis = 0; axis < 2; ++axis) {
      ratio -= std::copysign(1.0, matrix_.per_speed2[axis][rotor]) *
               (0.02 * rate_rad_s_[axis] + 0.1 * angle_rad_[axis]);
    }
    return ratio;
  }

  EffectivenessMatrix<double> matrix_ = EffectivenessMatrix<double>::of(described());
  double vertical_m_s2_ = 0.0;
  std::array<double, 4> wander_{};
  std::array<double, 2> angle_rad_{};
  std::array<double, 2> rate_rad_s_{};
  std::array<double, 2> turning_rad_s2_{};
  std::mt19937 random_;
  std::normal_distribution<> normal_;
};

}  // namespace airworthy::test
