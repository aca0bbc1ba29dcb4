#pragma once

#include <cstdint>
#include <optional>

#include "core/time/time.h"

namespace airworthy {

/// Which samples of a stream are taken, by their stamps alone: those newer than the newest. One stamp from the far future
/// would then refuse all that follow until the clock catches up. So when kRun samples in a row, in order among themselves,
/// come at least kWrong before the newest, the newest was wrong: they are the stream, and it begins anew with the last of
/// them. Duplicates, reordered samples and stragglers never come in such a run, for newer samples come between.
/// Stamps must not be negative.
class StampGate {
 public:
  enum class Stamp : std::uint8_t {
    kNewer,    ///< take it
    kSame,     ///< as new as the newest
    kOlder,    ///< refuse it
    kRestart,  ///< take it, as after a gap: nothing is known of the time since the sample before
  };
  static constexpr int kRun = 10;
  static constexpr Duration kWrong{500'000};

  [[nodiscard]] Stamp judge(TimePoint time) noexcept {
    if (!newest_ || time > *newest_) return take(time, Stamp::kNewer);
    if (*newest_ - time < kWrong) {
      run_ = 0;
      return time == *newest_ ? Stamp::kSame : Stamp::kOlder;
    }
    // What is a little late within the run is no part of it; what is far behind it shows that the run was wrong too.
    if (run_ == 0 || run_newest_ - time >= kWrong) {
      run_ = 1;
      run_newest_ = time;
    } else if (time > run_newest_) {
      ++run_;
      run_newest_ = time;
    }
    if (run_ < kRun) return Stamp::kOlder;
    ++restarts_;
    return take(time, Stamp::kRestart);
  }

  [[nodiscard]] const std::optional<TimePoint>& newest() const noexcept { return newest_; }
  [[nodiscard]] std::int64_t restarts() const noexcept { return restarts_; }

 private:
  Stamp take(TimePoint time, Stamp stamp) noexcept {
    newest_ = time;
    run_ = 0;
    return stamp;
  }

  std::optional<TimePoint> newest_;
  TimePoint run_newest_{};
  int run_ = 0;
  std::int64_t restarts_ = 0;
};

}  // namespace airworthy
