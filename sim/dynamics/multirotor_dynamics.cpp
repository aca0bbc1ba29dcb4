#include "sim/dynamics/multirotor_dynamics.h"

#include <algorithm>
#include <cmath>

namespace airworthy::sim {
namespace {

constexpr double kStaticDeflection_m = 0.003;  // of the gear under the vehicle's weight
constexpr double kDampingRatio = 0.4;
constexpr double kFriction = 0.7;
constexpr double kSlipSpeed_m_s = 0.02;  // friction is viscous below, Coulomb above

Eigen::Vector3d vector(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

}  // namespace

MultirotorDynamics::MultirotorDynamics(const Multirotor& vehicle)
    : vehicle_{vehicle},
      inertia_{vector(vehicle.inertia_kg_m2)},
      drag_{vector(vehicle.body_drag_N_s2_m2)},
      vibration_response_{vector(vehicle.vibration_response)} {
  for (std::size_t i = 0; i < vehicle.rotor_count; ++i) {
    const Rotor& rotor = vehicle.rotor[i];
    axis_[i] = {vector(rotor.position_m), vector(rotor.thrust_axis), static_cast<double>(rotor.spin)};
  }
  const double foot = vehicle.gear_radius_m * std::sqrt(0.5);
  for (const double x : {foot, -foot}) {
    for (const double y : {foot, -foot}) contact_B_m_[contact_count_++] = {x, y, vehicle.gear_height_m};
  }
  for (std::size_t i = 0; i < vehicle.rotor_count; ++i) contact_B_m_[contact_count_++] = axis_[i].hub_B_m;
  contact_B_m_[contact_count_++] = {0.0, 0.0, -vehicle.gear_height_m};
  const double foot_mass_kg = vehicle.mass_kg / 4.0;
  stiffness_N_m_ = foot_mass_kg * kGravity_m_s2 / kStaticDeflection_m;
  damping_N_s_m_ = 2.0 * kDampingRatio * std::sqrt(stiffness_N_m_ * foot_mass_kg);
}

State MultirotorDynamics::at_rest() const {
  State state;
  state.position_N_m.z() = -vehicle_.gear_height_m + kStaticDeflection_m;
  return state;
}

double MultirotorDynamics::hover_speed_rad_s() const {
  return std::sqrt(vehicle_.mass_kg * kGravity_m_s2 /
                   (static_cast<double>(vehicle_.rotor_count) * vehicle_.thrust_coefficient_N_s2));
}

double MultirotorDynamics::energy_J(const State& state) const {
  double energy = 0.5 * vehicle_.mass_kg * state.velocity_N_m_s.squaredNorm() +
                  0.5 * state.rates_B_rad_s.dot(inertia_.cwiseProduct(state.rates_B_rad_s)) -
                  vehicle_.mass_kg * kGravity_m_s2 * state.position_N_m.z();
  for (std::size_t i = 0; i < vehicle_.rotor_count; ++i) {
    energy += 0.5 * vehicle_.propeller_inertia_kg_m2 * state.speed_rad_s[i] * state.speed_rad_s[i];
  }
  return energy;
}

void MultirotorDynamics::add_rotor(std::size_t i, const State& state, const RotorInput& input,
                                   const Eigen::Vector3d& air_B_m_s, Wrench& wrench) const {
  const RotorAxis& axis = axis_[i];
  const double speed = state.speed_rad_s[i];
  const double radius = vehicle_.propeller_radius_m;
  const double phase = axis.spin * (state.phase_rad[i] + input.unbalance_phase_rad);
  const double thrust_per_speed = vehicle_.thrust_coefficient_N_s2 * input.thrust_ratio * speed;

  const Eigen::Vector3d air = air_B_m_s + state.rates_B_rad_s.cross(axis.hub_B_m);
  const double axial = air.dot(axis.thrust_axis_B);
  const Eigen::Vector3d in_plane = air - axial * axis.thrust_axis_B;
  double thrust = thrust_per_speed * (speed - vehicle_.inflow_ratio * axial / radius);  // (2)
  thrust = std::max(thrust, 0.0) * (1.0 + input.blade_pass_ratio * std::cos(2.0 * phase));
  Eigen::Vector3d force = thrust * axis.thrust_axis_B -
                          (vehicle_.rotor_drag_ratio * thrust_per_speed / radius) * in_plane;  // (3)
  const double rotation = input.unbalance_kg_m * speed * speed;
  force += vibration_response_.cwiseProduct(
      Eigen::Vector3d{rotation * std::cos(phase), rotation * std::sin(phase), 0.0});  // (5)

  const double acceleration = (input.speed_target_rad_s - speed) / input.time_constant_s;
  const Eigen::Vector3d rotation_axis = -axis.spin * axis.thrust_axis_B;  // right-handed
  const double inertia = vehicle_.propeller_inertia_kg_m2;
  wrench.force_B_N += force;
  wrench.moment_B_Nm += axis.hub_B_m.cross(force) -
                        (vehicle_.torque_ratio_m * thrust + inertia * acceleration) * rotation_axis -
                        state.rates_B_rad_s.cross(inertia * speed * rotation_axis);  // (4)
}

bool MultirotorDynamics::add_ground(const State& state, const Eigen::Matrix3d& R_NB, Wrench& wrench) const {
  const double reach_m = 2.0 * (vehicle_.gear_radius_m + vehicle_.gear_height_m) + 1.5;
  if (state.position_N_m.z() < -reach_m) return false;
  bool has_contact = false;
  for (std::size_t i = 0; i < contact_count_; ++i) {
    const Eigen::Vector3d arm_N_m = R_NB * contact_B_m_[i];
    const double depth_m = state.position_N_m.z() + arm_N_m.z();
    if (depth_m <= 0.0) continue;
    has_contact = true;
    const Eigen::Vector3d velocity = state.velocity_N_m_s + R_NB * state.rates_B_rad_s.cross(contact_B_m_[i]);
    const double normal = std::max(0.0, stiffness_N_m_ * depth_m + damping_N_s_m_ * velocity.z());
    Eigen::Vector3d slip{velocity.x(), velocity.y(), 0.0};
    const Eigen::Vector3d friction = -kFriction * normal * slip / std::max(slip.norm(), kSlipSpeed_m_s);
    const Eigen::Vector3d force_B = R_NB.transpose() * Eigen::Vector3d{friction.x(), friction.y(), -normal};
    wrench.force_B_N += force_B;
    wrench.moment_B_Nm += contact_B_m_[i].cross(force_B);
  }
  return has_contact;
}

MultirotorDynamics::Rate MultirotorDynamics::derivative(const State& state, const Inputs& inputs,
                                                        Accelerations& accelerations) const {
  const Eigen::Matrix3d R_NB = state.q_NB.toRotationMatrix();
  const Eigen::Vector3d air_B_m_s = R_NB.transpose() * (state.velocity_N_m_s - inputs.wind_N_m_s);
  Rate rate;
  Wrench wrench;
  wrench.force_B_N = -drag_.cwiseProduct(air_B_m_s.cwiseAbs()).cwiseProduct(air_B_m_s);  // (7)
  for (std::size_t i = 0; i < vehicle_.rotor_count; ++i) {
    const RotorInput& input = inputs.rotor[i];
    add_rotor(i, state, input, air_B_m_s, wrench);
    rate.speed[i] = (input.speed_target_rad_s - state.speed_rad_s[i]) / input.time_constant_s;  // (1)
    rate.phase[i] = state.speed_rad_s[i];
  }
  accelerations.has_contact = add_ground(state, R_NB, wrench);
  accelerations.specific_force_B_m_s2 = wrench.force_B_N / vehicle_.mass_kg;
  const Eigen::Vector3d momentum = inertia_.cwiseProduct(state.rates_B_rad_s);
  accelerations.angular_B_rad_s2 =
      (wrench.moment_B_Nm - state.rates_B_rad_s.cross(momentum)).cwiseQuotient(inertia_);  // (6)

  rate.position = state.velocity_N_m_s;
  rate.velocity = R_NB * accelerations.specific_force_B_m_s2 + Eigen::Vector3d{0.0, 0.0, kGravity_m_s2};
  const Eigen::Vector3d& w = state.rates_B_rad_s;
  rate.q = 0.5 * (state.q_NB * Eigen::Quaterniond{0.0, w.x(), w.y(), w.z()}).coeffs();
  rate.rates = accelerations.angular_B_rad_s2;
  return rate;
}

State MultirotorDynamics::advanced(const State& state, const Rate& rate, double dt_s) {
  State next;
  next.position_N_m = state.position_N_m + dt_s * rate.position;
  next.velocity_N_m_s = state.velocity_N_m_s + dt_s * rate.velocity;
  next.q_NB.coeffs() = state.q_NB.coeffs() + dt_s * rate.q;
  next.rates_B_rad_s = state.rates_B_rad_s + dt_s * rate.rates;
  for (std::size_t i = 0; i < kMaxRotors; ++i) {
    next.speed_rad_s[i] = state.speed_rad_s[i] + dt_s * rate.speed[i];
    next.phase_rad[i] = state.phase_rad[i] + dt_s * rate.phase[i];
  }
  return next;
}

void MultirotorDynamics::step(State& state, const Inputs& inputs, double dt_s) const {
  Accelerations unused;
  Rate sum = derivative(state, inputs, unused);
  const auto add = [&sum](const Rate& rate, double weight) {
    sum.position += weight * rate.position;
    sum.velocity += weight * rate.velocity;
    sum.q += weight * rate.q;
    sum.rates += weight * rate.rates;
    for (std::size_t i = 0; i < kMaxRotors; ++i) {
      sum.speed[i] += weight * rate.speed[i];
      sum.phase[i] += weight * rate.phase[i];
    }
  };
  const Rate second = derivative(advanced(state, sum, 0.5 * dt_s), inputs, unused);
  const Rate third = derivative(advanced(state, second, 0.5 * dt_s), inputs, unused);
  const Rate fourth = derivative(advanced(state, third, dt_s), inputs, unused);
  add(second, 2.0);
  add(third, 2.0);
  add(fourth, 1.0);
  state = advanced(state, sum, dt_s / 6.0);
  state.q_NB.normalize();
}

Accelerations MultirotorDynamics::accelerations(const State& state, const Inputs& inputs) const {
  Accelerations result;
  static_cast<void>(derivative(state, inputs, result));
  return result;
}

}  // namespace airworthy::sim
