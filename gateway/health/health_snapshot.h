#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gateway/health/health_input.h"

namespace airworthy::health {

enum class Status { kUnknown, kOk, kDegraded, kFailed };

struct ComponentHealth {
  std::string component;
  Status status{Status::kUnknown};
  TimePoint since{};  ///< start of this status
  std::vector<std::string> reasons;
  std::string advice;  ///< empty when ok
};

enum class ProcessStatus { kNeverSeen, kRunning, kDegraded, kMissing, kStopped };

struct ProcessHealth {
  std::string process;
  bool expected{};
  ProcessStatus status{ProcessStatus::kNeverSeen};
  TimePoint since{};
  std::optional<TimePoint> last_seen;
  std::optional<std::int64_t> session;
  std::int64_t restarts{};
  std::string detail;
};

enum class LinkStatus { kUnknown, kOk, kSilent, kDown };

struct LinkHealth {
  std::string driver;
  std::string link;
  LinkStatus status{LinkStatus::kUnknown};
  TimePoint since{};  ///< of a silent link: its last data
  std::string detail;
  std::vector<MessageRate> rates;  ///< by name; of the last report
};

struct ActiveFault {
  FaultReport report;
  std::string unconfirmed;  ///< why nobody vouches for it at present, else empty
};

/// The health of the vehicle as of one tick. Deterministic: equal inputs give equal snapshots, in content and
/// order.
struct HealthSnapshot {
  TimePoint time{};
  std::string vehicle;
  Status status{Status::kUnknown};
  std::string flight_phase{"unknown"};  ///< as name_of(Phase) has it
  std::string root_cause;               ///< component, process or link that explains the rest; empty when ok
  std::string advice;
  std::vector<ComponentHealth> components;  ///< by name
  std::vector<ProcessHealth> processes;     ///< by name
  std::vector<LinkHealth> links;            ///< by driver, then link
  std::vector<ActiveFault> faults;          ///< worst first, then earliest onset
  bool changed{};  ///< a status, reason, fault or cause differs from the snapshot before
};

}  // namespace airworthy::health
