#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gateway/health/health_config.h"
#include "gateway/health/health_counters.h"
#include "gateway/health/health_snapshot.h"
#include "gateway/health/stamp.h"

namespace airworthy::health {

/// How a message stands to what is known of its producer.
enum class Relation {
  kCurrent,     ///< of the session that speaks now
  kNewSession,  ///< the first one of a session that speaks from now on
  kLate,        ///< of an earlier session, overtaken by the restart
  kRefused      ///< of a process too many
};

/// Who runs, who is missing, who restarted.
class ProcessTable {
 public:
  ProcessTable(const HealthConfig& config, HealthCounters& counters);

  /// The first tick: from here on the start grace counts.
  void start(TimePoint as_of);

  /// To be told of every message, of any kind, before it is applied.
  [[nodiscard]] Relation note(const Origin& origin, bool foreign_clock, TimePoint as_of);

  /// `as_of` stands in for the sending time of a message whose clock is foreign.
  void apply(const ProcessSign& sign, Relation relation, bool foreign_clock, TimePoint as_of);

  /// Judges every deadline; `grace_from` is the end of the last pause of the ticks.
  void judge(TimePoint as_of, TimePoint grace_from);

  /// The ticks jumped back to `as_of`: nothing known may lie in their future.
  void rebase(TimePoint as_of);

  [[nodiscard]] bool is_current(const std::string& producer, std::int64_t session) const;

  /// Why nothing the process once said can be relied upon, else empty. A producer that never sent a life sign
  /// (somebody's own detector) is judged by its reports alone.
  [[nodiscard]] std::string absence(const std::string& producer) const;

  [[nodiscard]] bool grace_is_over(TimePoint as_of) const { return as_of > start_ + config_.start_grace; }
  [[nodiscard]] std::vector<ProcessHealth> list() const;

 private:
  struct Process {
    bool expected{};
    std::optional<std::int64_t> session;
    TimePoint newest_sent{};  ///< of any message of the session
    bool foreign_clock{};
    std::array<std::optional<std::int64_t>, 4> earlier_sessions;
    std::size_t next_earlier{};
    std::int64_t restarts{};
    std::optional<TimePoint> conflict;  ///< two sessions spoke in turn

    std::optional<Stamp> sign;  ///< newest life sign of the session
    std::optional<TimePoint> last_seen;
    ProcessState state{ProcessState::kStarting};
    std::string detail;

    ProcessStatus status{ProcessStatus::kNeverSeen};
    TimePoint since{};
    std::string judged_detail;
  };

  [[nodiscard]] Process* find_or_add(const std::string& name);
  [[nodiscard]] ProcessStatus judged(const Process& process, TimePoint as_of, TimePoint grace_from) const;
  [[nodiscard]] std::string detail_of(const Process& process, TimePoint as_of) const;

  const HealthConfig& config_;
  HealthCounters& counters_;
  TimePoint start_{};
  std::map<std::string, Process> processes_;
};

}  // namespace airworthy::health
