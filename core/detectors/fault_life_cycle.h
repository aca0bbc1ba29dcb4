#pragma once

#include <algorithm>
#include <optional>

#include "core/time/time.h"

namespace airworthy {

struct FaultLifeCycleParams {
  double clear_ratio = 0.1;           ///< the test ratio must stay below this ...
  Duration clear_after{5'000'000};    ///< ... for so long before the fault is cleared
  Duration update_period{1'000'000};  ///< an active fault is updated this often
  bool latched = false;               ///< cannot heal in flight
};

/// Turns a test ratio (alarm at 1) into the life of a fault: raised, updated, cleared with hysteresis in
/// value and in time, or latched. Should the time go back, as after a stamp of the future, it counts from the new one.
class FaultLifeCycle {
 public:
  enum class Transition { kNone, kRaise, kUpdate, kClear };

  explicit FaultLifeCycle(const FaultLifeCycleParams& params) noexcept : params_{params} {}

  Transition step(double test_ratio, TimePoint now) noexcept {
    if (!active_) {
      if (!(test_ratio >= 1.0)) return Transition::kNone;
      active_ = true;
      raised_at_ = published_at_ = now;
      below_since_.reset();
      return Transition::kRaise;
    }
    published_at_ = std::min(published_at_, now);
    if (below_since_) below_since_ = std::min(*below_since_, now);
    if (!(test_ratio < params_.clear_ratio)) {
      below_since_.reset();
    } else if (!below_since_) {
      below_since_ = now;
    }
    if (!params_.latched && below_since_ && now - *below_since_ >= params_.clear_after) {
      active_ = false;
      return Transition::kClear;
    }
    if (now - published_at_ >= params_.update_period) {
      published_at_ = now;
      return Transition::kUpdate;
    }
    return Transition::kNone;
  }

  [[nodiscard]] bool active() const noexcept { return active_; }
  [[nodiscard]] TimePoint raised_at() const noexcept { return raised_at_; }

 private:
  FaultLifeCycleParams params_;
  bool active_ = false;
  TimePoint raised_at_;
  TimePoint published_at_;
  std::optional<TimePoint> below_since_;
};

}  // namespace airworthy
