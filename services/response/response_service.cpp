#include "services/response/response_service.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "runtime/bus/channels.h"

namespace airworthy::response {
namespace {

using Transition = FaultLifeCycle::Transition;

constexpr const char* kDetector = "response";

evidence_t evidence(const char* name, double value, const std::string& unit) {
  evidence_t item;
  item.name = name;
  item.value = value;
  item.unit = unit;
  return item;
}

std::vector<evidence_t> evidence_of(const ChannelVerdict& verdict, const std::string& unit) {
  return {evidence("observed", verdict.observed, unit), evidence("expected", verdict.expected, unit),
          evidence("innovation", verdict.observed - verdict.expected, unit),
          evidence("innovation_sigma", verdict.sigma, unit), evidence("test_ratio", verdict.test_ratio, "1")};
}

std::int8_t phase_of(Transition transition) {
  switch (transition) {
    case Transition::kRaise:
      return 1;
    case Transition::kUpdate:
      return 2;
    case Transition::kClear:
      return 3;
    case Transition::kNone:
      break;
  }
  return 0;
}

std::string reason_of(Pace pace, MonitorState state, Muted muted, NotJudged reason) {
  const std::string data = pace == Pace::kInertial ? "inertial data" : "attitude data";
  if (state == MonitorState::kInitialising) return "no " + data + " yet";
  if (muted == Muted::kNotFlying) return "not flying";
  if (muted == Muted::kInputStale) return data + " stale";
  switch (reason) {
    case NotJudged::kConverging:
      return "converging: still learning this flight";
    case NotJudged::kInputUnknown:
      return "attitude, set-point or guidance data missing or stale";
    case NotJudged::kJudged:
      break;
  }
  return "";
}

}  // namespace

ResponseService::ResponseService(rt::Node& node, const ResponseConfig& config)
    : node_{node},
      config_{config},
      monitor_{config.monitor},
      events_{node.advertise(channel::kFaultEvent)},
      status_{node.advertise(channel::kDetectorStatus)} {
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
  node_.every(kStatusPeriod, [this](TimePoint) { publish_status(); });
}

void ResponseService::on_imu(const imu_t& message) {
  if (message.sensor_id != config_.imu_sensor_id) return;
  ImuSample sample{from_us(message.header.time_us), {}, {}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sample.accel_m_s2[axis] = message.accel_m_s2[axis];
    sample.gyro_rad_s[axis] = message.gyro_rad_s[axis];
  }
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
  const TimePoint now = monitor_.tick_time();
  std::optional<fault_event_t>& active = active_[channel];
  if (verdict.transition == Transition::kRaise) {
    active.emplace();
    active->number = next_number_++;
    active->detector = kDetector;
    active->component = meaning.component;
    active->fault_kind = meaning.fault_kind;
    active->severity = static_cast<std::int8_t>(meaning.severity);
    active->latched = config_.monitor.channels[channel].life_cycle.latched ? 1 : 0;
    active->probability = std::numeric_limits<double>::quiet_NaN();
    active->magnitude_unit = meaning.unit;
    active->onset_us = to_us(verdict.onset);
    active->detected_us = to_us(now);
    active->candidates = meaning.candidates;
    active->candidate_count = static_cast<std::int32_t>(meaning.candidates.size());
    active->summary = fmt::format("{}: {:.2f} {} where {:.2f} was expected", meaning.summary,
                                  verdict.observed, meaning.unit, verdict.expected);
  }
  if (!active) return;
  active->phase = phase_of(verdict.transition);
  active->magnitude = verdict.mean_innovation;
  active->magnitude_sigma = verdict.mean_innovation_sigma;
  active->evidence = evidence_of(verdict, meaning.unit);
  active->evidence_count = static_cast<std::int32_t>(active->evidence.size());
  events_.publish(*active, now);
  recent_.push_back(*active);
  if (recent_.size() > kRecentEvents) recent_.pop_front();
  if (verdict.transition != Transition::kUpdate) {
    node_.log().info(verdict.transition == Transition::kRaise ? "fault_raised" : "fault_cleared",
                     {{"component", meaning.component},
                      {"fault_kind", meaning.fault_kind},
                      {"number", active->number},
                      {"time_us", to_us(now)},
                      {"onset_us", active->onset_us}});
    publish_status();
  }
  if (verdict.transition == Transition::kClear) active.reset();
}

void ResponseService::publish_status() {
  detector_status_t status;
  status.detector = kDetector;
  const MonitorState state = monitor_.state();
  status.state = static_cast<std::int8_t>(state);
  const auto verdicts = monitor_.verdicts();
  if (state == MonitorState::kMuted)
    status.muted_reason = reason_of(config_.monitor.pace, state, monitor_.muted(), NotJudged::kJudged);
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    component_assessment_t assessment;
    assessment.component = config_.channels[i].component;
    const bool judged = state == MonitorState::kMonitoring && verdicts[i].reason == NotJudged::kJudged;
    assessment.judged = judged ? 1 : 0;
    if (!judged)
      assessment.reason = reason_of(config_.monitor.pace, state, monitor_.muted(), verdicts[i].reason);
    assessment.evidence = evidence_of(verdicts[i], config_.channels[i].unit);
    assessment.evidence_count = static_cast<std::int32_t>(assessment.evidence.size());
    status.components.push_back(assessment);
    if (active_[i]) status.active.push_back(*active_[i]);
  }
  status.component_count = static_cast<std::int32_t>(status.components.size());
  status.active_count = static_cast<std::int32_t>(status.active.size());
  status.recent.assign(recent_.begin(), recent_.end());
  status.recent_count = static_cast<std::int32_t>(status.recent.size());
  node_.counters()["samples_refused"] = monitor_.refused_samples();
  node_.counters()["input_gaps"] = monitor_.gaps();
  node_.counters()["priors_refused"] = monitor_.refused_priors();
  status.counters = node_.counters().to_messages();
  status.counter_count = static_cast<std::int32_t>(status.counters.size());
  status_.publish(status, node_.clock().now());
}

}  // namespace airworthy::response
