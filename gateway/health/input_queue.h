#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "gateway/health/health_config.h"
#include "gateway/health/health_counters.h"
#include "gateway/health/health_input.h"

namespace airworthy::health {

/// Puts messages into an order that does not depend on how the network shuffled them: a message takes effect
/// at the first tick after the one that follows its sending, which leaves a whole tick period for it to
/// arrive, and all that take effect together do so in order of (sent, producer, kind, session, seq).
///
/// Messages far from the ticks (fresh processes beside recorded ticks) have no comparable time: they take
/// effect at the next tick in order of arrival.
class InputQueue {
 public:
  struct Released {
    Input input;
    bool foreign_clock{};
  };

  explicit InputQueue(const HealthConfig& config) : config_{config} {}

  void push(Input input, HealthCounters& counters);

  /// What takes effect at `tick`, the one before it having been `previous`.
  [[nodiscard]] std::vector<Released> take(TimePoint previous, TimePoint tick, HealthCounters& counters);

  /// Everything, in order of arrival and as of a foreign clock; for a tick stream that started afresh.
  [[nodiscard]] std::vector<Released> take_all(HealthCounters& counters);

  [[nodiscard]] std::size_t size() const { return waiting_.size(); }

 private:
  struct Waiting {
    Input input;
    bool own_clock{};  ///< was within reach of a tick once, so it stays comparable though it waits across a
                       ///< gap
  };

  const HealthConfig& config_;
  std::vector<Waiting> waiting_;  ///< in order of arrival
  std::size_t items_{};
  std::map<std::string, std::size_t> items_per_producer_;
};

}  // namespace airworthy::health
