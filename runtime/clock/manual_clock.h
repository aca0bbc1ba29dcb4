#pragma once

#include <vector>

#include "runtime/clock/clock.h"

namespace airworthy::rt {

/// A clock that stands still until moved: by a test, by the message times of a recording, or by TICK
/// messages.
class ManualClock final : public Clock {
 public:
  explicit ManualClock(TimePoint start = TimePoint{}) : now_{start} {}

  [[nodiscard]] TimePoint now() const override { return now_; }
  void every(Duration period, Callback callback) override;

  /// Moves forward and fires every timer due on the way, in order of time; a step back is ignored. The first
  /// move from zero sets the time without firing, so that a recording may start at any time.
  void advance_to(TimePoint t);

 private:
  struct Timer {
    Duration period;
    TimePoint due;
    Callback callback;
  };

  TimePoint now_;
  std::vector<Timer> timers_;
};

}  // namespace airworthy::rt
