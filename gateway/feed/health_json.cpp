#include "gateway/feed/health_json.h"

#include <cmath>

#include "gateway/health/component_table.h"

namespace airworthy::gateway {
namespace {

using nlohmann::json;

/// Unknown is null.
json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json to_json(const health::ComponentHealth& component, const FeedTime& time) {
  json object{{"component", component.component},
              {"status", to_word(component.status)},
              {"reasons", component.reasons},
              {"advice", component.advice}};
  time.write(object, "since", component.since);
  return object;
}

json to_json(const health::ProcessHealth& process, const FeedTime& time) {
  json object{{"process", process.process},        {"expected", process.expected},
              {"status", to_word(process.status)}, {"restarts", process.restarts},
              {"detail", process.detail},          {"session", nullptr},
              {"last_seen_us", nullptr},           {"last_seen_utc", nullptr}};
  time.write(object, "since", process.since);
  if (process.last_seen) time.write(object, "last_seen", *process.last_seen);
  if (process.session) object["session"] = *process.session;
  return object;
}

json to_json(const health::LinkHealth& link, const FeedTime& time) {
  json object{{"driver", link.driver},
              {"link", link.link},
              {"status", to_word(link.status)},
              {"detail", link.detail}};
  json rates = json::array();
  for (const health::MessageRate& rate : link.rates) {
    rates.push_back({{"name", rate.name}, {"rate_Hz", number(rate.rate_Hz)}});
  }
  object["rates"] = std::move(rates);
  time.write(object, "since", link.since);
  return object;
}

template <class Item>
json list(const std::vector<Item>& items, const FeedTime& time) {
  json array = json::array();
  for (const Item& item : items) array.push_back(to_json(item, time));
  return array;
}

}  // namespace

const char* to_word(health::Status status) {
  switch (status) {
    case health::Status::kUnknown:
      return "unknown";
    case health::Status::kOk:
      return "ok";
    case health::Status::kDegraded:
      return "degraded";
    case health::Status::kFailed:
      return "failed";
  }
  return "unknown";
}

const char* to_word(health::ProcessStatus status) {
  switch (status) {
    case health::ProcessStatus::kNeverSeen:
      return "never_seen";
    case health::ProcessStatus::kRunning:
      return "running";
    case health::ProcessStatus::kDegraded:
      return "degraded";
    case health::ProcessStatus::kMissing:
      return "missing";
    case health::ProcessStatus::kStopped:
      return "stopped";
  }
  return "never_seen";
}

const char* to_word(health::LinkStatus status) {
  switch (status) {
    case health::LinkStatus::kUnknown:
      return "unknown";
    case health::LinkStatus::kOk:
      return "ok";
    case health::LinkStatus::kSilent:
      return "silent";
    case health::LinkStatus::kDown:
      return "down";
  }
  return "unknown";
}

const char* to_word(health::FaultPhase phase) {
  switch (phase) {
    case health::FaultPhase::kRaise:
      return "raise";
    case health::FaultPhase::kUpdate:
      return "update";
    case health::FaultPhase::kClear:
      return "clear";
  }
  return "raise";
}

const char* to_word(health::Severity severity) {
  switch (severity) {
    case health::Severity::kAdvisory:
      return "advisory";
    case health::Severity::kCaution:
      return "caution";
    case health::Severity::kWarning:
      return "warning";
  }
  return "warning";
}

json to_json(const health::FaultReport& fault, const FeedTime& time) {
  json evidence = json::array();
  for (const health::Evidence& item : fault.evidence) {
    evidence.push_back({{"name", item.name}, {"value", number(item.value)}, {"unit", item.unit}});
  }
  json object{{"producer", fault.origin.producer},
              {"session", fault.origin.session},
              {"number", fault.number},
              {"seq", fault.origin.seq},
              {"phase", to_word(fault.phase)},
              {"detector", fault.detector},
              {"component", fault.component},
              {"fault_kind", fault.fault_kind},
              {"severity", to_word(fault.severity)},
              {"latched", fault.latched},
              {"probability", number(fault.probability)},
              {"magnitude", number(fault.magnitude)},
              {"magnitude_sigma", number(fault.magnitude_sigma)},
              {"magnitude_unit", fault.magnitude_unit},
              {"summary", fault.summary},
              {"advice", health::advice_for(fault.severity)},
              {"candidates", fault.candidates},
              {"evidence", std::move(evidence)}};
  time.write(object, "onset", fault.onset);
  time.write(object, "detected", fault.detected);
  time.write(object, "decided", fault.origin.time);
  return object;
}

json to_json(const health::HealthSnapshot& snapshot, const FeedTime& time) {
  json faults = json::array();
  for (const health::ActiveFault& fault : snapshot.faults) {
    faults.push_back(to_json(fault.report, time));
    faults.back()["unconfirmed"] = fault.unconfirmed;
  }
  json object{{"status", to_word(snapshot.status)},
              {"flight_phase", snapshot.flight_phase},
              {"root_cause", snapshot.root_cause},
              {"advice", snapshot.advice},
              {"components", list(snapshot.components, time)},
              {"processes", list(snapshot.processes, time)},
              {"links", list(snapshot.links, time)},
              {"faults", std::move(faults)}};
  time.write(object, "time", snapshot.time);
  return object;
}

}  // namespace airworthy::gateway
