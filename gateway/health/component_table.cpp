#include "gateway/health/component_table.h"

#include <algorithm>
#include <utility>

namespace airworthy::health {
namespace {

std::string reason_of(const ActiveFault& fault) {
  const FaultReport& report = fault.report;
  std::string reason = report.detector + ": " + (report.summary.empty() ? report.fault_kind : report.summary);
  if (!fault.unconfirmed.empty()) reason += " (unconfirmed: " + fault.unconfirmed + ")";
  return reason;
}

}  // namespace

std::string advice_for(Severity severity) {
  switch (severity) {
    case Severity::kAdvisory:
      return "Check after landing.";
    case Severity::kCaution:
      return "Return.";
    case Severity::kWarning:
      return "Land now.";
  }
  return {};
}

ComponentTable::Verdict* ComponentTable::find_or_add(std::map<std::string, Verdict>& verdicts,
                                                     const std::string& component) {
  if (const auto found = verdicts.find(component); found != verdicts.end()) return &found->second;
  if (verdicts.size() >= config_.limits.components) {
    ++counters_.refused_table_full;
    return nullptr;
  }
  return &verdicts[component];
}

void ComponentTable::add_reason(std::vector<std::string>& reasons, std::string reason) const {
  if (reason.empty() || reasons.size() >= config_.limits.reasons_per_component) return;
  if (std::find(reasons.begin(), reasons.end(), reason) == reasons.end())
    reasons.push_back(std::move(reason));
}

void ComponentTable::add_faults(std::map<std::string, Verdict>& verdicts,
                                const std::vector<ActiveFault>& faults) {
  for (const ActiveFault& fault : faults) {  // worst first, so the first one of a component decides
    const FaultReport& report = fault.report;
    Verdict* verdict = find_or_add(verdicts, report.component);
    if (verdict == nullptr) continue;
    const bool first = verdict->reasons.empty();
    if (first) verdict->severity = report.severity;
    if (first || (report.severity == verdict->severity && report.detected < verdict->failed_since)) {
      verdict->failed_since = report.detected;
    }
    verdict->status = verdict->severity == Severity::kWarning ? Status::kFailed : Status::kDegraded;
    add_reason(verdict->reasons, reason_of(fault));
  }
  for (const ActiveFault& fault : faults) {
    for (const std::string& candidate : fault.report.candidates) {
      if (candidate == fault.report.component) continue;
      Verdict* verdict = find_or_add(verdicts, candidate);
      if (verdict == nullptr) continue;
      verdict->suspected = true;
      add_reason(verdict->unknown_reasons, "may be what " + fault.report.detector + " found on " +
                                               fault.report.component + ": the data cannot tell them apart");
    }
  }
}

void ComponentTable::add_detectors(std::map<std::string, Verdict>& verdicts, const DetectorTable& detectors) {
  for (const auto& [key, detector] : detectors.all()) {
    for (const Assessment& assessment : detector.report.components) {
      Verdict* verdict = find_or_add(verdicts, assessment.component);
      if (verdict == nullptr) continue;
      if (!detector.silence.empty()) {
        add_reason(verdict->unknown_reasons, detector.silence);
      } else if (assessment.judged) {
        verdict->judged = true;
      } else {
        const bool silent = assessment.reason.empty();
        add_reason(verdict->unknown_reasons,
                   key.second + (silent ? " does not judge it" : ": " + assessment.reason));
      }
    }
  }
}

std::vector<ComponentHealth> ComponentTable::judge(TimePoint as_of, const std::vector<ActiveFault>& faults,
                                                   const DetectorTable& detectors) {
  std::map<std::string, Verdict> verdicts;
  add_faults(verdicts, faults);
  add_detectors(verdicts, detectors);

  std::vector<ComponentHealth> list;
  std::map<std::string, Known> known;
  for (auto& [component, verdict] : verdicts) {
    const bool faulty = verdict.status != Status::kUnknown;
    if (!faulty && verdict.judged && !verdict.suspected) verdict.status = Status::kOk;
    const auto before = known_.find(component);
    Known now{verdict.status, faulty ? verdict.failed_since : as_of};
    if (before != known_.end()) {
      const bool was_faulty =
          before->second.status == Status::kDegraded || before->second.status == Status::kFailed;
      if (was_faulty) now.since = as_of;  // a fault that grew: what it is now began now
      if (before->second.status == now.status) now.since = before->second.since;
    }
    known[component] = now;

    ComponentHealth health{component, verdict.status, now.since, {}, {}};
    if (faulty) {
      health.reasons = std::move(verdict.reasons);
      health.advice = advice_for(verdict.severity);
    } else if (verdict.status == Status::kUnknown) {
      health.reasons = std::move(verdict.unknown_reasons);
    }
    list.push_back(std::move(health));
  }
  known_ = std::move(known);
  return list;
}

void ComponentTable::rebase(TimePoint as_of) {
  for (auto& [component, known] : known_) known.since = std::min(known.since, as_of);
}

}  // namespace airworthy::health
