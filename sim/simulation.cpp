#include "sim/simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace airworthy::sim {
namespace {

constexpr double kControlStep_s = 1.0 / Controller::kRate_Hz;
constexpr int kPhysicsStepsPerControl = static_cast<int>(Realism::kPhysicsRate_Hz / Controller::kRate_Hz);
constexpr double kAttitudeErrorTime_s = 1.0;
constexpr double kPositionErrorTime_s = 5.0;
constexpr double kVelocityErrorTime_s = 1.0;
constexpr double kFreeSpeedRatio = 1.3;  // of a motor without its propeller, at the same command
constexpr double kFreeTimeConstantRatio = 0.3;
constexpr double kSpinDownTime_s = 0.15;  // of a motor without drive
constexpr double kDesyncMostRatio = 0.3;  // of full speed
constexpr double kFullSupply_V = 16.8;
constexpr double kLeastSag = 0.7;     // then the battery is empty and stays so
constexpr double kLeastFactor = 0.1;  // of a drawn error

/// Places of the rotors in the simulation: by position, whatever their numbers.
std::array<std::size_t, kMaxRotors> order_by_position(const Multirotor& vehicle) {
  std::vector<std::size_t> flown(vehicle.rotor_count);
  std::iota(flown.begin(), flown.end(), std::size_t{0});
  std::sort(flown.begin(), flown.end(), [&vehicle](std::size_t a, std::size_t b) {
    return vehicle.rotor[a].position_m < vehicle.rotor[b].position_m;
  });
  std::array<std::size_t, kMaxRotors> order{};
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::copy(flown.begin(), flown.end(), order.begin());
  return order;
}

Multirotor reordered(const Multirotor& vehicle) {
  const auto order = order_by_position(vehicle);
  Multirotor result = vehicle;
  for (std::size_t place = 0; place < vehicle.rotor_count; ++place) {
    result.rotor[place] = vehicle.rotor[order[place]];
  }
  return result;
}

/// 1 + error, never far from plausible.
double factor(double sigma, Random& random) {
  return std::max(kLeastFactor, 1.0 + sigma * std::clamp(random.normal(), -2.5, 2.5));
}

Eigen::Vector3d steady_wind(const Realism& realism, std::uint64_t seed) {
  Random random{seed, "wind direction"};
  const double direction_rad = random.uniform(0.0, 2.0 * std::numbers::pi);
  return realism.wind.mean_m_s * Eigen::Vector3d{std::cos(direction_rad), std::sin(direction_rad), 0.0};
}

}  // namespace

bool Simulation::Schedule::is_due(double time_s) {
  if (time_s + 1e-9 < next_s) return false;
  next_s += period_s;
  return true;
}

Multirotor Simulation::perturbed(const Multirotor& nominal, const Realism& realism, std::uint64_t seed) {
  Random random{seed, "airframe"};
  const Realism::Airframe& error = realism.airframe;
  Multirotor vehicle = reordered(nominal);
  vehicle.mass_kg *= factor(error.mass_error_ratio, random);
  for (double& inertia : vehicle.inertia_kg_m2) inertia *= factor(error.inertia_error_ratio, random);
  vehicle.thrust_coefficient_N_s2 *= factor(error.thrust_error_ratio, random);
  vehicle.torque_ratio_m *= factor(error.aerodynamics_error_ratio, random);
  vehicle.inflow_ratio *= factor(error.aerodynamics_error_ratio, random);
  vehicle.rotor_drag_ratio *= factor(error.aerodynamics_error_ratio, random);
  for (double& drag : vehicle.body_drag_N_s2_m2) drag *= factor(error.aerodynamics_error_ratio, random);
  for (double& response : vehicle.vibration_response) {
    response *= factor(error.vibration_response_error_ratio, random);
  }
  double arm_m = 0.0;
  for (const Rotor& rotor : vehicle.rotors()) {
    arm_m += std::hypot(rotor.position_m[0], rotor.position_m[1]) / static_cast<double>(vehicle.rotor_count);
  }
  const Eigen::Vector3d offset_m = error.centre_of_mass_m_per_m * arm_m * random.normal3();
  for (std::size_t place = 0; place < vehicle.rotor_count; ++place) {
    Rotor& rotor = vehicle.rotor[place];
    Random tilt{seed, "thrust axis", place};
    Eigen::Vector3d axis{rotor.thrust_axis[0], rotor.thrust_axis[1], rotor.thrust_axis[2]};
    axis += error.thrust_axis_error_rad * Eigen::Vector3d{tilt.normal(), tilt.normal(), 0.0};
    axis.normalize();
    for (std::size_t k = 0; k < 3; ++k) {
      rotor.thrust_axis[k] = axis[static_cast<Eigen::Index>(k)];
      rotor.position_m[k] -= offset_m[static_cast<Eigen::Index>(k)];
    }
  }
  return vehicle;
}

Simulation::Simulation(const Multirotor& nominal, const Scenario& scenario, const Realism& realism,
                       Seeds seeds)
    : realism_{realism},
      scenario_{scenario},
      number_of_{order_by_position(nominal)},
      place_of_{},
      dynamics_{perturbed(nominal, realism, seeds.vehicle)},
      hover_thrust_N_{dynamics_.vehicle().mass_kg * kGravity_m_s2},
      plan_{scenario, Random{seeds.flight, "set-points"}},
      controller_{reordered(nominal)},
      gusts_{steady_wind(realism, seeds.flight), Random{seeds.flight, "gusts"}},
      imu_{realism.imu,
           {nominal.imu_position_m[0], nominal.imu_position_m[1], nominal.imu_position_m[2]},
           kPhysicsStep_s,
           seeds.flight},
      esc_{realism.esc, nominal.rotor_count, seeds.flight},
      loss_{seeds.flight, "autopilot loss"},
      desync_{seeds.flight, "desync"},
      command_delay_steps_{
          static_cast<std::size_t>(std::lround(realism.motor.command_latency_s / kControlStep_s))},
      state_{dynamics_.at_rest()},
      imu_schedule_{imu_.period_s()},
      esc_schedule_{esc_.period_s()},
      attitude_schedule_{1.0 / realism.autopilot.attitude_rate_Hz},
      command_schedule_{1.0 / realism.autopilot.command_rate_Hz},
      state_schedule_{1.0 / realism.autopilot.state_rate_Hz} {
  for (std::size_t place = 0; place < kMaxRotors; ++place) place_of_[number_of_[place]] = place;
  for (std::uint64_t axis = 0; axis < 3; ++axis) {
    attitude_error_.emplace_back(realism.autopilot.attitude_noise_rad, kAttitudeErrorTime_s,
                                 Random{seeds.flight, "attitude", axis});
    position_error_.emplace_back(realism.autopilot.position_noise_m, kPositionErrorTime_s,
                                 Random{seeds.flight, "position", axis});
    velocity_error_.emplace_back(realism.autopilot.velocity_noise_m_s, kVelocityErrorTime_s,
                                 Random{seeds.flight, "velocity", axis});
  }
  const Multirotor& vehicle = dynamics_.vehicle();
  const double hover_rad_s = dynamics_.hover_speed_rad_s();
  for (std::size_t place = 0; place < vehicle.rotor_count; ++place) {
    Random random{seeds.vehicle, "rotor", place};
    RotorInput& rotor = inputs_.rotor[place];
    thrust_error_[place] = factor(realism.rotor.thrust_error_ratio, random);
    time_constant_s_[place] =
        vehicle.motor_time_constant_s * factor(realism.motor.time_constant_error_ratio, random);
    natural_unbalance_kg_m_[place] = std::abs(random.normal()) * realism.rotor.natural_unbalance_m_s2 *
                                     vehicle.mass_kg / (hover_rad_s * hover_rad_s);
    natural_unbalance_phase_rad_[place] = random.uniform(0.0, 2.0 * std::numbers::pi);
    damage_angle_rad_[place] =
        Random{seeds.vehicle, "damage angle", place}.uniform(0.0, 2.0 * std::numbers::pi);
    rotor.blade_pass_ratio = realism.rotor.blade_pass_ratio;
    state_.phase_rad[place] = random.uniform(0.0, 2.0 * std::numbers::pi);
    speed_error_.emplace_back(realism.motor.speed_error_ratio, realism.motor.speed_error_time_s,
                              Random{seeds.flight, "speed error", place});
  }
  drive_motors(ControlOutput{});
}

bool Simulation::link_is_up(Link link) const {
  return std::none_of(scenario_.faults.begin(), scenario_.faults.end(), [&](const Fault& fault) {
    return fault.kind == FaultKind::kLinkLoss && fault.link == link && fault.is_active(time_s_);
  });
}

ImuFault Simulation::imu_fault() const {
  ImuFault result;
  for (const Fault& fault : scenario_.faults) {
    if (!fault.is_active(time_s_)) continue;
    const double value = fault.magnitude_at(time_s_);
    // A spike is one sample in a hundred.
    const bool is_spike_now = steps_ % 100 == 0;
    switch (fault.kind) {
      case FaultKind::kGyroBias:
      case FaultKind::kGyroDrift:
        result.gyro_offset_rad_s[fault.axis] += value;
        break;
      case FaultKind::kAccelBias:
      case FaultKind::kAccelDrift:
        result.accel_offset_m_s2[fault.axis] += value;
        break;
      case FaultKind::kGyroSpike:
        if (is_spike_now) result.gyro_offset_rad_s[fault.axis] += value;
        break;
      case FaultKind::kAccelSpike:
        if (is_spike_now) result.accel_offset_m_s2[fault.axis] += value;
        break;
      case FaultKind::kGyroFreeze:
        result.gyro_is_frozen = true;
        break;
      case FaultKind::kAccelFreeze:
        result.accel_is_frozen = true;
        break;
      default:
        break;
    }
  }
  return result;
}

std::array<EscFault, kMaxRotors> Simulation::esc_faults() const {
  std::array<EscFault, kMaxRotors> result{};
  for (const Fault& fault : scenario_.faults) {
    if (fault.rotor == 0 || !fault.is_active(time_s_)) continue;
    EscFault& esc = result[place_of_[fault.rotor - 1]];
    switch (fault.kind) {
      case FaultKind::kDeadEsc:
        esc.is_silent = true;
        break;
      case FaultKind::kDesync:
        esc.is_garbage = true;
        break;
      case FaultKind::kTelemetryFrozen:
        esc.is_frozen = true;
        break;
      case FaultKind::kTelemetryWrongUnit:
        esc.speed_factor = fault.magnitude;
        esc.temperature_offset_K = 273.15;
        break;
      default:
        break;
    }
  }
  return result;
}

std::array<double, kMaxRotors> Simulation::numbered(const std::array<double, kMaxRotors>& by_place) const {
  std::array<double, kMaxRotors> result{};
  for (std::size_t place = 0; place < kMaxRotors; ++place) result[number_of_[place]] = by_place[place];
  return result;
}

double Simulation::sag() const {
  return std::max(kLeastSag, 1.0 - realism_.motor.sag_ratio_per_min * time_s_ / 60.0);
}

double Simulation::thrust_ratio() const {
  double thrust_N = 0.0;
  for (std::size_t place = 0; place < dynamics_.vehicle().rotor_count; ++place) {
    thrust_N += dynamics_.vehicle().thrust_coefficient_N_s2 * state_.speed_rad_s[place] *
                state_.speed_rad_s[place] * inputs_.rotor[place].thrust_ratio;
  }
  return thrust_N / hover_thrust_N_;
}

Estimate Simulation::estimate() {
  Estimate result;
  Eigen::Vector3d attitude_error;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    attitude_error[axis] = attitude_error_[i].step(kControlStep_s);
    result.position_N_m[axis] = state_.position_N_m[axis] + position_error_[i].step(kControlStep_s);
    result.velocity_N_m_s[axis] = state_.velocity_N_m_s[axis] + velocity_error_[i].step(kControlStep_s);
  }
  // The take-off point is where the vehicle stands.
  result.position_N_m.z() += dynamics_.vehicle().gear_height_m;
  result.q_NB = state_.q_NB * Eigen::Quaterniond{1.0, 0.5 * attitude_error.x(), 0.5 * attitude_error.y(),
                                                 0.5 * attitude_error.z()};
  result.q_NB.normalize();
  result.gyro_rad_s = imu_.gyro_rad_s(imu_fault());
  result.has_contact = accelerations_.has_contact;
  return result;
}

void Simulation::drive_motors(const ControlOutput& control) {
  const Multirotor& vehicle = dynamics_.vehicle();
  commands_under_way_.push_back(control.command_ratio);
  if (commands_under_way_.size() > command_delay_steps_ + 1) commands_under_way_.pop_front();
  const auto& command = commands_under_way_.front();
  for (std::size_t place = 0; place < vehicle.rotor_count; ++place) {
    RotorInput& rotor = inputs_.rotor[place];
    double ratio = command[place];
    double speed_factor = sag() * (1.0 + speed_error_[place].step(kControlStep_s));
    rotor.time_constant_s = time_constant_s_[place];
    rotor.thrust_ratio = thrust_error_[place];
    // As seen from the natural unbalance.
    Eigen::Vector2d unbalance_kg_m{natural_unbalance_kg_m_[place], 0.0};
    rotor.blade_pass_ratio = realism_.rotor.blade_pass_ratio;
    bool is_driven = true;
    for (const Fault& fault : scenario_.faults) {
      if (fault.rotor != number_of_[place] + 1 || !fault.is_active(time_s_)) continue;
      switch (fault.kind) {
        case FaultKind::kUnbalance: {
          const double angle_rad = fault.angle_rad.value_or(damage_angle_rad_[place]);
          unbalance_kg_m += 1e-6 * std::max(0.0, fault.magnitude_at(time_s_)) * vehicle.propeller_radius_m *
                            Eigen::Vector2d{std::cos(angle_rad), std::sin(angle_rad)};
          break;
        }
        case FaultKind::kPropellerLost:
          rotor.thrust_ratio = 0.0;
          unbalance_kg_m.setZero();
          rotor.time_constant_s *= kFreeTimeConstantRatio;
          speed_factor *= kFreeSpeedRatio;
          break;
        case FaultKind::kPartialLoss:
          rotor.thrust_ratio *= 1.0 - std::clamp(fault.magnitude_at(time_s_), 0.0, 1.0);
          break;
        case FaultKind::kStuckCommand:
          if (!is_stuck_[place]) stuck_command_[place] = ratio;
          is_stuck_[place] = true;
          ratio = stuck_command_[place];
          break;
        case FaultKind::kDeadEsc:
          is_driven = false;
          break;
        case FaultKind::kDesync:
          // The motor stutters: a new low speed every tenth of a second.
          if (steps_ % 50 == 0) {
            desync_speed_rad_s_[place] = desync_.uniform(0.0, kDesyncMostRatio) * vehicle.speed_max_rad_s;
          }
          break;
        default:
          break;
      }
    }
    rotor.unbalance_kg_m = unbalance_kg_m.norm();
    rotor.unbalance_phase_rad =
        natural_unbalance_phase_rad_[place] + std::atan2(unbalance_kg_m.y(), unbalance_kg_m.x());
    const bool is_desynchronised =
        std::any_of(scenario_.faults.begin(), scenario_.faults.end(), [&](const Fault& fault) {
          return fault.kind == FaultKind::kDesync && fault.rotor == number_of_[place] + 1 &&
                 fault.is_active(time_s_);
        });
    rotor.speed_target_rad_s = speed_factor * (vehicle.speed_min_rad_s +
                                               ratio * (vehicle.speed_max_rad_s - vehicle.speed_min_rad_s));
    if (is_desynchronised) rotor.speed_target_rad_s = desync_speed_rad_s_[place];
    if (!control.is_armed || !is_driven) {
      rotor.speed_target_rad_s = 0.0;
      rotor.time_constant_s = kSpinDownTime_s;
    }
  }
}

void Simulation::send_inertial(double time_s, Output& output) {
  const ImuSample sample = imu_.sample(time_s, imu_fault());
  if (!loss_.chance(realism_.imu.dropout_ratio) && link_is_up(Link::kAutopilot)) output.on_imu(sample);
}

void Simulation::send(Output& output) {
  if (!truth_is_told_) {
    truth_is_told_ = true;
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    if (scenario_.faults.empty()) output.on_truth({"", "none", -1.0, kNaN});
    for (const Fault& fault : scenario_.faults) {
      output.on_truth({fault.component(), std::string{word_of(fault.kind)}, fault.onset_s,
                       has_magnitude(fault.kind) ? fault.magnitude : kNaN});
    }
  }
  const bool autopilot_is_up = link_is_up(Link::kAutopilot);
  const double autopilot_loss = realism_.autopilot.dropout_ratio;
  if (esc_schedule_.is_due(time_s_))
    esc_.measure(time_s_, kFullSupply_V * sag(), state_.speed_rad_s, esc_faults());
  const bool esc_is_up = link_is_up(Link::kEsc);
  while (auto sample = esc_.arrived(time_s_)) {
    sample->speed_rpm = numbered(sample->speed_rpm);
    sample->voltage_V = numbered(sample->voltage_V);
    sample->current_A = numbered(sample->current_A);
    sample->temperature_degC = numbered(sample->temperature_degC);
    if (esc_is_up) output.on_esc(*sample);
  }
  AutopilotSample reported = autopilot_;
  reported.control.command_ratio = numbered(autopilot_.control.command_ratio);
  if (attitude_schedule_.is_due(time_s_) && !loss_.chance(autopilot_loss) && autopilot_is_up) {
    output.on_attitude(reported);
  }
  if (command_schedule_.is_due(time_s_) && !loss_.chance(autopilot_loss) && autopilot_is_up) {
    output.on_commands(reported);
  }
  landed_states_.emplace_back(time_s_, autopilot_.control.landed_state);
  while (landed_states_.size() > 1 &&
         landed_states_[1].first <= time_s_ - realism_.autopilot.landed_state_delay_s) {
    landed_states_.pop_front();
  }
  if (state_schedule_.is_due(time_s_) && !loss_.chance(autopilot_loss) && autopilot_is_up) {
    output.on_flight_state(reported, landed_states_.front().second);
  }
}

void Simulation::step(Output& output) {
  const Reference reference = plan_.at(time_s_);
  autopilot_.time_s = time_s_;
  autopilot_.estimate = estimate();
  autopilot_.control = controller_.step(autopilot_.estimate, reference);
  autopilot_.wind_N_m_s = gusts_.wind_N_m_s();
  drive_motors(autopilot_.control);
  send(output);

  const double airspeed_m_s = (state_.velocity_N_m_s - gusts_.wind_N_m_s()).norm();
  inputs_.wind_N_m_s = gusts_.step(-state_.position_N_m.z(), airspeed_m_s, kControlStep_s);
  const double thrust = thrust_ratio();
  for (int k = 0; k < kPhysicsStepsPerControl; ++k) {
    dynamics_.step(state_, inputs_, kPhysicsStep_s);
    accelerations_ = dynamics_.accelerations(state_, inputs_);
    imu_.step(state_, accelerations_, thrust);
    const double now_s = time_s_ + static_cast<double>(k + 1) * kPhysicsStep_s;
    if (imu_schedule_.is_due(now_s)) send_inertial(now_s, output);
  }
  ++steps_;
  time_s_ = static_cast<double>(steps_) * kControlStep_s;
}

}  // namespace airworthy::sim
