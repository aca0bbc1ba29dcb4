#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <set>
#include <string>
#include <tuple>

#include "gateway/health/health_input.h"

namespace airworthy::gateway {

/// Remembers which fault events were passed on, so that each goes out once though it may arrive several
/// times: as itself, and again among the recent events of its detector's status. Bounded: forgets the oldest.
class EventMemory {
 public:
  static constexpr std::size_t kCapacity = 4096;

  /// True the first time.
  bool insert(const health::FaultReport& event) {
    const Key key{event.origin.producer, event.origin.session, event.number, static_cast<int>(event.phase),
                  event.origin.seq};
    if (!known_.insert(key).second) return false;
    order_.push_back(key);
    if (order_.size() > kCapacity) {
      known_.erase(order_.front());
      order_.pop_front();
    }
    return true;
  }

 private:
  using Key = std::tuple<std::string, std::int64_t, std::int64_t, int, std::int64_t>;
  std::set<Key> known_;
  std::deque<Key> order_;
};

}  // namespace airworthy::gateway
