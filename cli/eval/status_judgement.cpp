#include "cli/eval/status_judgement.h"

#include <fmt/format.h>

#include <algorithm>

namespace airworthy::eval {
namespace {

const std::string kUntold = "the detector does not say why";

std::string reason_of(const component_assessment_t& assessment) {
  if (assessment.judged != 0) return "";
  return assessment.reason.empty() ? kUntold : assessment.reason;
}

// Of the first that is not judged, unless the detector mutes all of them.
std::string reason_of(const detector_status_t& status) {
  const auto& all = status.components;
  if (std::any_of(all.begin(), all.end(), [](const auto& one) { return one.judged != 0; })) return "";
  if (!status.muted_reason.empty()) return status.muted_reason;
  return all.empty() ? kUntold : reason_of(all.front());
}

}  // namespace

void StatusJudgement::Stream::note(TimePoint from, TimePoint until, const std::string& why_muted_now) {
  // The newer reason says more than "no data yet"; where it is judged now, the older one held until then.
  log.note(from, until, why_muted_now.empty() ? why_muted.value_or("") : why_muted_now);
}

void StatusJudgement::on_status(const detector_status_t& status) {
  const TimePoint now = from_us(status.header.time_us);
  std::map<std::string, std::string> why_muted;  // two channels may be of one component: one is enough
  for (const component_assessment_t& one : status.components) {
    const auto [entry, is_new] = why_muted.try_emplace(one.component, reason_of(one));
    if (!is_new && one.judged != 0) entry->second.clear();
  }
  const std::string whole = reason_of(status);
  if (newest_ && now > *newest_) {
    whole_.note(*newest_, now, whole);
    for (const auto& [component, why] : why_muted) components_[component].note(*newest_, now, why);
  }
  newest_ = std::max(newest_.value_or(now), now);
  whole_.why_muted = whole;
  for (const auto& [component, why] : why_muted) components_[component].why_muted = why;
  misfits_.clear();
  for (const counter_t& counter : status.counters) {
    if (!counter.name.ends_with(".wrong_rotor_count") || counter.value == 0) continue;
    misfits_ += fmt::format("{}{} {}", misfits_.empty() ? "" : ", ", counter.name, counter.value);
  }
}

std::map<std::string, JudgementLog> StatusJudgement::components() const {
  std::map<std::string, JudgementLog> logs;
  for (const auto& [component, stream] : components_) logs.emplace(component, stream.log);
  return logs;
}

}  // namespace airworthy::eval
