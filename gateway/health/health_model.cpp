#include "gateway/health/health_model.h"

#include <algorithm>
#include <utility>

#include "gateway/health/input_limits.h"

namespace airworthy::health {
namespace {

/// All that is worth telling at once when it changes; times, magnitudes and texts that follow them are not.
class Signature {
 public:
  void add(const std::string& text) {
    text_ += text;
    text_ += '\n';
  }
  void add(std::int64_t number) { add(std::to_string(number)); }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

std::string signature_of(const HealthSnapshot& snapshot) {
  Signature signature;
  signature.add(static_cast<int>(snapshot.status));
  signature.add(snapshot.root_cause);
  signature.add(snapshot.advice);
  for (const ComponentHealth& component : snapshot.components) {
    signature.add(component.component);
    signature.add(static_cast<int>(component.status));
    signature.add(component.advice);
    if (component.status != Status::kUnknown) continue;
    for (const std::string& reason : component.reasons) signature.add(reason);
  }
  for (const ProcessHealth& process : snapshot.processes) {
    signature.add(process.process);
    signature.add(static_cast<int>(process.status));
    signature.add(process.session.value_or(-1));
    signature.add(process.detail);
  }
  for (const LinkHealth& link : snapshot.links) {
    signature.add(link.driver);
    signature.add(link.link);
    signature.add(static_cast<int>(link.status));
    signature.add(link.detail);
  }
  for (const ActiveFault& fault : snapshot.faults) {
    signature.add(fault.report.origin.producer);
    signature.add(fault.report.origin.session);
    signature.add(fault.report.number);
    signature.add(static_cast<int>(fault.report.severity));
    signature.add(fault.report.component);
    signature.add(fault.unconfirmed);
  }
  return signature.take();
}

Status worst_of(const HealthSnapshot& snapshot, RootCause::Kind cause) {
  const auto any = [&](Status status) {
    return std::any_of(snapshot.components.begin(), snapshot.components.end(),
                       [&](const ComponentHealth& component) { return component.status == status; });
  };
  if (any(Status::kFailed)) return Status::kFailed;
  const bool monitoring_impaired = cause == RootCause::Kind::kLoss || cause == RootCause::Kind::kImpairment;
  if (any(Status::kDegraded) || monitoring_impaired) return Status::kDegraded;
  if (any(Status::kUnknown) || cause == RootCause::Kind::kAbsence) return Status::kUnknown;
  return any(Status::kOk) ? Status::kOk : Status::kUnknown;
}

std::string advice_for(const HealthSnapshot& snapshot, const RootCause& cause) {
  if (!snapshot.faults.empty()) return advice_for(snapshot.faults.front().report.severity);
  switch (cause.kind) {
    case RootCause::Kind::kLoss:
    case RootCause::Kind::kAbsence:
      return "Health is not fully monitored: check " + cause.name + ".";
    case RootCause::Kind::kImpairment:
      return "Check " + cause.name + " after landing.";
    case RootCause::Kind::kNone:
    case RootCause::Kind::kFault:
      break;
  }
  return {};
}

}  // namespace

HealthModel::HealthModel(HealthConfig config)
    : config_{std::move(config)},
      queue_{config_},
      processes_{config_, counters_},
      links_{config_, counters_},
      detectors_{config_, counters_},
      faults_{config_, counters_},
      components_{config_, counters_} {}

void HealthModel::add(Input input) {
  ++counters_.messages;
  bound_input(input, config_.limits, counters_);
  queue_.push(std::move(input), counters_);
}

std::optional<HealthSnapshot> HealthModel::tick(TimePoint time) {
  ++counters_.ticks;
  const TimePoint tick = clamp_time(time);
  if (!last_tick_) {
    last_tick_ = tick;
    processes_.start(tick);
    return std::nullopt;
  }
  const TimePoint as_of = *last_tick_;
  if (tick < as_of - config_.foreign_clock) {
    start_over(tick);
    return std::nullopt;
  }
  if (tick <= as_of) {
    ++counters_.ticks_out_of_order;
    return std::nullopt;
  }
  for (const InputQueue::Released& released : queue_.take(as_of, tick, counters_)) apply(released, as_of);
  HealthSnapshot snapshot = evaluate(as_of);

  // Whoever was silent while we slept may have slept as well. Ticks that are always slow are no pause,
  // though.
  const bool gap = tick - as_of > config_.tick_gap;
  if (gap) ++counters_.tick_gaps;
  if (gap && !after_gap_) grace_from_ = tick;
  after_gap_ = gap;
  last_tick_ = tick;
  return snapshot;
}

void HealthModel::start_over(TimePoint tick) {
  ++counters_.tick_jumps_back;
  for (const InputQueue::Released& released : queue_.take_all(counters_)) apply(released, tick);
  processes_.rebase(tick);
  links_.rebase(tick);
  detectors_.rebase(tick);
  components_.rebase(tick);
  grace_from_ = tick;
  after_gap_ = false;
  last_tick_ = tick;
}

void HealthModel::apply(const InputQueue::Released& released, TimePoint as_of) {
  const bool foreign = released.foreign_clock;
  const Relation relation = processes_.note(origin_of(released.input), foreign, as_of);
  if (const auto* sign = std::get_if<ProcessSign>(&released.input)) {
    processes_.apply(*sign, relation, foreign, as_of);
  } else if (const auto* link = std::get_if<LinkReport>(&released.input)) {
    links_.apply(*link, relation, foreign, as_of);
  } else if (const auto* event = std::get_if<FaultReport>(&released.input)) {
    faults_.apply(*event, relation, foreign, as_of, detectors_);
  } else if (const auto* report = std::get_if<DetectorReport>(&released.input)) {
    if (detectors_.apply(*report, relation, foreign, as_of)) faults_.apply(*report, foreign, as_of);
  }
}

HealthSnapshot HealthModel::evaluate(TimePoint as_of) {
  processes_.judge(as_of, grace_from_);
  links_.judge(as_of, grace_from_, processes_);
  detectors_.judge(as_of, grace_from_, processes_);

  HealthSnapshot snapshot;
  snapshot.time = as_of;
  snapshot.vehicle = config_.vehicle;
  snapshot.faults = faults_.list(processes_, detectors_);
  snapshot.components = components_.judge(as_of, snapshot.faults, detectors_);
  snapshot.processes = processes_.list();
  snapshot.links = links_.list();
  const RootCause cause = find_root_cause(config_, snapshot, processes_.grace_is_over(as_of));
  snapshot.root_cause = cause.name;
  snapshot.status = worst_of(snapshot, cause.kind);
  snapshot.advice = advice_for(snapshot, cause);

  std::string signature = signature_of(snapshot);
  snapshot.changed = signature != last_signature_;
  last_signature_ = std::move(signature);
  return snapshot;
}

}  // namespace airworthy::health
