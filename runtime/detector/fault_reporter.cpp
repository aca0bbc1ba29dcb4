#include "runtime/detector/fault_reporter.h"

#include "runtime/bus/channels.h"

namespace airworthy::rt {
namespace {

using Transition = FaultLifeCycle::Transition;

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

fault_event_t raised(std::int64_t number, const std::string& detector, TimePoint now, const Fault& fault) {
  fault_event_t event{};
  event.number = number;
  event.detector = detector;
  event.component = fault.component;
  event.fault_kind = fault.fault_kind;
  event.onset_us = to_us(fault.onset);
  event.detected_us = to_us(now);
  return event;
}

void update(fault_event_t& event, const Fault& fault) {
  event.severity = static_cast<std::int8_t>(fault.severity);
  event.latched = fault.latched ? 1 : 0;
  event.probability = fault.probability;
  event.magnitude = fault.magnitude;
  event.magnitude_sigma = fault.magnitude_sigma;
  event.magnitude_unit = fault.magnitude_unit;
  event.candidates = fault.candidates;
  event.candidate_count = static_cast<std::int32_t>(event.candidates.size());
  event.evidence = fault.evidence;
  event.evidence_count = static_cast<std::int32_t>(event.evidence.size());
}

}  // namespace

evidence_t evidence(std::string name, double value, std::string unit) {
  evidence_t item;
  item.name = std::move(name);
  item.value = value;
  item.unit = std::move(unit);
  return item;
}

component_assessment_t assessment(std::string component, std::string reason,
                                  std::vector<evidence_t> evidence) {
  component_assessment_t result;
  result.component = std::move(component);
  result.judged = reason.empty() ? 1 : 0;
  result.reason = std::move(reason);
  result.evidence = std::move(evidence);
  result.evidence_count = static_cast<std::int32_t>(result.evidence.size());
  return result;
}

FaultReporter::FaultReporter(Node& node, std::string detector, std::function<DetectorReport()> ask)
    : node_{node},
      detector_{std::move(detector)},
      ask_{std::move(ask)},
      events_{node.advertise(channel::kFaultEvent)},
      status_{node.advertise(channel::kDetectorStatus)} {
  node_.every(kStatusPeriod, [this](TimePoint) { publish_status(); });
}

void FaultReporter::report(std::size_t slot, Transition transition, TimePoint now, const Fault& fault) {
  if (transition == Transition::kNone) return;
  if (transition == Transition::kRaise && active_.count(slot) > 0) transition = Transition::kUpdate;
  if (transition == Transition::kRaise) active_[slot] = raised(next_number_++, detector_, now, fault);
  const auto found = active_.find(slot);
  if (found == active_.end()) return;
  fault_event_t& event = found->second;
  event.phase = phase_of(transition);
  update(event, fault);
  // A cleared fault keeps the words of what it was.
  if (transition != Transition::kClear) event.summary = fault.summary;
  events_.publish(event, now);
  recent_.push_back(event);
  if (recent_.size() > kRecentEvents) recent_.pop_front();
  if (transition == Transition::kUpdate) return;
  node_.log().info(transition == Transition::kRaise ? "fault_raised" : "fault_cleared",
                   {{"component", event.component},
                    {"fault_kind", event.fault_kind},
                    {"number", event.number},
                    {"time_us", to_us(now)},
                    {"onset_us", event.onset_us}});
  if (transition == Transition::kClear) active_.erase(found);
  publish_status();
}

void FaultReporter::publish_status() {
  DetectorReport report = ask_();
  detector_status_t status;
  status.detector = detector_;
  status.state = static_cast<std::int8_t>(report.state);
  status.muted_reason = report.muted_reason;
  status.components = std::move(report.components);
  status.component_count = static_cast<std::int32_t>(status.components.size());
  for (const auto& [slot, event] : active_) status.active.push_back(event);
  status.active_count = static_cast<std::int32_t>(status.active.size());
  status.recent.assign(recent_.begin(), recent_.end());
  status.recent_count = static_cast<std::int32_t>(status.recent.size());
  status.counters = node_.counters().to_messages();
  status.counter_count = static_cast<std::int32_t>(status.counters.size());
  status_.publish(status, node_.clock().now());
}

}  // namespace airworthy::rt
