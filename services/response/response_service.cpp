#include "services/response/response_service.h"

#include <fmt/format.h>

#include "runtime/bus/channels.h"

namespace airworthy::response {
namespace {

using Transition = FaultLifeCycle::Transition;

std::vector<evidence_t> evidence_of(const ChannelVerdict& verdict, const std::string& unit) {
  using rt::evidence;
  return {evidence("observed", verdict.observed, unit), evidence("expected", verdict.expected, unit),
          evidence("innovation", verdict.observed - verdict.expected, unit),
          evidence("innovation_sigma", verdict.sigma, unit), evidence("test_ratio", verdict.test_ratio, "1")};
}

}  // namespace

ResponseService::ResponseService(rt::Node& node, const ResponseConfig& config)
    : node_{node}, config_{config}, monitor_{config.monitor}, reporter_{node, "response", [this] {
                                                                          return report();
                                                                        }} {
  // Before the service's own subscriptions: what it must know of a sample has been queued.
  if (config.monitor.needs_flight_phase) {
    phase_.emplace(node, *config.multirotor);
    node_.subscribe<esc_status_t>(channel::kEscStatus, [this](const esc_status_t& message) {
      if (message.speed_rpm.size() != config_.multirotor->rotor_count)
        node_.counters().add("speeds.wrong_rotor_count");
    });
  }
  node_.subscribe<imu_t>(channel::kImu, [this](const imu_t& message) { on_imu(message); });
  node_.subscribe<attitude_t>(channel::kAttitude,
                              [this](const attitude_t& message) { on_attitude(message); });
  node_.subscribe<attitude_setpoint_t>(channel::kAttitudeSetpoint,
                                       [this](const attitude_setpoint_t& message) { on_setpoint(message); });
  node_.subscribe<rotor_command_t>(channel::kRotorCommand,
                                   [this](const rotor_command_t& message) { on_rotor_command(message); });
  node_.subscribe<flight_state_t>(channel::kFlightState,
                                  [this](const flight_state_t& message) { on_flight_state(message); });
  node_.subscribe<tick_t>(
      channel::kTick, [this](const tick_t& message) { monitor_.on_clock(from_us(message.header.time_us)); });
}

void ResponseService::on_imu(const imu_t& message) {
  if (message.sensor_id != config_.imu_sensor_id) return;
  ImuSample sample{from_us(message.header.time_us), {}, {}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sample.accel_m_s2[axis] = message.accel_m_s2[axis];
    sample.gyro_rad_s[axis] = message.gyro_rad_s[axis];
  }
  if (phase_) monitor_.on_phase(phase_->advance_to(sample.time).phase());
  if (monitor_.on_imu(sample)) handle_tick();
}

void ResponseService::handle_tick() {
  if (observer_) observer_(monitor_);
  const auto verdicts = monitor_.verdicts();
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    if (verdicts[i].transition != Transition::kNone) handle_verdict(i, verdicts[i]);
  }
}

void ResponseService::on_attitude(const attitude_t& message) {
  if (monitor_.on_attitude(from_us(message.header.time_us), message.roll_rad, message.pitch_rad)) {
    handle_tick();
  }
}

void ResponseService::on_setpoint(const attitude_setpoint_t& message) {
  monitor_.on_attitude_setpoint(from_us(message.header.time_us), message.roll_rad, message.pitch_rad,
                                message.thrust_ratio);
}

void ResponseService::on_rotor_command(const rotor_command_t& message) {
  if (phase_ && message.command_ratio.size() != config_.multirotor->rotor_count)
    node_.counters().add("commands.wrong_rotor_count");
  monitor_.on_rotor_command(from_us(message.header.time_us), message.command_ratio);
}

void ResponseService::on_flight_state(const flight_state_t& message) {
  monitor_.on_flight_state({.time = from_us(message.header.time_us),
                            .airspeed_m_s = message.airspeed_m_s,
                            .groundspeed_m_s = message.groundspeed_m_s,
                            .climb_m_s = message.climb_m_s,
                            .altitude_error_m = message.altitude_error_m,
                            .airspeed_error_m_s = message.airspeed_error_m_s,
                            .armed = message.armed,
                            .landed_state = message.landed_state});
}

void ResponseService::handle_verdict(std::size_t channel, const ChannelVerdict& verdict) {
  const ChannelMeaning& meaning = config_.channels[channel];
  rt::Fault fault;
  fault.component = meaning.component;
  fault.fault_kind = meaning.fault_kind;
  fault.severity = meaning.severity;
  fault.latched = config_.monitor.channels[channel].life_cycle.latched;
  fault.magnitude = verdict.mean_innovation;
  fault.magnitude_sigma = verdict.mean_innovation_sigma;
  fault.magnitude_unit = meaning.unit;
  fault.onset = verdict.onset;
  fault.summary = fmt::format("{}: {:.2f} {} where {:.2f} was expected", meaning.summary, verdict.observed,
                              meaning.unit, verdict.expected);
  fault.candidates = meaning.candidates;
  fault.evidence = evidence_of(verdict, meaning.unit);
  reporter_.report(channel, verdict.transition, monitor_.tick_time(), fault);
}

std::string ResponseService::reason_of(NotJudged reason) const {
  const std::string data = config_.monitor.pace == Pace::kInertial ? "inertial data" : "attitude data";
  if (monitor_.state() == DetectorState::kInitialising) return "no " + data + " yet";
  switch (monitor_.muted()) {
    case Muted::kNotFlying:
      return "not flying";
    case Muted::kNotInFlight:
      return fmt::format("not in flight: {}", name_of(monitor_.muted_phase()));
    case Muted::kInputStale:
      return data + " stale";
    case Muted::kNo:
      break;
  }
  switch (reason) {
    case NotJudged::kConverging:
      return "converging: still learning this flight";
    case NotJudged::kInputUnknown:
      return "attitude, set-point or guidance data missing or stale";
    case NotJudged::kPaused:
    case NotJudged::kJudged:
      break;
  }
  return "";
}

rt::DetectorReport ResponseService::report() const {
  rt::DetectorReport report;
  report.state = monitor_.state();
  if (report.state == DetectorState::kMuted) report.muted_reason = reason_of(NotJudged::kJudged);
  const auto verdicts = monitor_.verdicts();
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    const bool judged =
        report.state == DetectorState::kMonitoring && verdicts[i].reason == NotJudged::kJudged;
    component_assessment_t assessment =
        rt::assessment(config_.channels[i].component, judged ? "" : reason_of(verdicts[i].reason),
                       evidence_of(verdicts[i], config_.channels[i].unit));
    assessment.judged = judged ? 1 : 0;
    report.components.push_back(std::move(assessment));
  }
  node_.counters()["samples_refused"] = monitor_.refused_samples();
  node_.counters()["input_gaps"] = monitor_.gaps();
  node_.counters()["priors_refused"] = monitor_.refused_priors();
  return report;
}

}  // namespace airworthy::response
