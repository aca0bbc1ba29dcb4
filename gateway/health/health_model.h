#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "gateway/health/component_table.h"
#include "gateway/health/detector_table.h"
#include "gateway/health/fault_table.h"
#include "gateway/health/health_config.h"
#include "gateway/health/health_counters.h"
#include "gateway/health/health_input.h"
#include "gateway/health/health_snapshot.h"
#include "gateway/health/input_queue.h"
#include "gateway/health/link_table.h"
#include "gateway/health/process_table.h"
#include "gateway/health/root_cause.h"

namespace airworthy::health {

/// The health of the vehicle as a function of a stream of messages and ticks, and of nothing else: the same
/// stream gives the same snapshots, live and in replay, however the network ordered the messages between two
/// ticks.
///
/// At a tick, what was sent up to the tick before takes effect, the deadlines are judged as of the tick
/// before, and the snapshot tells the health as of that time. So a message has a whole tick period to arrive.
class HealthModel {
 public:
  explicit HealthModel(HealthConfig config);
  HealthModel(const HealthModel&) = delete;
  HealthModel& operator=(const HealthModel&) = delete;

  void add(Input input);

  /// None at the first tick, at one that repeats or precedes the last, and where the ticks jumped back.
  [[nodiscard]] std::optional<HealthSnapshot> tick(TimePoint time);

  [[nodiscard]] const HealthCounters& counters() const { return counters_; }
  [[nodiscard]] const HealthConfig& config() const { return config_; }
  [[nodiscard]] std::size_t queued() const { return queue_.size(); }
  [[nodiscard]] const FaultTable& faults() const { return faults_; }

 private:
  void apply(const InputQueue::Released& released, TimePoint as_of);
  void start_over(TimePoint tick);
  [[nodiscard]] HealthSnapshot evaluate(TimePoint as_of);

  const HealthConfig config_;
  HealthCounters counters_;
  InputQueue queue_;
  ProcessTable processes_;
  LinkTable links_;
  DetectorTable detectors_;
  FaultTable faults_;
  ComponentTable components_;

  std::optional<TimePoint> last_tick_;
  TimePoint grace_from_{TimePoint::min()};
  bool after_gap_{};
  std::string last_signature_;
};

}  // namespace airworthy::health
