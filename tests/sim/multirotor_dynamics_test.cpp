#include "sim/dynamics/multirotor_dynamics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/vehicles.h"

namespace airworthy::sim {
namespace {

constexpr double kStep_s = 1.0 / 4000.0;

/// A vehicle in empty space: no air, so that closed forms hold.
Multirotor without_air(Multirotor vehicle) {
  vehicle.inflow_ratio = 0.0;
  vehicle.rotor_drag_ratio = 0.0;
  vehicle.body_drag_N_s2_m2 = {0.0, 0.0, 0.0};
  return vehicle;
}

State high_above_ground() {
  State state;
  state.position_N_m.z() = -1000.0;
  return state;
}

void run(const MultirotorDynamics& dynamics, State& state, const Inputs& inputs, double duration_s,
         double step_s = kStep_s) {
  const long steps = std::lround(duration_s / step_s);
  for (long i = 0; i < steps; ++i) dynamics.step(state, inputs, step_s);
}

Inputs at_speed(const Multirotor& vehicle, double speed_rad_s) {
  Inputs inputs;
  for (std::size_t i = 0; i < vehicle.rotor_count; ++i) {
    inputs.rotor[i].speed_target_rad_s = speed_rad_s;
    inputs.rotor[i].time_constant_s = vehicle.motor_time_constant_s;
  }
  return inputs;
}

TEST(MultirotorDynamics, FallsFreely) {
  for (const char* name : kVehicles) {
    const MultirotorDynamics dynamics{without_air(vehicle_named(name))};
    State state = high_above_ground();
    state.velocity_N_m_s = {3.0, -2.0, 1.0};
    run(dynamics, state, at_speed(dynamics.vehicle(), 0.0), 2.0);
    EXPECT_NEAR(state.position_N_m.x(), 6.0, 1e-9) << name;
    EXPECT_NEAR(state.position_N_m.y(), -4.0, 1e-9) << name;
    EXPECT_NEAR(state.position_N_m.z(), -1000.0 + 2.0 + 0.5 * kGravity_m_s2 * 4.0, 1e-9) << name;
    EXPECT_LT(dynamics.accelerations(state, {}).specific_force_B_m_s2.norm(), 1e-12) << name;
  }
}

TEST(MultirotorDynamics, HoversAtTheSpeedWhoseThrustIsTheWeight) {
  for (const char* name : kVehicles) {
    const MultirotorDynamics dynamics{vehicle_named(name)};
    const Multirotor& vehicle = dynamics.vehicle();
    const double speed =
        std::sqrt(vehicle.mass_kg * kGravity_m_s2 /
                  (static_cast<double>(vehicle.rotor_count) * vehicle.thrust_coefficient_N_s2));
    EXPECT_NEAR(dynamics.hover_speed_rad_s(), speed, 1e-9);
    State state = high_above_ground();
    state.speed_rad_s.fill(speed);
    run(dynamics, state, at_speed(vehicle, speed), 1.0);
    EXPECT_NEAR(state.velocity_N_m_s.norm(), 0.0, 1e-9) << name;
    EXPECT_NEAR(state.rates_B_rad_s.norm(), 0.0, 1e-9) << name << ": symmetric, so no moment";
    const Accelerations felt = dynamics.accelerations(state, at_speed(vehicle, speed));
    EXPECT_NEAR(felt.specific_force_B_m_s2.z(), -kGravity_m_s2, 1e-9) << name;
  }
}

TEST(MultirotorDynamics, TumblingInEmptySpaceKeepsEnergyAndMomentum) {
  Multirotor vehicle = without_air(vehicle_named("bebop2"));  // three different inertias
  const MultirotorDynamics dynamics{vehicle};
  State state = high_above_ground();
  state.rates_B_rad_s = {12.0, 0.3, -7.0};
  const Eigen::Vector3d inertia{vehicle.inertia_kg_m2[0], vehicle.inertia_kg_m2[1], vehicle.inertia_kg_m2[2]};
  const double energy_J = dynamics.energy_J(state);
  const Eigen::Vector3d momentum = state.q_NB * inertia.cwiseProduct(state.rates_B_rad_s);
  run(dynamics, state, at_speed(vehicle, 0.0), 5.0);
  EXPECT_NEAR(dynamics.energy_J(state) / energy_J, 1.0, 1e-9);
  const Eigen::Vector3d later = state.q_NB * inertia.cwiseProduct(state.rates_B_rad_s);
  EXPECT_LT((later - momentum).norm(), 1e-8 * momentum.norm());
}

TEST(MultirotorDynamics, MotorsFollowWithTheirLag) {
  const MultirotorDynamics dynamics{without_air(vehicle_named("f450"))};
  State state = high_above_ground();
  const double target = 400.0;
  const double lag_s = dynamics.vehicle().motor_time_constant_s;
  const Inputs inputs = at_speed(dynamics.vehicle(), target);
  for (const double t_s : {0.01, 0.05, 0.2}) {
    State at = state;
    run(dynamics, at, inputs, t_s);
    const double expected = target * (1.0 - std::exp(-t_s / lag_s));
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(at.speed_rad_s[i], expected, 1e-6);
      // The angle turned is the integral of that.
      EXPECT_NEAR(at.phase_rad[i], target * (t_s - lag_s * (1.0 - std::exp(-t_s / lag_s))), 1e-6);
    }
  }
}

TEST(MultirotorDynamics, RollsAsArmThrustAndInertiaSay) {
  Multirotor vehicle = without_air(vehicle_named("f450"));
  vehicle.propeller_inertia_kg_m2 = 0.0;
  const MultirotorDynamics dynamics{vehicle};
  State state = high_above_ground();
  Inputs inputs = at_speed(vehicle, 400.0);
  for (std::size_t i = 0; i < 4; ++i) {
    const double sign = vehicle.rotor[i].position_m[1] < 0.0 ? 1.0 : -1.0;  // left side up: roll to the right
    state.speed_rad_s[i] = 400.0 + 10.0 * sign;
    inputs.rotor[i].speed_target_rad_s = state.speed_rad_s[i];
  }
  const double arm_m = std::abs(vehicle.rotor[0].position_m[1]);
  const double moment_Nm = 2.0 * arm_m * vehicle.thrust_coefficient_N_s2 * (410.0 * 410.0 - 390.0 * 390.0);
  run(dynamics, state, inputs, 0.1);
  EXPECT_NEAR(state.rates_B_rad_s.x(), moment_Nm / vehicle.inertia_kg_m2[0] * 0.1, 1e-9);
  EXPECT_NEAR(state.rates_B_rad_s.y(), 0.0, 1e-9);
  EXPECT_NEAR(state.rates_B_rad_s.z(), 0.0, 1e-9);
}

TEST(MultirotorDynamics, YawsAgainstTheFasterPair) {
  const Multirotor vehicle = without_air(vehicle_named("f450"));
  const MultirotorDynamics dynamics{vehicle};
  State state = high_above_ground();
  Inputs inputs = at_speed(vehicle, 400.0);
  double moment_Nm = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    state.speed_rad_s[i] = vehicle.rotor[i].spin > 0 ? 380.0 : 420.0;
    inputs.rotor[i].speed_target_rad_s = state.speed_rad_s[i];
    moment_Nm -= vehicle.rotor[i].spin * vehicle.torque_ratio_m * vehicle.thrust_coefficient_N_s2 *
                 state.speed_rad_s[i] * state.speed_rad_s[i];
  }
  EXPECT_GT(moment_Nm, 0.0) << "the counter-clockwise pair is faster, so the body turns clockwise";
  run(dynamics, state, inputs, 0.05);
  EXPECT_NEAR(state.rates_B_rad_s.z(), moment_Nm / vehicle.inertia_kg_m2[2] * 0.05, 1e-6);
}

TEST(MultirotorDynamics, SpinningUpAMotorTurnsTheBodyBack) {
  Multirotor vehicle = without_air(vehicle_named("f450"));
  vehicle.torque_ratio_m = 0.0;
  const MultirotorDynamics dynamics{vehicle};
  State state = high_above_ground();
  Inputs inputs = at_speed(vehicle, 0.0);
  for (std::size_t i = 0; i < 4; ++i)
    inputs.rotor[i].speed_target_rad_s = vehicle.rotor[i].spin > 0 ? 300.0 : 0.0;
  run(dynamics, state, inputs, 1.0);
  // Angular momentum about z stays zero: body and two propellers.
  const double expected = -2.0 * vehicle.propeller_inertia_kg_m2 * 300.0 / vehicle.inertia_kg_m2[2];
  EXPECT_NEAR(state.rates_B_rad_s.z(), expected, 1e-3 * std::abs(expected));
}

TEST(MultirotorDynamics, MirroredInputsGiveMirroredMotion) {
  const Multirotor vehicle = vehicle_named("unbalance_medium");
  const MultirotorDynamics dynamics{vehicle};
  const auto fly = [&](double left_rad_s, double right_rad_s, double wind_m_s) {
    State state = high_above_ground();
    Inputs inputs = at_speed(vehicle, 0.0);
    inputs.wind_N_m_s.y() = wind_m_s;
    for (std::size_t i = 0; i < 4; ++i) {
      inputs.rotor[i].speed_target_rad_s = vehicle.rotor[i].position_m[1] < 0.0 ? left_rad_s : right_rad_s;
    }
    run(dynamics, state, inputs, 0.5);
    return state;
  };
  const State one = fly(480.0, 470.0, 3.0);
  const State other = fly(470.0, 480.0, -3.0);
  EXPECT_GT(std::abs(one.rates_B_rad_s.x()), 0.1);
  EXPECT_NEAR(one.rates_B_rad_s.x(), -other.rates_B_rad_s.x(), 1e-9);
  EXPECT_NEAR(one.position_N_m.y(), -other.position_N_m.y(), 1e-9);
  EXPECT_NEAR(one.position_N_m.z(), other.position_N_m.z(), 1e-9);
}

TEST(MultirotorDynamics, ReachesTheTerminalSpeedOfItsDrag) {
  Multirotor vehicle = vehicle_named("f450");
  const MultirotorDynamics dynamics{vehicle};
  State state = high_above_ground();
  state.position_N_m.z() = -1e5;
  run(dynamics, state, at_speed(vehicle, 0.0), 30.0, 1e-3);
  EXPECT_NEAR(state.velocity_N_m_s.z(),
              std::sqrt(vehicle.mass_kg * kGravity_m_s2 / vehicle.body_drag_N_s2_m2[2]), 1e-3);
}

TEST(MultirotorDynamics, ClimbAndCrosswindTakeThrustAndDragToFirstOrder) {
  Multirotor vehicle = vehicle_named("f450");
  vehicle.body_drag_N_s2_m2 = {0.0, 0.0, 0.0};
  const MultirotorDynamics dynamics{vehicle};
  State state = high_above_ground();
  const double speed = dynamics.hover_speed_rad_s();
  state.speed_rad_s.fill(speed);
  Inputs inputs = at_speed(vehicle, speed);
  const double tip_speed = speed * vehicle.propeller_radius_m;
  state.velocity_N_m_s = {0.0, 0.0, -2.0};
  EXPECT_NEAR(dynamics.accelerations(state, inputs).specific_force_B_m_s2.z(),
              -kGravity_m_s2 * (1.0 - vehicle.inflow_ratio * 2.0 / tip_speed), 1e-9);
  state.velocity_N_m_s = {2.0, 0.0, 0.0};
  EXPECT_NEAR(dynamics.accelerations(state, inputs).specific_force_B_m_s2.x(),
              -kGravity_m_s2 * vehicle.rotor_drag_ratio * 2.0 / tip_speed, 1e-9);
}

TEST(MultirotorDynamics, AnUnbalancedRotorShakesAtItsPhaseAndInItsSense) {
  Multirotor vehicle = without_air(vehicle_named("unbalance_medium"));
  vehicle.vibration_response = {1.5, 0.5, 1.0};
  const MultirotorDynamics dynamics{vehicle};
  State state = high_above_ground();
  Inputs inputs = at_speed(vehicle, 0.0);
  state.speed_rad_s[1] = 500.0;
  inputs.rotor[1].speed_target_rad_s = 500.0;
  inputs.rotor[1].thrust_ratio = 0.0;
  inputs.rotor[1].unbalance_kg_m = 4e-6;  // 40 mg at 100 mm
  inputs.rotor[1].unbalance_phase_rad = 0.4;
  const double amplitude = 4e-6 * 500.0 * 500.0 / vehicle.mass_kg;
  for (const double phase : {0.0, 1.0, 4.0}) {
    state.phase_rad[1] = phase;
    const double angle = vehicle.rotor[1].spin * (phase + 0.4);
    const Eigen::Vector3d felt = dynamics.accelerations(state, inputs).specific_force_B_m_s2;
    EXPECT_NEAR(felt.x(), 1.5 * amplitude * std::cos(angle), 1e-9);
    EXPECT_NEAR(felt.y(), 0.5 * amplitude * std::sin(angle), 1e-9);
    EXPECT_NEAR(felt.z(), 0.0, 1e-9);
  }
}

TEST(MultirotorDynamics, StandsOnTheGroundWithoutMoving) {
  for (const char* name : kVehicles) {
    const MultirotorDynamics dynamics{vehicle_named(name)};
    State state = dynamics.at_rest();
    run(dynamics, state, at_speed(dynamics.vehicle(), 0.0), 2.0);
    EXPECT_LT(state.velocity_N_m_s.norm(), 1e-6) << name;
    EXPECT_NEAR(state.position_N_m.z(), dynamics.at_rest().position_N_m.z(), 1e-4) << name;
    EXPECT_NEAR(dynamics.accelerations(state, {}).specific_force_B_m_s2.z(), -kGravity_m_s2, 1e-3) << name;
    EXPECT_TRUE(dynamics.accelerations(state, at_speed(dynamics.vehicle(), 0.0)).has_contact);
  }
}

TEST(MultirotorDynamics, AFallOntoTheGroundLosesEnergyAndEnds) {
  for (const char* name : kVehicles) {
    const MultirotorDynamics dynamics{vehicle_named(name)};
    State state = dynamics.at_rest();
    state.position_N_m.z() -= 0.5;
    state.rates_B_rad_s = {3.0, 1.0, 0.0};
    const double rest_J = dynamics.energy_J(dynamics.at_rest());
    double most_J = dynamics.energy_J(state) - rest_J;
    for (int second = 0; second < 10; ++second) {
      double peak_J = 0.0;  // the springs hold energy that comes back, so look at the most of a while
      for (int i = 0; i < 100; ++i) {
        run(dynamics, state, at_speed(dynamics.vehicle(), 0.0), 0.01);
        peak_J = std::max(peak_J, dynamics.energy_J(state) - rest_J);
      }
      EXPECT_LT(peak_J, 1.001 * most_J + 1e-9) << name << ", second " << second;
      most_J = peak_J;
    }
    EXPECT_LT(state.velocity_N_m_s.norm() + state.rates_B_rad_s.norm(), 0.05) << name;
  }
}

TEST(MultirotorDynamics, IntegratesWithFourthOrder) {
  Multirotor vehicle = vehicle_named("bebop2");
  vehicle.body_drag_N_s2_m2 = {0.0, 0.0, 0.0};  // |v|·v has no second derivative at 0
  const MultirotorDynamics dynamics{vehicle};
  Inputs inputs = at_speed(vehicle, 800.0);
  inputs.wind_N_m_s = {4.0, -2.0, 1.0};
  for (std::size_t i = 0; i < 4; ++i) inputs.rotor[i].speed_target_rad_s += 60.0 * static_cast<double>(i);
  const auto error_of = [&](double step_s, const State& reference) {
    State state = high_above_ground();
    state.speed_rad_s.fill(800.0);
    state.rates_B_rad_s = {6.0, 2.0, -3.0};
    run(dynamics, state, inputs, 0.32, step_s);
    return std::pair{state, (state.position_N_m - reference.position_N_m).norm() +
                                (state.rates_B_rad_s - reference.rates_B_rad_s).norm() +
                                (state.q_NB.coeffs() - reference.q_NB.coeffs()).norm()};
  };
  const State reference = error_of(1.25e-4, {}).first;
  const double coarse = error_of(8e-3, reference).second;
  const double fine = error_of(4e-3, reference).second;
  EXPECT_GT(coarse, 1e-9) << "too small to tell an order";
  EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.35);
}

}  // namespace
}  // namespace airworthy::sim
