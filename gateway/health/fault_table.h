#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "gateway/health/detector_table.h"
#include "gateway/health/health_snapshot.h"
#include "gateway/health/process_table.h"

namespace airworthy::health {

/// The active faults. Events are edges and may be lost, repeated or overtaken; a detector's status is the
/// level and heals them. The newest word of a session about one of its faults wins, whichever of the two it
/// was.
class FaultTable {
 public:
  FaultTable(const HealthConfig& config, HealthCounters& counters) : config_{config}, counters_{counters} {}

  void apply(const FaultReport& event, Relation relation, bool foreign_clock, TimePoint as_of,
             const DetectorTable& detectors);

  /// Only reports that the detector table accepted.
  void apply(const DetectorReport& report, bool foreign_clock, TimePoint as_of);

  /// Worst first, then earliest onset.
  [[nodiscard]] std::vector<ActiveFault> list(const ProcessTable& processes,
                                              const DetectorTable& detectors) const;

  [[nodiscard]] std::size_t active_count() const { return active_.size(); }
  [[nodiscard]] std::size_t cleared_count() const { return cleared_.size(); }

 private:
  using Key = std::tuple<std::string, std::int64_t, std::int64_t>;  ///< producer, session, number
  struct Fault {
    FaultReport report;
    TimePoint word{};          ///< sending time of the newest word about it, event or status
    std::int64_t event_seq{};  ///< of the newest event
  };

  /// The session's detector has spoken since, and did not list the fault: the event comes too late to raise
  /// it.
  [[nodiscard]] static bool is_overtaken(const FaultReport& event, const DetectorTable& detectors);
  static void update(Fault& fault, const FaultReport& report, TimePoint word);
  void raise(const Key& key, const FaultReport& report, TimePoint word, bool foreign_clock, TimePoint as_of);
  void clear(std::map<Key, Fault>::iterator fault, TimePoint word);
  void remember_cleared(const Key& key, TimePoint word);
  [[nodiscard]] bool make_room_for(const FaultReport& report);
  void clear_absent(const DetectorReport& report);
  void settle_earlier_sessions(const DetectorReport& report);

  const HealthConfig& config_;
  HealthCounters& counters_;
  std::map<Key, Fault> active_;
  std::map<Key, TimePoint> cleared_;  ///< with the sending time of the word that cleared it
  std::deque<Key> cleared_order_;     ///< oldest first
};

}  // namespace airworthy::health
