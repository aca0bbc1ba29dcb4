#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "core/vehicle/multirotor.h"
#include "sim/config/realism.h"
#include "sim/config/scenario.h"
#include "sim/dynamics/dryden_gusts.h"
#include "sim/dynamics/multirotor_dynamics.h"
#include "sim/flight/controller.h"
#include "sim/flight/flight_plan.h"
#include "sim/output/output.h"
#include "sim/random.h"
#include "sim/sensors/esc_telemetry_model.h"
#include "sim/sensors/imu_model.h"

namespace airworthy::sim {

/// Where the random numbers of a flight come from: those that make the vehicle differ from its file, and those of
/// the flight. The same vehicle can so fly twice.
struct Seeds {
  // NOLINTNEXTLINE(google-explicit-constructor): one seed stands for both.
  Seeds(std::uint64_t both) : vehicle{both}, flight{both} {}
  Seeds(std::uint64_t vehicle_seed, std::uint64_t flight_seed) : vehicle{vehicle_seed}, flight{flight_seed} {}
  std::uint64_t vehicle;
  std::uint64_t flight;
};

/// One simulated flight: physics at 4 kHz, control at 500 Hz, devices at their own rates, faults as the scenario
/// says. The same vehicle, scenario, realism and seed give the same samples, bit for bit. Rotors are simulated
/// in an order that depends on their positions only, and every random stream belongs to a position, so
/// renumbering the rotors renumbers the samples and changes nothing else.
class Simulation {
 public:
  static constexpr double kPhysicsStep_s = 1.0 / Realism::kPhysicsRate_Hz;

  /// `nominal` is what the vehicle file says; what flies differs from it by the errors of `realism`.
  Simulation(const Multirotor& nominal, const Scenario& scenario, const Realism& realism, Seeds seeds);

  /// One step of control: 2 ms.
  void step(Output& output);

  [[nodiscard]] double time_s() const { return time_s_; }
  [[nodiscard]] const State& state() const { return state_; }
  /// Whether any part of the vehicle touches the ground.
  [[nodiscard]] bool has_contact() const { return accelerations_.has_contact; }
  /// Mass times radius of a propeller as it turns now, natural and by faults. 0-based, as the vehicle file has them.
  [[nodiscard]] double unbalance_kg_m(std::size_t rotor) const {
    return inputs_.rotor[place_of_[rotor]].unbalance_kg_m;
  }
  /// What really flies, rotors in the order of the simulation.
  [[nodiscard]] const Multirotor& vehicle() const { return dynamics_.vehicle(); }

 private:
  // A device that sends with a fixed period, first at time 0.
  struct Schedule {
    double period_s;
    double next_s = 0.0;
    bool is_due(double time_s);
  };

  static Multirotor perturbed(const Multirotor& nominal, const Realism& realism, std::uint64_t seed);
  [[nodiscard]] Estimate estimate();
  void drive_motors(const ControlOutput& control);
  void send(Output& output);
  /// Any rate that divides the physics' is sampled at even steps.
  void send_inertial(double time_s, Output& output);
  [[nodiscard]] bool link_is_up(Link link) const;
  [[nodiscard]] ImuFault imu_fault() const;
  [[nodiscard]] std::array<EscFault, kMaxRotors> esc_faults() const;
  /// Array by file number from array by simulation order.
  [[nodiscard]] std::array<double, kMaxRotors> numbered(const std::array<double, kMaxRotors>& by_place) const;
  [[nodiscard]] double thrust_ratio() const;
  /// Speed at the same command over that with a full battery.
  [[nodiscard]] double sag() const;

  Realism realism_;
  Scenario scenario_;
  std::array<std::size_t, kMaxRotors>
      number_of_;                                 ///< file index of the rotor at each place of the simulation
  std::array<std::size_t, kMaxRotors> place_of_;  ///< and the reverse
  MultirotorDynamics dynamics_;
  double hover_thrust_N_;
  FlightPlan plan_;
  Controller controller_;
  DrydenGusts gusts_;
  ImuModel imu_;
  EscTelemetryModel esc_;
  Random loss_;
  Random desync_;

  std::vector<GaussMarkov> attitude_error_;
  std::vector<GaussMarkov> position_error_;
  std::vector<GaussMarkov> velocity_error_;
  std::vector<GaussMarkov> speed_error_;
  std::array<double, kMaxRotors> thrust_error_{};
  std::array<double, kMaxRotors> natural_unbalance_kg_m_{};
  std::array<double, kMaxRotors> natural_unbalance_phase_rad_{};
  std::array<double, kMaxRotors>
      damage_angle_rad_{};  ///< of an unbalance whose angle the scenario leaves open
  std::array<double, kMaxRotors> time_constant_s_{};
  std::array<double, kMaxRotors> stuck_command_{};
  std::array<bool, kMaxRotors> is_stuck_{};
  std::array<double, kMaxRotors> desync_speed_rad_s_{};
  std::deque<std::array<double, kMaxRotors>> commands_under_way_;  ///< one each control step
  std::size_t command_delay_steps_;
  std::deque<std::pair<double, LandedState>> landed_states_;

  State state_;
  Inputs inputs_;
  Accelerations accelerations_;
  AutopilotSample autopilot_;
  std::int64_t steps_ = 0;
  double time_s_ = 0.0;
  bool truth_is_told_ = false;
  LandedState reported_landed_state_ = LandedState::kOnGround;
  Schedule imu_schedule_;
  Schedule esc_schedule_;
  Schedule attitude_schedule_;
  Schedule command_schedule_;
  Schedule state_schedule_;
};

}  // namespace airworthy::sim
