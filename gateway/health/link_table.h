#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gateway/health/process_table.h"

namespace airworthy::health {

/// The links to the devices, as their drivers report them.
class LinkTable {
 public:
  LinkTable(const HealthConfig& config, HealthCounters& counters) : config_{config}, counters_{counters} {}

  void apply(const LinkReport& report, Relation relation, bool foreign_clock, TimePoint as_of);
  void judge(TimePoint as_of, TimePoint grace_from, const ProcessTable& processes);
  void rebase(TimePoint as_of);
  [[nodiscard]] std::vector<LinkHealth> list() const;

 private:
  struct Link {
    std::int64_t session{};
    Stamp stamp{};
    TimePoint heard{};
    TimePoint connected_since{};
    bool connected{};
    std::string detail;
    double seconds_since_data{};
    std::vector<MessageRate> rates;

    LinkStatus status{LinkStatus::kUnknown};
    TimePoint since{};
    std::string judged_detail;
  };

  void judge_one(const std::string& driver, Link& link, TimePoint as_of, TimePoint grace_from,
                 const ProcessTable& processes) const;

  const HealthConfig& config_;
  HealthCounters& counters_;
  std::map<std::pair<std::string, std::string>, Link> links_;  ///< by driver and link
};

}  // namespace airworthy::health
