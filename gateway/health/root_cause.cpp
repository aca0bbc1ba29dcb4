#include "gateway/health/root_cause.h"

#include <algorithm>
#include <optional>

namespace airworthy::health {
namespace {

struct Loss {
  std::string process;  ///< whose data no longer come
  std::string name;
  TimePoint since{};
};

std::vector<Loss> losses_in(const HealthSnapshot& snapshot) {
  std::vector<Loss> losses;
  for (const LinkHealth& link : snapshot.links) {
    if (link.status == LinkStatus::kDown || link.status == LinkStatus::kSilent) {
      losses.push_back({link.driver, "link " + link.link, link.since});
    }
  }
  for (const ProcessHealth& process : snapshot.processes) {
    if (process.status == ProcessStatus::kMissing) {
      losses.push_back({process.process, "process " + process.process, process.since});
    }
  }
  std::stable_sort(losses.begin(), losses.end(),
                   [](const Loss& a, const Loss& b) { return a.since < b.since; });
  return losses;
}

bool explains(const HealthConfig& config, const Loss& loss, const FaultReport& fault) {
  if (fault.onset < loss.since || fault.onset > loss.since + config.implied_window) return false;
  const auto fed = config.feeds.find(loss.process);
  if (fed == config.feeds.end()) return true;
  return std::find(fed->second.begin(), fed->second.end(), fault.origin.producer) != fed->second.end();
}

std::optional<RootCause> process_with(const HealthSnapshot& snapshot, ProcessStatus status,
                                      RootCause::Kind kind) {
  for (const ProcessHealth& process : snapshot.processes) {
    const bool counts = process.expected || status == ProcessStatus::kDegraded;
    if (counts && process.status == status) return RootCause{kind, "process " + process.process};
  }
  return std::nullopt;
}

}  // namespace

RootCause find_root_cause(const HealthConfig& config, const HealthSnapshot& snapshot,
                          bool start_grace_is_over) {
  using Kind = RootCause::Kind;
  const std::vector<Loss> losses = losses_in(snapshot);
  const auto cause =
      std::find_if(snapshot.faults.begin(), snapshot.faults.end(), [&](const ActiveFault& fault) {
        return std::none_of(losses.begin(), losses.end(),
                            [&](const Loss& loss) { return explains(config, loss, fault.report); });
      });
  const bool has_cause = cause != snapshot.faults.end();
  if (has_cause && (losses.empty() || cause->report.severity >= Severity::kCaution)) {
    return {Kind::kFault, cause->report.component};
  }
  if (!losses.empty()) return {Kind::kLoss, losses.front().name};
  if (start_grace_is_over) {
    if (auto never = process_with(snapshot, ProcessStatus::kNeverSeen, Kind::kAbsence)) return *never;
  }
  if (auto stopped = process_with(snapshot, ProcessStatus::kStopped, Kind::kAbsence)) return *stopped;
  if (auto degraded = process_with(snapshot, ProcessStatus::kDegraded, Kind::kImpairment)) return *degraded;
  return {};
}

}  // namespace airworthy::health
