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
constexpr double kPullRatio = 0.005;  // of the filter for the status: half a second back to 1 unseen
constexpr std::size_t kDescriptionSlot = kLossKinds * kMaxRotors;  // after a slot for each rotor and kind

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
  // Without the yaw row: the sense of rotation may be described wrongly.
  params.pull_ratio = kPullRatio;
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
    case Muted::kFrozen:
      return "the inertial unit repeats itself";
    case Muted::kSpeedsLate:
      return "without commands, rotor speeds come too seldom or too late";
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
          evidence("threshold", event.threshold, "nat"),
          evidence("second_rotor", event.second, "nat"),
          evidence("unexplained", event.unexplained, "nat"),
          evidence("speed_over_commanded", monitor.speeds().scale(event.rotor), "1"),
          evidence("speed_from_commands_alone",
                   monitor.speeds().source() == SpeedSource::kCommands ? 1.0 : 0.0, "1"),
          evidence("sample_age", to_seconds(event.decided - event.sample), "s")};
}

std::string_view name_of(LossKind kind) {
  switch (kind) {
    case LossKind::kPropellerLost:
      return "propeller_lost";
    case LossKind::kPartialLoss:
      return "partial_loss";
    case LossKind::kOverEffective:
      break;
  }
  return "over_effective";
}

std::string summary_of(const LossEvent& event) {
  if (event.kind == LossKind::kOverEffective)
    return fmt::format("{:.0f} % of the thrust described: is it the right propeller?",
                       100.0 * event.effectiveness);
  return fmt::format("{:.0f} % of its thrust left", 100.0 * std::max(0.0, event.effectiveness));
}

/// "rotors 1 and 3", "rotor 2".
std::string rotors_of(std::uint32_t pattern) {
  std::vector<std::size_t> rotors;
  for (std::size_t i = 0; i < kMaxRotors; ++i) {
    if ((pattern >> i) & 1U) rotors.push_back(i + 1);
  }
  std::string text = rotors.size() == 1 ? "rotor " : "rotors ";
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    text += fmt::format("{}{}", i == 0 ? "" : i + 1 == rotors.size() ? " and " : ", ", rotors[i]);
  }
  return text;
}

std::string describe_spin(std::uint32_t pattern, bool is_named, const Multirotor& vehicle) {
  if (!is_named) return "the vehicle yaws as if some rotors turned the other way than the vehicle file says";
  if (pattern == (1U << vehicle.rotor_count) - 1)
    return "all rotors seem to turn the other way than the vehicle file says";
  std::array<std::uint32_t, 2> described{};  // clockwise, counter-clockwise
  for (std::size_t i = 0; i < vehicle.rotor_count; ++i) {
    if ((pattern >> i) & 1U) described[vehicle.rotor[i].spin > 0 ? 0 : 1] |= 1U << i;
  }
  constexpr std::array<std::string_view, 2> kWays{"clockwise", "counter-clockwise"};
  std::string text;
  for (std::size_t way = 0; way < 2; ++way) {
    if (described[way] == 0) continue;
    const bool is_one = (described[way] & (described[way] - 1)) == 0;
    text += fmt::format("{}{} {} to turn {}, the vehicle file says {}", text.empty() ? "" : "; ",
                        rotors_of(described[way]), is_one ? "seems" : "seem", kWays[1 - way], kWays[way]);
  }
  return text;
}

std::string describe_numbering(const RotorMapping<double>::Verdict& verdict, std::size_t n) {
  if (verdict.roll_sign < 0.0 || verdict.pitch_sign < 0.0) {
    const char* axis = verdict.roll_sign > 0.0 ? "the pitch axis" : "the roll axis";
    return fmt::format("the vehicle moves as if {} pointed the other way than described",
                       verdict.roll_sign < 0.0 && verdict.pitch_sign < 0.0 ? "roll and pitch axis" : axis);
  }
  std::uint32_t moved = 0;
  std::string order;
  for (std::size_t i = 0; i < n; ++i) {
    if (verdict.order[i] != i) moved |= 1U << i;
    order += fmt::format("{}{}", order.empty() ? "" : ", ", verdict.order[i] + 1);
  }
  const std::string text = rotors_of(moved);
  const bool is_swap = text.find(',') == std::string::npos;
  return is_swap ? fmt::format("{} seem to be swapped in the vehicle file", text)
                 : fmt::format("the rotors seem to be numbered as {} of the vehicle file", order);
}

/// What of the vehicle file looks wrong; empty if nothing does.
std::string describe_implausible(const EffectivenessMonitor& monitor, const Multirotor& vehicle) {
  if (monitor.mapping() == Mapping::kWrongNumbers)
    return describe_numbering(monitor.numbering(), vehicle.rotor_count);
  const auto spin = monitor.wrong_spin();
  return spin ? describe_spin(*spin, monitor.slow().is_spin_named(), vehicle) : "";
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
  const std::array accel{message.accel_m_s2[0], message.accel_m_s2[1], message.accel_m_s2[2]};
  const std::array gyro{message.gyro_rad_s[0], message.gyro_rad_s[1], message.gyro_rad_s[2]};
  handle(monitor_.on_imu(time, accel, gyro, phase));
  last_imu_ = monitor_.newest_sample();
  note_source();
  check_description(time);
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
  if (event->kind != LossKind::kOverEffective) {  // what has lost thrust does not give too much any more
    LossEvent over = *event;
    over.kind = LossKind::kOverEffective;
    over.probability = 0.0;
    over.is_over = true;
    tell(over);
  }
  tell(*event);
}

void EffectivenessService::tell(const LossEvent& event) {
  const auto kind = static_cast<std::size_t>(event.kind);
  bool& is_raised = is_raised_[event.rotor][kind];
  if (event.is_over && !is_raised) return;
  rt::Fault fault;
  fault.component = rotor_name(event.rotor);
  fault.fault_kind = name_of(event.kind);
  fault.severity = event.kind == LossKind::kPropellerLost ? rt::Severity::kWarning : rt::Severity::kCaution;
  fault.latched = event.kind != LossKind::kOverEffective;
  fault.probability = event.probability;
  fault.magnitude = event.effectiveness;
  fault.magnitude_sigma = event.sigma;
  fault.magnitude_unit = "1";
  fault.onset = event.onset;
  fault.summary = summary_of(event);
  fault.evidence = evidence_of(event, monitor_);
  // A partial loss that grows is the same fault, until nothing is left.
  const Transition transition = event.is_over ? Transition::kClear
                                : is_raised   ? Transition::kUpdate
                                              : Transition::kRaise;
  reporter_.report(kLossKinds * event.rotor + kind, transition, event.decided, fault);
  is_raised = !event.is_over;
}

void EffectivenessService::check_description(TimePoint now) {
  const bool is_spin = monitor_.mapping() != Mapping::kWrongNumbers;
  const Description seen{!is_spin, monitor_.wrong_spin().value_or(0), monitor_.slow().is_spin_named()};
  if (seen == described_) return;
  described_ = seen;
  std::string wrong = describe_implausible(monitor_, config_.monitor.vehicle);
  if (wrong.empty()) return;
  rt::Fault fault;
  fault.component = "vehicle file";
  fault.fault_kind = "implausible_configuration";
  fault.severity = rt::Severity::kAdvisory;
  fault.latched = true;
  fault.onset = now;
  fault.summary = wrong;
  if (is_spin) {
    fault.evidence = {rt::evidence("log_likelihood_ratio", monitor_.slow().spin_evidence(), "nat"),
                      rt::evidence("threshold", monitor_.slow().spin_threshold(), "nat")};
  }
  reporter_.report(kDescriptionSlot, implausible_.empty() ? Transition::kRaise : Transition::kUpdate, now,
                   fault);
  implausible_ = std::move(wrong);
}

std::string EffectivenessService::muted_reason() const {
  if (last_imu_ && tick_ - *last_imu_ > kInertialTimeout) return "inertial data stale";
  if (monitor_.muted() == Muted::kRotorMapping && !implausible_.empty())
    return "vehicle file implausible: " + implausible_;
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
         rt::evidence("speed_from_commands_alone", uses_commands_alone() ? 1.0 : 0.0, "1"),
         rt::evidence("effectiveness_since_take_off", monitor_.slow().effectiveness(i), "1")}));
  }
  node_.counters()["samples_refused"] = monitor_.times_gone_back() + monitor_.samples_dropped();
  node_.counters()["samples_repeated"] = monitor_.samples_repeated();
  node_.counters()["stamps_restarted"] = monitor_.stamps_restarted();
  node_.counters()["speeds_refused"] = monitor_.speeds().refused_speeds();
  node_.counters()["messages_refused"] = monitor_.speeds().refused_messages();
  node_.counters()["unexplained_disturbances"] =
      monitor_.test().unexplained_disturbances() + monitor_.impossible_gains();
  return report;
}

}  // namespace airworthy::effectiveness
