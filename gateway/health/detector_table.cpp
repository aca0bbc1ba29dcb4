#include "gateway/health/detector_table.h"

#include <algorithm>

namespace airworthy::health {

bool DetectorTable::apply(const DetectorReport& report, Relation relation, bool foreign_clock,
                          TimePoint as_of) {
  if (relation == Relation::kRefused) return false;
  if (relation == Relation::kLate) {
    ++counters_.stale_messages;
    return false;
  }
  const Key key{report.origin.producer, report.detector};
  const Stamp stamp = stamp_of(report.origin);
  auto found = detectors_.find(key);
  if (found == detectors_.end()) {
    if (detectors_.size() >= config_.limits.detectors) {
      ++counters_.refused_table_full;
      return false;
    }
    found = detectors_.emplace(key, Detector{}).first;
  } else if (found->second.session == report.origin.session && !(found->second.stamp < stamp)) {
    ++counters_.stale_messages;
    return false;
  }
  Detector& detector = found->second;
  detector.session = report.origin.session;
  detector.stamp = stamp;
  detector.heard = foreign_clock ? as_of : report.origin.sent;
  detector.report = report;
  detector.report.active.clear();  // the fault table keeps those
  return true;
}

void DetectorTable::judge(TimePoint as_of, TimePoint grace_from, const ProcessTable& processes) {
  for (auto it = detectors_.begin(); it != detectors_.end();) {
    const auto& [producer, name] = it->first;
    Detector& detector = it->second;
    const bool current = processes.is_current(producer, detector.session);
    const Duration age = as_of - std::max(detector.heard, grace_from);
    detector.silence = processes.absence(producer);
    if (detector.silence.empty() && !current) {
      // The restarted process has had time to report: this detector is no longer part of it.
      if (age > 2 * config_.detector_deadline) {
        it = detectors_.erase(it);
        continue;
      }
      detector.silence = producer + " restarted and has not judged it yet";
    } else if (detector.silence.empty() && age > config_.detector_deadline) {
      detector.silence = name + " does not report any more";
    } else if (detector.silence.empty()) {
      switch (detector.report.state) {
        case DetectorState::kInitialising:
          detector.silence = name + " is initialising";
          break;
        case DetectorState::kConverging:
          detector.silence = name + " is converging";
          break;
        case DetectorState::kMuted:
          detector.silence = name + " is muted: " + detector.report.muted_reason;
          break;
        case DetectorState::kMonitoring:
          break;
      }
    }
    ++it;
  }
}

void DetectorTable::rebase(TimePoint as_of) {
  for (auto& [key, detector] : detectors_) detector.heard = std::min(detector.heard, as_of);
}

const DetectorTable::Detector* DetectorTable::find(const std::string& producer,
                                                   const std::string& detector) const {
  const auto found = detectors_.find({producer, detector});
  return found == detectors_.end() ? nullptr : &found->second;
}

}  // namespace airworthy::health
