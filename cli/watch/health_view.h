#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace airworthy::watch {

/// The parts of a feed object that people look at, made safe for a terminal. A member that is absent or of
/// another type than promised is empty: a reader of the feed survives whatever comes.
struct Since {
  std::optional<std::int64_t> age_us;  ///< at the time of the message
  std::string utc;
};

struct ComponentView {
  std::string name;
  std::string status;
  Since since;
  std::vector<std::string> reasons;
  std::string advice;
};

struct ProcessView {
  std::string name;
  std::string status;
  bool expected{};
  Since since;
  std::int64_t restarts{};
  std::string detail;
};

struct LinkView {
  std::string driver;
  std::string name;
  std::string status;
  Since since;
  std::string detail;
  std::vector<std::string> rates{};  ///< "HIGHRES_IMU 500 Hz", of what arrives
};

struct FaultView {
  std::string id;  ///< producer, session and number
  std::string phase;
  std::string producer;
  std::string component;
  std::string fault_kind;
  std::string severity;
  std::string advice;
  std::string summary;
  std::string magnitude;  ///< with sigma and unit; empty where unknown
  std::string unconfirmed;
  bool latched{};
  Since since;
};

struct HealthView {
  std::string vehicle;
  std::string utc;
  std::string status;
  std::string flight_phase;
  std::string root_cause;
  std::string advice;
  std::vector<ComponentView> components;
  std::vector<ProcessView> processes;
  std::vector<LinkView> links;
  std::vector<FaultView> faults;
};

[[nodiscard]] HealthView health_view(const nlohmann::json& body);
[[nodiscard]] FaultView event_view(const nlohmann::json& body);

}  // namespace airworthy::watch
