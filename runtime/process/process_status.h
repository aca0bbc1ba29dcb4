#pragma once

#include <string>

#include "airworthy/process_status_t.hpp"
#include "runtime/process/node.h"

namespace airworthy::rt {

enum class ProcessState : std::int8_t { kStarting = 0, kRunning = 1, kDegraded = 2, kStopping = 3 };

/// The life sign of a process, published 5 times a second of vehicle time and at every change of state.
class ProcessStatus {
 public:
  static constexpr Duration kPeriod{200'000};

  ProcessStatus(Node& node, std::string config_hash, double time_scale);

  /// `detail` says in words what is wrong; empty when nothing is.
  void set(ProcessState state, const std::string& detail);
  [[nodiscard]] ProcessState state() const { return state_; }

 private:
  void publish();

  Node& node_;
  Publisher<process_status_t> publisher_;
  process_status_t message_;
  ProcessState state_ = ProcessState::kStarting;
  std::string detail_;
};

}  // namespace airworthy::rt
