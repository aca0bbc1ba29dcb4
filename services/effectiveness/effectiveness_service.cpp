#include "services/effectiveness/effectiveness_service.h"

#include <fmt/format.h>

#include <numbers>

#include "airworthy/tick_t.hpp"
#include "runtime/bus/channels.h"
#include "runtime/phase/landed_report.h"

namespace airworthy::effectiveness {
namespace {

using Transition = FaultLifeCycle::Transition;

constexpr double kRadPerS_per_rpm = std::numbers::pi / 30.0;
constexpr Duration kInertialTimeout{200'000};
constexpr double kPullRatio = 0.005;   // of the filter for the status: half a second back to 1 unseen
constexpr double kYawVariance = 25.0;  // yaw also answers to rotors that speed up, which the row leaves out

std::string_view name_of(SpeedSource source) {
  switch (source) {
    case SpeedSource::kNone:
      break;
    case SpeedSource::kTelemetry:
      return "telemetry";
    case SpeedSource::kTelemetryAndCommands:
      return "telemetry_and_commands";
    case SpeedSource::kCommands:
      return "commands";
  }
  return "nothing";
}

std::string rotor_name(std::size_t index) { return fmt::format("rotor {}", index + 1); }

LossOfEffectivenessParams<double> filter_params(const EffectivenessParams& monitor) {
  LossOfEffectivenessParams<double> params;
  params.pull_ratio = kPullRatio;
  params.measurement_variance[kYawRow] = kYawVariance;
  params.lost_below = monitor.lost_below_ratio;
  return params;
}

/// Empty where the detector judges.
std::string text_of(Muted muted, Phase phase, std::size_t rotor) {
  switch (muted) {
    case Muted::kNot:
      break;
    case Muted::kPhase:
      return fmt::format("not in flight: {}", name_of(phase));
    case Muted::kSettling:
      return "settling after take-off or a change of what the speeds are taken from";
    case Muted::kNoThrust:
      return "the rotors hardly lift: what one of them lost would not show";
    case Muted::kStruck:
      return "pushed from the side: not by a rotor";
    case Muted::kTooSlow:
      return "inertial data come less than 50 times a second";
    case Muted::kNoSpeeds:
      return "neither rotor speeds nor commands";
    case Muted::kDelayUnknown:
      return "not yet known how much later than the rotor speeds the inertial data come";
    case Muted::kTelemetry:
      return fmt::format("speed of {} missing, frozen or implausible", rotor_name(rotor));
    case Muted::kMappingUnknown:
      return "not yet shown that the rotors are numbered as in the vehicle file";
    case Muted::kRotorMapping:
      return "rotor mapping implausible: the vehicle moves as if the rotors were numbered otherwise";
    case Muted::kRotorLost:
      return fmt::format("{} is lost: the others cannot be judged", rotor_name(rotor));
  }
  return "";
}

std::vector<evidence_t> evidence_of(const LossEvent& event, const EffectivenessMonitor& monitor) {
  using rt::evidence;
  return {evidence("log_likelihood_ratio", event.evidence, "nat"),
          evidence("threshold", monitor.test().threshold(), "nat"),
          evidence("second_rotor", event.second, "nat"),
          evidence("unexplained", event.unexplained, "nat"),
          evidence("speed_over_commanded", monitor.speeds().scale(event.rotor), "1"),
          evidence("speed_from_commands_alone",
                   monitor.speeds().source() == SpeedSource::kCommands ? 1.0 : 0.0, "1"),
          evidence("sample_age", to_seconds(event.decided - event.sample), "s")};
}

}  // namespace

EffectivenessService::EffectivenessService(rt::Node& node, const EffectivenessConfig& config)
    : node_{node},
      config_{config},
      phase_{node, config.monitor.vehicle},
      monitor_{config.monitor},
      filter_{config.monitor.effectiveness, filter_params(config.monitor)},
      reporter_{node, "effectiveness", [this] { return report(); }} {
  node_.subscribe<esc_status_t>(channel::kEscStatus,
                                [this](const esc_status_t& message) { on_esc_status(message); });
  node_.subscribe<rotor_command_t>(channel::kRotorCommand,
                                   [this](const rotor_command_t& message) { on_rotor_command(message); });
  node_.subscribe<flight_state_t>(channel::kFlightState, [this](const flight_state_t& message) {
    monitor_.on_report(rt::landed_report(message.landed_state));
  });
  node_.subscribe<tick_t>(channel::kTick,
                          [this](const tick_t& message) { tick_ = from_us(message.header.time_us); });
  // After the phase's own subscription: what it must know of this sample has been queued.
  node_.subscribe<imu_t>(channel::kImu, [this](const imu_t& message) { on_imu(message); });
}

void EffectivenessService::on_imu(const imu_t& message) {
  if (message.sensor_id != config_.imu_sensor_id) return;
  const TimePoint time = from_us(message.header.time_us);
  const Phase phase = phase_.advance_to(time).phase();
  last_imu_ = time;
  const std::array accel{message.accel_m_s2[0], message.accel_m_s2[1], message.accel_m_s2[2]};
  const std::array gyro{message.gyro_rad_s[0], message.gyro_rad_s[1], message.gyro_rad_s[2]};
  handle(monitor_.on_imu(time, accel, gyro, phase));
  note_source();
  if (phase == Phase::kInFlight) estimate(time, message);
}

void EffectivenessService::estimate(TimePoint time, const imu_t& message) {
  const double dt_s = last_filtered_ ? to_seconds(time - *last_filtered_) : 0.0;
  last_filtered_ = time;
  const std::array gyro{message.gyro_rad_s[0], message.gyro_rad_s[1], message.gyro_rad_s[2]};
  static_cast<void>(filter_.update(dt_s, monitor_.speeds().speeds(), gyro, message.accel_m_s2[2]));
}

void EffectivenessService::on_esc_status(const esc_status_t& message) {
  std::vector<double> speeds(message.speed_rpm);
  for (double& speed : speeds) speed *= kRadPerS_per_rpm;
  if (speeds.size() != config_.monitor.vehicle.rotor_count) node_.counters().add("speeds.wrong_rotor_count");
  handle(monitor_.on_speeds(from_us(message.header.time_us), speeds));
}

void EffectivenessService::on_rotor_command(const rotor_command_t& message) {
  if (message.command_ratio.size() != config_.monitor.vehicle.rotor_count)
    node_.counters().add("commands.wrong_rotor_count");
  handle(monitor_.on_commands(from_us(message.header.time_us), message.command_ratio));
}

void EffectivenessService::handle(const std::optional<LossEvent>& event) {
  if (!event) return;
  const bool is_lost = event->kind == LossKind::kPropellerLost;
  rt::Fault fault;
  fault.component = rotor_name(event->rotor);
  fault.fault_kind = is_lost ? "propeller_lost" : "partial_loss";
  fault.severity = is_lost ? rt::Severity::kWarning : rt::Severity::kCaution;
  fault.latched = true;
  fault.probability = event->probability_lost;
  fault.magnitude = event->effectiveness;
  fault.magnitude_sigma = event->sigma;
  fault.magnitude_unit = "1";
  fault.onset = event->onset;
  fault.summary = fmt::format("{:.0f} % of its thrust left", 100.0 * std::max(0.0, event->effectiveness));
  fault.evidence = evidence_of(*event, monitor_);
  // A partial loss that grows is the same fault, until nothing is left.
  std::optional<LossKind>& raised = raised_[event->rotor];
  const bool is_new = raised != event->kind;
  const std::size_t slot = 2 * event->rotor + (is_lost ? 1 : 0);
  reporter_.report(slot, is_new ? Transition::kRaise : Transition::kUpdate, event->decided, fault);
  raised = event->kind;
}

std::string EffectivenessService::muted_reason() const {
  if (last_imu_ && tick_ - *last_imu_ > kInertialTimeout) return "inertial data stale";
  return text_of(monitor_.muted(), phase_.phase().phase(), rotor_in_question());
}

std::size_t EffectivenessService::rotor_in_question() const {
  return monitor_.lost_rotor().value_or(monitor_.muted_rotor());
}

void EffectivenessService::observe_judgement(JudgementObserver observer) {
  judgement_observer_ = std::move(observer);
  monitor_.observe_judgement(
      [](void* self, const EffectivenessMonitor::Judgement& judgement) {
        const auto& service = *static_cast<const EffectivenessService*>(self);
        service.judgement_observer_(judgement.from, judgement.time,
                                    text_of(judgement.muted, judgement.phase, service.rotor_in_question()));
      },
      this);
}

void EffectivenessService::note_source() {
  const SpeedSource source = monitor_.speeds().source();
  if (source == logged_source_) return;
  logged_source_ = source;
  node_.log().info("speed_source_changed", {{"speeds_from", name_of(source)}});
}

bool EffectivenessService::uses_commands_alone() const {
  return monitor_.speeds().source() == SpeedSource::kCommands;
}

rt::DetectorReport EffectivenessService::report() {
  rt::DetectorReport report;
  const std::string reason = muted_reason();
  if (!last_imu_) {
    report.state = DetectorState::kInitialising;
  } else {
    report.state = reason.empty() ? DetectorState::kMonitoring : DetectorState::kMuted;
    report.muted_reason = reason;
  }
  const auto faults = filter_.single_faults();
  for (std::size_t i = 0; i < config_.monitor.vehicle.rotor_count; ++i) {
    const double k = faults ? (*faults)[i].effectiveness : 1.0;
    const double variance = faults ? (*faults)[i].variance : 1.0;
    report.components.push_back(rt::assessment(
        rotor_name(i), last_imu_ ? reason : "no inertial data yet",
        {rt::evidence("effectiveness", k, "1"), rt::evidence("effectiveness_sigma", std::sqrt(variance), "1"),
         rt::evidence("probability_lost",
                      LossOfEffectivenessFilter<double>::probability_below(config_.monitor.lost_below_ratio,
                                                                           k, variance),
                      "1"),
         rt::evidence("effectiveness_found", monitor_.effectiveness(i), "1"),
         rt::evidence("inertial_delay", to_seconds(monitor_.inertial_delay()), "s"),
         rt::evidence("speed_from_commands_alone", uses_commands_alone() ? 1.0 : 0.0, "1")}));
  }
  node_.counters()["samples_refused"] = monitor_.times_gone_back() + monitor_.samples_dropped();
  node_.counters()["speeds_refused"] = monitor_.speeds().refused_speeds();
  node_.counters()["messages_refused"] = monitor_.speeds().refused_messages();
  node_.counters()["unexplained_disturbances"] = monitor_.test().unexplained_disturbances();
  return report;
}

}  // namespace airworthy::effectiveness
