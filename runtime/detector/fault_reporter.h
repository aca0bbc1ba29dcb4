#pragma once

#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "airworthy/detector_status_t.hpp"
#include "airworthy/fault_event_t.hpp"
#include "core/detectors/detector_state.h"
#include "core/detectors/fault_life_cycle.h"
#include "runtime/process/node.h"

namespace airworthy::rt {

/// How urgent a fault is, and with that the advice the ground gives.
enum class Severity : std::int8_t { kAdvisory = 1, kCaution = 2, kWarning = 3 };

/// A fault as its detector sees it at the sample that raised, updated or cleared it.
struct Fault {
  std::string component;
  std::string fault_kind;
  Severity severity = Severity::kCaution;
  bool latched = false;
  double probability = std::numeric_limits<double>::quiet_NaN();
  double magnitude = std::numeric_limits<double>::quiet_NaN();
  double magnitude_sigma = std::numeric_limits<double>::quiet_NaN();
  std::string magnitude_unit;
  TimePoint onset;
  std::string summary;
  std::vector<std::string> candidates;
  std::vector<evidence_t> evidence;
};

/// What a detector says of itself when asked.
struct DetectorReport {
  DetectorState state = DetectorState::kInitialising;
  std::string muted_reason;  ///< empty unless muted
  std::vector<component_assessment_t> components;
};

[[nodiscard]] evidence_t evidence(std::string name, double value, std::string unit);
/// A component that is judged when `reason` is empty, and not judged for that reason else.
[[nodiscard]] component_assessment_t assessment(std::string component, std::string reason,
                                                std::vector<evidence_t> evidence);

/// The voice of a detector: FAULT_EVENT on every change, DETECTOR_STATUS twice a second and at once when a
/// fault is raised or cleared, with all active faults and the newest 32 events, so that a lost event heals.
class FaultReporter {
 public:
  static constexpr Duration kStatusPeriod{500'000};
  static constexpr std::size_t kRecentEvents = 32;

  /// `ask` is called for every DETECTOR_STATUS; the node's counters go with it.
  FaultReporter(Node& node, std::string detector, std::function<DetectorReport()> ask);
  FaultReporter(const FaultReporter&) = delete;
  FaultReporter& operator=(const FaultReporter&) = delete;

  /// Faults of different slots live beside each other. Component, kind and onset stay as they were raised;
  /// a transition of a fault that was never raised says nothing. Raised again before it was cleared, as in the next flight
  /// if it is latched, a fault is the same one and is updated.
  void report(std::size_t slot, FaultLifeCycle::Transition transition, TimePoint now, const Fault& fault);

 private:
  void publish_status();

  Node& node_;
  std::string detector_;
  std::function<DetectorReport()> ask_;
  Publisher<fault_event_t> events_;
  Publisher<detector_status_t> status_;
  std::map<std::size_t, fault_event_t> active_;
  std::deque<fault_event_t> recent_;
  std::int64_t next_number_ = 1;
};

}  // namespace airworthy::rt
