#pragma once

#include <functional>

#include "core/time/time.h"

namespace airworthy::rt {

/// Vehicle time and timers on it. Implementations: LiveClock (CLOCK_BOOTTIME, Asio timers) and ManualClock
/// (moved by a test, by a recording, or by TICK messages).
class Clock {
 public:
  using Callback = std::function<void(TimePoint)>;

  Clock() = default;
  Clock(const Clock&) = delete;
  Clock& operator=(const Clock&) = delete;
  virtual ~Clock() = default;

  [[nodiscard]] virtual TimePoint now() const = 0;

  /// Calls back once every period of vehicle time, first after one period, for the life of the clock. A late
  /// wake-up is one call, never a burst.
  virtual void every(Duration period, Callback callback) = 0;
};

}  // namespace airworthy::rt
