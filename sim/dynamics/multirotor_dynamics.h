#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>

#include "core/vehicle/multirotor.h"

namespace airworthy::sim {

inline constexpr double kGravity_m_s2 = 9.80665;

/// Frames: N = local north-east-down, z = 0 is the ground; B = body, x forward, y right, z down, origin at the
/// centre of mass. R_NB takes B to N.
struct State {
  Eigen::Vector3d position_N_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_N_m_s = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_NB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d rates_B_rad_s = Eigen::Vector3d::Zero();
  std::array<double, kMaxRotors> speed_rad_s{};
  std::array<double, kMaxRotors> phase_rad{};  ///< angle turned since the start, in the rotor's own sense
};

/// What drives one rotor, and what is wrong with it.
struct RotorInput {
  double speed_target_rad_s = 0.0;
  double time_constant_s = 0.02;
  double thrust_ratio = 1.0;         ///< thrust and drag torque of this propeller / nominal
  double unbalance_kg_m = 0.0;       ///< mass times radius
  double unbalance_phase_rad = 0.0;  ///< its place on the rotor
  double blade_pass_ratio = 0.0;     ///< thrust ripple at twice the rotor speed / thrust
};

struct Inputs {
  std::array<RotorInput, kMaxRotors> rotor{};
  Eigen::Vector3d wind_N_m_s = Eigen::Vector3d::Zero();
};

/// Accelerations at one instant.
struct Accelerations {
  Eigen::Vector3d specific_force_B_m_s2 =
      Eigen::Vector3d::Zero();  ///< of the centre of mass, without gravity
  Eigen::Vector3d angular_B_rad_s2 = Eigen::Vector3d::Zero();
  bool has_contact = false;
};

/// Rigid body with rotors, in air and on the ground.
///   Rotor i       ω̇ᵢ = (ωᵢ* − ωᵢ)/τᵢ,  θ̇ᵢ = ωᵢ                                                   (1)
///   Thrust        Tᵢ = κ·eᵢ·ωᵢ²·(1 − c_in·v_ax/(ωᵢ·R)),  along its axis aᵢ                           (2)
///   In-plane drag −c_d·κ·eᵢ·ωᵢ·v_plane/R at the hub                                                  (3)
///   Torque        −sᵢ·(κ_m·Tᵢ + J·ω̇ᵢ) and gyroscopic −Ω×(sᵢ·J·ωᵢ), about the rotation axis −aᵢ       (4)
///   Unbalance     S·uᵢ·ωᵢ²·(cos φᵢ, sin φᵢ, 0) at the hub, φᵢ = sᵢ·(θᵢ + phase); S = vibration response  (5)
///   Body          m·v̇ = m·g + R_NB·ΣF,  I·Ω̇ = ΣM − Ω×I·Ω                                           (6)
///   Drag of body  −D·|v|·v per axis, v relative to the air                                            (7)
///   Ground        spring and damper at four feet, at the hubs and at the top, Coulomb friction made smooth
/// (2) and (3) are the first-order terms of blade element theory; Leishman, Principles of Helicopter
/// Aerodynamics, chapters 2 and 3. (5) is scaled by S before it acts on the body: at these frequencies what
/// matters is what the inertial sensor feels. Integration: classical Runge-Kutta of 4th order, inputs held.
class MultirotorDynamics {
 public:
  explicit MultirotorDynamics(const Multirotor& vehicle);

  /// Standing on the ground, level, nose to the north.
  [[nodiscard]] State at_rest() const;

  void step(State& state, const Inputs& inputs, double dt_s) const;
  [[nodiscard]] Accelerations accelerations(const State& state, const Inputs& inputs) const;

  [[nodiscard]] const Multirotor& vehicle() const { return vehicle_; }
  /// Speed of every rotor in a still-air hover of a vehicle with parallel vertical axes.
  [[nodiscard]] double hover_speed_rad_s() const;
  /// Kinetic and potential energy of body and rotor spin, zero at rest on the ground plane. J.
  [[nodiscard]] double energy_J(const State& state) const;

 private:
  // Derivative of State, or a change of it; q holds the four coefficients x, y, z, w.
  struct Rate {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    Eigen::Vector4d q = Eigen::Vector4d::Zero();
    Eigen::Vector3d rates = Eigen::Vector3d::Zero();
    std::array<double, kMaxRotors> speed{};
    std::array<double, kMaxRotors> phase{};
  };
  struct Wrench {
    Eigen::Vector3d force_B_N = Eigen::Vector3d::Zero();
    Eigen::Vector3d moment_B_Nm = Eigen::Vector3d::Zero();
  };
  struct RotorAxis {
    Eigen::Vector3d hub_B_m;
    Eigen::Vector3d thrust_axis_B;
    double spin;
  };

  [[nodiscard]] Rate derivative(const State& state, const Inputs& inputs, Accelerations& accelerations) const;
  void add_rotor(std::size_t i, const State& state, const RotorInput& input, const Eigen::Vector3d& air_B_m_s,
                 Wrench& wrench) const;
  [[nodiscard]] bool add_ground(const State& state, const Eigen::Matrix3d& R_NB, Wrench& wrench) const;
  [[nodiscard]] static State advanced(const State& state, const Rate& rate, double dt_s);

  Multirotor vehicle_;
  Eigen::Vector3d inertia_;
  Eigen::Vector3d drag_;
  Eigen::Vector3d vibration_response_;
  std::array<RotorAxis, kMaxRotors> axis_;
  static constexpr std::size_t kMaxContacts = 4 + kMaxRotors + 1;
  std::array<Eigen::Vector3d, kMaxContacts> contact_B_m_;
  std::size_t contact_count_ = 0;
  double stiffness_N_m_ = 0.0;
  double damping_N_s_m_ = 0.0;
};

}  // namespace airworthy::sim
