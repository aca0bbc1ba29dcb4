#include "gateway/message_conversion.h"

#include <algorithm>

namespace airworthy::gateway {
namespace {

using namespace health;

/// The enumerations are numbered like the fields they mirror.
template <class Enum>
std::optional<Enum> to_enum(int value, Enum first, Enum last) {
  if (value < static_cast<int>(first) || value > static_cast<int>(last)) return std::nullopt;
  return static_cast<Enum>(value);
}

Origin to_origin(const header_t& header) {
  return {header.producer, header.session, header.seq, from_us(header.time_us), from_us(header.sent_us)};
}

template <class T>
std::int32_t count_of(const std::vector<T>& items) {
  return static_cast<std::int32_t>(items.size());
}

fault_event_t to_message(const FaultReport& fault) {
  fault_event_t message{};
  message.header.time_us = to_us(fault.origin.time);
  message.header.sent_us = to_us(fault.origin.sent);
  message.header.seq = fault.origin.seq;
  message.header.producer = fault.origin.producer;
  message.header.session = fault.origin.session;
  message.number = fault.number;
  message.phase = static_cast<std::int8_t>(fault.phase);
  message.detector = fault.detector;
  message.component = fault.component;
  message.fault_kind = fault.fault_kind;
  message.severity = static_cast<std::int8_t>(fault.severity);
  message.latched = fault.latched ? 1 : 0;
  message.probability = fault.probability;
  message.magnitude = fault.magnitude;
  message.magnitude_sigma = fault.magnitude_sigma;
  message.magnitude_unit = fault.magnitude_unit;
  message.onset_us = to_us(fault.onset);
  message.detected_us = to_us(fault.detected);
  message.summary = fault.summary;
  message.candidates = fault.candidates;
  message.candidate_count = count_of(message.candidates);
  for (const Evidence& item : fault.evidence) {
    evidence_t& evidence = message.evidence.emplace_back();
    evidence.name = item.name;
    evidence.value = item.value;
    evidence.unit = item.unit;
  }
  message.evidence_count = count_of(message.evidence);
  return message;
}

component_health_t to_message(const ComponentHealth& component) {
  component_health_t message{};
  message.component = component.component;
  message.status = static_cast<std::int8_t>(component.status);
  message.since_us = to_us(component.since);
  message.reasons = component.reasons;
  message.reason_count = count_of(message.reasons);
  message.advice = component.advice;
  return message;
}

process_health_t to_message(const ProcessHealth& process) {
  process_health_t message{};
  message.process = process.process;
  message.status = static_cast<std::int8_t>(process.status);
  message.since_us = to_us(process.since);
  message.last_seen_us = process.last_seen ? to_us(*process.last_seen) : -1;
  message.session = process.session.value_or(-1);
  message.restarts = process.restarts;
  message.detail = process.detail;
  return message;
}

link_health_t to_message(const LinkHealth& link) {
  link_health_t message{};
  message.driver = link.driver;
  message.link = link.link;
  message.status = static_cast<std::int8_t>(link.status);
  message.detail = link.detail;
  return message;
}

}  // namespace

std::optional<ProcessSign> to_input(const process_status_t& message) {
  const auto state = to_enum(message.state, ProcessState::kStarting, ProcessState::kStopping);
  if (!state) return std::nullopt;
  return ProcessSign{to_origin(message.header), *state, message.detail};
}

std::optional<LinkReport> to_input(const driver_status_t& message) {
  LinkReport report{to_origin(message.header), message.link, message.connected != 0, message.detail,
                    message.seconds_since_data};
  for (const message_rate_t& rate : message.rates) report.rates.push_back({rate.name, rate.rate_Hz});
  std::sort(report.rates.begin(), report.rates.end(),
            [](const health::MessageRate& a, const health::MessageRate& b) { return a.name < b.name; });
  return report;
}

std::optional<FaultReport> to_input(const fault_event_t& message) {
  const auto phase = to_enum(message.phase, FaultPhase::kRaise, FaultPhase::kClear);
  if (!phase) return std::nullopt;
  FaultReport fault;
  fault.origin = to_origin(message.header);
  fault.number = message.number;
  fault.phase = *phase;
  fault.detector = message.detector;
  fault.component = message.component;
  fault.fault_kind = message.fault_kind;
  // A fault of an unknown severity is still a fault: too high counts as the highest, too low as the lowest.
  fault.severity = static_cast<Severity>(std::clamp<int>(
      message.severity, static_cast<int>(Severity::kAdvisory), static_cast<int>(Severity::kWarning)));
  fault.latched = message.latched != 0;
  fault.probability = message.probability;
  fault.magnitude = message.magnitude;
  fault.magnitude_sigma = message.magnitude_sigma;
  fault.magnitude_unit = message.magnitude_unit;
  fault.onset = from_us(message.onset_us);
  fault.detected = from_us(message.detected_us);
  fault.summary = message.summary;
  fault.candidates = message.candidates;
  fault.evidence.reserve(message.evidence.size());
  for (const evidence_t& item : message.evidence)
    fault.evidence.push_back({item.name, item.value, item.unit});
  return fault;
}

std::optional<DetectorReport> to_input(const detector_status_t& message) {
  const auto state = to_enum(message.state, DetectorState::kInitialising, DetectorState::kMuted);
  if (!state) return std::nullopt;
  DetectorReport report;
  report.origin = to_origin(message.header);
  report.detector = message.detector;
  report.state = *state;
  report.muted_reason = message.muted_reason;
  for (const component_assessment_t& component : message.components) {
    report.components.push_back({component.component, component.judged != 0, component.reason});
  }
  for (const fault_event_t& event : message.active) {
    if (auto fault = to_input(event)) {
      report.active.push_back(std::move(*fault));
    } else {
      report.active_is_complete = false;
    }
  }
  return report;
}

vehicle_health_t to_message(const HealthSnapshot& snapshot) {
  vehicle_health_t message{};
  message.vehicle = snapshot.vehicle;
  message.status = static_cast<std::int8_t>(snapshot.status);
  message.flight_phase = snapshot.flight_phase;
  message.root_cause = snapshot.root_cause;
  message.advice = snapshot.advice;
  for (const ComponentHealth& component : snapshot.components)
    message.components.push_back(to_message(component));
  for (const ProcessHealth& process : snapshot.processes) message.processes.push_back(to_message(process));
  for (const LinkHealth& link : snapshot.links) message.links.push_back(to_message(link));
  for (const ActiveFault& fault : snapshot.faults) message.faults.push_back(to_message(fault.report));
  message.component_count = count_of(message.components);
  message.process_count = count_of(message.processes);
  message.link_count = count_of(message.links);
  message.fault_count = count_of(message.faults);
  return message;
}

}  // namespace airworthy::gateway
