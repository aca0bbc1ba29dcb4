#pragma once

#include <string>
#include <vector>

#include "core/time/time.h"

namespace airworthy::eval {

/// When a detector judged a flight, and when not and why. Silence says something only of the time that was judged.
class JudgementLog {
 public:
  struct Interval {
    TimePoint from;
    TimePoint until;
  };
  struct Muted {
    std::string why;
    double seconds = 0.0;
    std::vector<Interval> intervals;  ///< neighbours joined, in order of time
  };

  /// The time from one sample to the next; `why_muted` empty = judged. In order of time.
  void note(TimePoint from, TimePoint until, const std::string& why_muted);

  /// Whether the detector tells at all.
  [[nodiscard]] bool has_any() const { return has_any_; }
  [[nodiscard]] double judged_s() const { return judged_s_; }
  /// The part of it in this interval.
  [[nodiscard]] double judged_s(const Interval& within) const;
  [[nodiscard]] double muted_s() const;
  /// By cause, in the order in which they first came up.
  [[nodiscard]] const std::vector<Muted>& muted() const { return muted_; }
  /// The cause that took the most time; empty if there is none.
  [[nodiscard]] std::string main_cause() const;

 private:
  bool has_any_ = false;
  double judged_s_ = 0.0;
  std::vector<Interval> judged_;  ///< neighbours joined, in order of time
  std::vector<Muted> muted_;
};

}  // namespace airworthy::eval
