#include "runtime/clock/manual_clock.h"

#include <algorithm>

namespace airworthy::rt {

void ManualClock::every(Duration period, Callback callback) {
  timers_.push_back({period, now_ + period, std::move(callback)});
}

void ManualClock::advance_to(TimePoint t) {
  if (now_ == TimePoint{}) {
    for (Timer& timer : timers_) timer.due = t + timer.period;
    now_ = t;
    return;
  }
  while (!timers_.empty()) {
    const auto next = std::min_element(timers_.begin(), timers_.end(),
                                       [](const Timer& a, const Timer& b) { return a.due < b.due; });
    if (next->due > t) break;
    now_ = std::max(now_, next->due);
    next->due += next->period;
    const Callback callback = next->callback;  // a copy: the callback may add timers and move the vector
    callback(now_);
  }
  now_ = std::max(now_, t);
}

}  // namespace airworthy::rt
