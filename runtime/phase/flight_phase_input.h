#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/detectors/flight_phase.h"
#include "runtime/process/node.h"

namespace airworthy::rt {

/// Feeds IMU, ESC_STATUS, ROTOR_COMMAND and FLIGHT_STATE of a node's bus into a FlightPhase, in the order of their
/// times, so that the network's order of delivery makes no difference. Of several inertial units the first one heard
/// counts.
class FlightPhaseInput {
 public:
  static constexpr std::size_t kMostQueued = 20'000;

  FlightPhaseInput(Node& node, const Multirotor& vehicle);
  FlightPhaseInput(const FlightPhaseInput&) = delete;
  FlightPhaseInput& operator=(const FlightPhaseInput&) = delete;

  /// Takes what was measured up to `time`; what comes later for an earlier time is still taken, but late.
  const FlightPhase& advance_to(TimePoint time);
  [[nodiscard]] const FlightPhase& phase() const { return phase_; }

 private:
  struct Input {
    TimePoint time;
    int rank;  ///< of what has the same time, and then by arrival
    std::function<void(FlightPhase&)> apply;
  };
  void queue(TimePoint time, int rank, std::function<void(FlightPhase&)> apply);

  Node& node_;
  FlightPhase phase_;
  std::vector<Input> queue_;
  int sensor_id_ = -1;
};

}  // namespace airworthy::rt
