#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "core/time/time.h"

namespace airworthy::health {

/// Who said it and when; the header of the message.
struct Origin {
  std::string producer;
  std::int64_t session{};
  std::int64_t seq{};  ///< counts the producer's messages of one kind
  TimePoint time{};    ///< of the measurement or decision
  TimePoint sent{};
};

enum class ProcessState { kStarting, kRunning, kDegraded, kStopping };

/// Life sign of a process.
struct ProcessSign {
  Origin origin;
  ProcessState state{ProcessState::kRunning};
  std::string detail;
};

/// How often one kind of device message arrives.
struct MessageRate {
  std::string name;
  double rate_Hz{};  ///< NaN where unknown
};

/// State of one link, as its driver reports it.
struct LinkReport {
  Origin origin;
  std::string link;
  bool connected{};
  std::string detail;
  double seconds_since_data{};  ///< NaN before the first byte
  std::vector<MessageRate> rates{};
};

enum class FaultPhase { kRaise = 1, kUpdate, kClear };
enum class Severity { kAdvisory = 1, kCaution, kWarning };

struct Evidence {
  std::string name;
  double value{};
  std::string unit;
};

/// A fault raised, updated or cleared. Its identity is (producer, session, number).
struct FaultReport {
  Origin origin;
  std::int64_t number{};
  FaultPhase phase{FaultPhase::kRaise};
  std::string detector;
  std::string component;
  std::string fault_kind;
  Severity severity{Severity::kAdvisory};
  bool latched{};
  double probability{};  ///< NaN where unknown, like the two below
  double magnitude{};
  double magnitude_sigma{};
  std::string magnitude_unit;
  TimePoint onset{};
  TimePoint detected{};
  std::string summary;
  std::vector<std::string> candidates;
  std::vector<Evidence> evidence;
};

enum class DetectorState { kInitialising, kConverging, kMonitoring, kMuted };

/// Whether a detector would see a fault of this component, and why not.
struct Assessment {
  std::string component;
  bool judged{};
  std::string reason;
};

/// A detector's whole verdict.
struct DetectorReport {
  Origin origin;
  std::string detector;
  DetectorState state{DetectorState::kInitialising};
  std::string muted_reason;
  std::vector<Assessment> components;
  std::vector<FaultReport> active;
  bool active_is_complete{true};  ///< false once the list was cut: an absent fault then proves nothing
};

/// The order of the alternatives is the order in which messages of the same instant take effect: a verdict
/// comes after the events it sums up.
using Input = std::variant<ProcessSign, LinkReport, FaultReport, DetectorReport>;

inline const Origin& origin_of(const Input& input) {
  return std::visit([](const auto& message) -> const Origin& { return message.origin; }, input);
}

}  // namespace airworthy::health
