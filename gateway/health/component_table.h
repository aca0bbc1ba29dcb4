#pragma once

#include <map>
#include <string>
#include <vector>

#include "gateway/health/detector_table.h"
#include "gateway/health/health_snapshot.h"

namespace airworthy::health {

/// What an operator should do about a fault of this severity.
[[nodiscard]] std::string advice_for(Severity severity);

/// Judges every component that a detector or a fault names: a fault decides; without one, somebody must be
/// looking for the component to be OK; otherwise it is UNKNOWN, with the reason.
class ComponentTable {
 public:
  ComponentTable(const HealthConfig& config, HealthCounters& counters)
      : config_{config}, counters_{counters} {}

  [[nodiscard]] std::vector<ComponentHealth> judge(TimePoint as_of, const std::vector<ActiveFault>& faults,
                                                   const DetectorTable& detectors);
  void rebase(TimePoint as_of);

 private:
  struct Verdict {
    Status status{Status::kUnknown};
    bool judged{};     ///< somebody looks
    bool suspected{};  ///< candidate of a fault that the data cannot place
    Severity severity{Severity::kAdvisory};
    TimePoint failed_since{};
    std::vector<std::string> reasons;
    std::vector<std::string> unknown_reasons;
  };
  struct Known {
    Status status{};
    TimePoint since{};
  };

  void add_faults(std::map<std::string, Verdict>& verdicts, const std::vector<ActiveFault>& faults);
  void add_detectors(std::map<std::string, Verdict>& verdicts, const DetectorTable& detectors);
  [[nodiscard]] Verdict* find_or_add(std::map<std::string, Verdict>& verdicts, const std::string& component);
  void add_reason(std::vector<std::string>& reasons, std::string reason) const;

  const HealthConfig& config_;
  HealthCounters& counters_;
  std::map<std::string, Known> known_;  ///< since when each component has the status it has
};

}  // namespace airworthy::health
