#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "gateway/health/process_table.h"

namespace airworthy::health {

/// What each detector last said it can judge.
class DetectorTable {
 public:
  struct Detector {
    std::int64_t session{};
    Stamp stamp{};
    TimePoint heard{};
    DetectorReport report;
    std::string silence;  ///< why none of its components is judged at present, else empty
  };
  using Key = std::pair<std::string, std::string>;  ///< producer and detector

  DetectorTable(const HealthConfig& config, HealthCounters& counters)
      : config_{config}, counters_{counters} {}

  /// False if the report is stale or has no room: then it says nothing about faults either.
  bool apply(const DetectorReport& report, Relation relation, bool foreign_clock, TimePoint as_of);
  void judge(TimePoint as_of, TimePoint grace_from, const ProcessTable& processes);
  void rebase(TimePoint as_of);

  [[nodiscard]] const std::map<Key, Detector>& all() const { return detectors_; }
  [[nodiscard]] const Detector* find(const std::string& producer, const std::string& detector) const;

 private:
  const HealthConfig& config_;
  HealthCounters& counters_;
  std::map<Key, Detector> detectors_;
};

}  // namespace airworthy::health
