#include "services/actuator/actuator_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "runtime/bus/channels.h"

namespace airworthy::actuator {
namespace {

using Transition = FaultLifeCycle::Transition;

// One fault per component: rotors, axes, and what is not named.
constexpr std::size_t kAxisSlot = kMaxRotors;
constexpr std::size_t kPropulsionSlot = kAxisSlot + kAxes;
constexpr double kRadSPerRpm = std::numbers::pi / 30.0;
constexpr std::array<const char*, kAxes> kAxisNames{"roll axis", "pitch axis", "yaw axis", "height axis"};

std::string rotor_name(std::size_t rotor) { return fmt::format("rotor {}", rotor + 1); }

std::string reason_of(NotJudged reason, double sigma) {
  switch (reason) {
    case NotJudged::kNoInput:
      return "inertial data, or rotor speeds and commands, missing";
    case NotJudged::kInputTooSlow:
      return "rotor speeds or commands come too seldom or too late";
    case NotJudged::kNotFlying:
      return "not in free flight";
    case NotJudged::kFrozen:
      return "the inertial unit repeats its values";
    case NotJudged::kConverging:
      return "converging: this flight has only begun";
    case NotJudged::kNotExcited:
      return fmt::format("not excited: loss known to {:.2f} only", sigma);
    case NotJudged::kNotObservable:
      return fmt::format("not told apart from disturbances and other rotors: loss known to {:.2f} only",
                         sigma);
    case NotJudged::kImplausible:
      return "what is felt is no loss of thrust: something else acts on the vehicle";
    case NotJudged::kJudged:
      break;
  }
  return "";
}

// With `nis` of the rotors' observer, 4 on average if its model holds.
std::vector<evidence_t> evidence_of_rotor(const LossVerdict& verdict, double nis) {
  using rt::evidence;
  return {evidence("loss", verdict.gamma, "1"),
          evidence("loss_sigma", verdict.sigma, "1"),
          evidence("baseline", verdict.baseline, "1"),
          evidence("judged_loss", verdict.test_gamma, "1"),
          evidence("judged_loss_sigma", verdict.test_sigma, "1"),
          evidence("log_likelihood_lead", verdict.lead, "1"),
          evidence("nis", nis, "1")};
}

std::vector<evidence_t> evidence_of_axis(const LossVerdict& verdict, const AxisState& state,
                                         std::size_t axis) {
  const char* const unit = axis == kHeight ? "m/s^2" : "rad/s^2";
  using rt::evidence;
  return {evidence("loss", verdict.gamma, "1"), evidence("loss_sigma", verdict.sigma, "1"),
          evidence("commanded", state.commanded, unit), evidence("disturbance", state.disturbance, unit)};
}

std::vector<std::string> names_of(std::uint32_t rotors) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < kMaxRotors; ++i) {
    if ((rotors >> i & 1U) != 0U) names.push_back(rotor_name(i));
  }
  return names;
}

}  // namespace

ActuatorService::ActuatorService(rt::Node& node, const ActuatorConfig& config)
    : node_{node},
      config_{config},
      phase_{node, config.monitor.vehicle},
      monitor_{config.monitor},
      reporter_{node, "actuator", [this] { return report(); }},
      states_{node.advertise(channel::kActuatorState)} {
  node_.subscribe<imu_t>(channel::kImu, [this](const imu_t& message) { on_imu(message); });
  node_.subscribe<esc_status_t>(channel::kEscStatus,
                                [this](const esc_status_t& message) { on_esc_status(message); });
  node_.subscribe<rotor_command_t>(channel::kRotorCommand, [this](const rotor_command_t& message) {
    if (message.command_ratio.size() != config_.monitor.vehicle.rotor_count)
      node_.counters().add("commands.wrong_rotor_count");
    monitor_.on_rotor_commands(from_us(message.header.time_us), message.command_ratio);
  });
  node_.subscribe<attitude_t>(channel::kAttitude, [this](const attitude_t& message) {
    monitor_.on_attitude(message.roll_rad, message.pitch_rad, message.yaw_rad);
  });
  node_.subscribe<flight_state_t>(
      channel::kFlightState, [this](const flight_state_t& message) { monitor_.on_climb(message.climb_m_s); });
  node_.subscribe<tick_t>(
      channel::kTick, [this](const tick_t& message) { monitor_.on_clock(from_us(message.header.time_us)); });
}

void ActuatorService::on_esc_status(const esc_status_t& message) {
  std::vector<double> speeds = message.speed_rpm;
  for (double& speed : speeds) speed *= kRadSPerRpm;
  if (speeds.size() != config_.monitor.vehicle.rotor_count) node_.counters().add("speeds.wrong_rotor_count");
  monitor_.on_rotor_speeds(from_us(message.header.time_us), speeds);
}

void ActuatorService::on_imu(const imu_t& message) {
  if (message.sensor_id != config_.imu_sensor_id) return;
  MonitorSample sample{from_us(message.header.time_us), {}, {}};
  std::copy(std::begin(message.accel_m_s2), std::end(message.accel_m_s2), sample.accel_m_s2.begin());
  std::copy(std::begin(message.gyro_rad_s), std::end(message.gyro_rad_s), sample.gyro_rad_s.begin());
  const Phase phase = phase_.advance_to(sample.time).phase();
  if (monitor_.on_imu(sample, phase) != UpdateStatus::kFused) return;
  const auto rotors = monitor_.rotors();
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    if (rotors[i].transition != Transition::kNone) report_rotor(i, rotors[i]);
  }
  for (std::size_t i = 0; i < kAxes; ++i) {
    if (monitor_.axes()[i].transition != Transition::kNone) report_axis(i, monitor_.axes()[i]);
  }
  const bool is_later = state_published_ && sample.time >= *state_published_;
  if (is_later && sample.time - *state_published_ < config_.state_period) return;
  state_published_ = sample.time;
  publish_state();
}

void ActuatorService::report_rotor(std::size_t rotor, const LossVerdict& verdict) {
  rt::Fault fault;
  fault.component = verdict.is_isolated ? rotor_name(rotor) : "propulsion";
  fault.fault_kind = "loss_of_effectiveness";
  fault.severity =
      verdict.test_gamma >= config_.warning_loss_ratio ? rt::Severity::kWarning : rt::Severity::kCaution;
  fault.latched = config_.monitor.rotor.life_cycle.latched;
  fault.probability = verdict.probability;
  fault.magnitude = verdict.test_gamma;
  fault.magnitude_sigma = verdict.test_sigma;
  fault.magnitude_unit = "1";
  fault.onset = verdict.onset;
  if (verdict.is_isolated) {
    fault.summary = fmt::format("rotor {} has lost {:.0f} ± {:.0f} % of its thrust", rotor + 1,
                                100.0 * verdict.test_gamma, 100.0 * verdict.test_sigma);
  } else {
    fault.candidates = names_of(verdict.candidates);
    fault.summary = fmt::format("one rotor has lost about {:.0f} % of its thrust; most likely rotor {}",
                                100.0 * verdict.test_gamma, rotor + 1);
  }
  fault.evidence = evidence_of_rotor(verdict, monitor_.nis());
  reporter_.report(verdict.is_isolated ? rotor : kPropulsionSlot, verdict.transition, monitor_.time(), fault);
}

void ActuatorService::report_axis(std::size_t axis, const LossVerdict& verdict) {
  rt::Fault fault;
  fault.component = kAxisNames[axis];
  fault.fault_kind = "control_effectiveness_loss";
  fault.severity = rt::Severity::kWarning;
  fault.latched = config_.monitor.axis.life_cycle.latched;
  fault.probability = verdict.probability;
  fault.magnitude = verdict.gamma;
  fault.magnitude_sigma = verdict.sigma;
  fault.magnitude_unit = "1";
  fault.onset = verdict.onset;
  fault.summary = fmt::format("{}: {:.0f} ± {:.0f} % of what is commanded does not come", kAxisNames[axis],
                              100.0 * verdict.gamma, 100.0 * verdict.sigma);
  fault.evidence = evidence_of_axis(verdict, monitor_.axis_states()[axis], axis);
  reporter_.report(kAxisSlot + axis, verdict.transition, monitor_.time(), fault);
}

void ActuatorService::publish_state() {
  actuator_state_t message;
  for (std::size_t i = 0; i < 3; ++i) {
    const AxisState& axis = monitor_.axis_states()[i];
    message.angle_rad[i] = axis.position;
    message.angle_sigma_rad[i] = axis.position_sigma;
    message.rate_rad_s[i] = axis.rate;
    message.rate_sigma_rad_s[i] = axis.rate_sigma;
    message.commanded_rad_s2[i] = axis.commanded;
    message.disturbance_rad_s2[i] = axis.disturbance;
  }
  const AxisState& height = monitor_.axis_states()[kHeight];
  message.climb_m_s = height.position;
  message.climb_sigma_m_s = height.position_sigma;
  message.specific_force_up_m_s2 = height.rate;
  message.specific_force_up_sigma_m_s2 = height.rate_sigma;
  message.commanded_up_m_s2 = height.commanded;
  message.disturbance_up_m_s2 = height.disturbance;
  for (std::size_t i = 0; i < kAxes; ++i) {
    const LossVerdict& axis = monitor_.axes()[i];
    message.axis_loss_ratio[i] = axis.gamma;
    message.axis_loss_sigma[i] = axis.sigma;
    message.axis_judged[i] = axis.reason == NotJudged::kJudged ? 1 : 0;
  }
  for (const LossVerdict& rotor : monitor_.rotors()) {
    message.rotor_loss_ratio.push_back(rotor.gamma - rotor.baseline);
    message.rotor_loss_sigma.push_back(rotor.sigma);
    message.rotor_loss_alone_ratio.push_back(rotor.test_gamma);
    message.rotor_loss_alone_sigma.push_back(rotor.test_sigma);
    message.rotor_judged.push_back(rotor.reason == NotJudged::kJudged ? 1 : 0);
  }
  message.rotor_count = static_cast<std::int32_t>(monitor_.rotors().size());
  states_.publish(message, monitor_.time());
}

rt::DetectorReport ActuatorService::report() const {
  rt::DetectorReport report;
  report.state = monitor_.state();
  if (report.state == DetectorState::kMuted) report.muted_reason = reason_of(monitor_.reason(), 0.0);
  const auto rotors = monitor_.rotors();
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    report.components.push_back(rt::assessment(rotor_name(i),
                                               reason_of(rotors[i].reason, rotors[i].test_sigma),
                                               evidence_of_rotor(rotors[i], monitor_.nis())));
  }
  for (std::size_t i = 0; i < kAxes; ++i) {
    const LossVerdict& axis = monitor_.axes()[i];
    report.components.push_back(rt::assessment(kAxisNames[i], reason_of(axis.reason, axis.sigma),
                                               evidence_of_axis(axis, monitor_.axis_states()[i], i)));
  }
  node_.counters()["samples_refused"] = monitor_.refused();
  node_.counters()["outliers"] = monitor_.outliers();
  node_.counters()["samples_repeated"] = monitor_.repeated();
  node_.counters()["times_restarted"] = monitor_.restarts();
  node_.counters()["attitudes_refused"] = monitor_.refused_attitudes();
  node_.counters()["speeds_refused"] = monitor_.rotor_input().refused_speeds();
  node_.counters()["messages_refused"] = monitor_.rotor_input().refused_messages();
  return report;
}

}  // namespace airworthy::actuator
