#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "core/time/time.h"

namespace airworthy {

/// The speed of one rotor over the last moments, from telemetry that comes late, seldom and with gaps: straight
/// lines between the reports. Speed in rad/s.
template <class Scalar>
class SpeedTrack {
 public:
  static constexpr std::size_t kReports = 64;

  /// Reports must come in the order of their times; one that does not is refused.
  bool add(TimePoint time, Scalar speed_rad_s) noexcept {
    if (count_ > 0 && time <= newest_time()) return false;
    report_[next_] = {time, speed_rad_s};
    next_ = (next_ + 1) % kReports;
    count_ = std::min(count_ + 1, kReports);
    return true;
  }

  void reset() noexcept { count_ = next_ = 0; }

  [[nodiscard]] bool is_empty() const noexcept { return count_ == 0; }
  [[nodiscard]] TimePoint newest_time() const noexcept { return report_[index(0)].time; }

  struct Value {
    Scalar speed_rad_s;
    Scalar
        spacing_s;  ///< between the reports around it; beyond the newest, its age if that is more than the last spacing
  };

  /// The speed at `time`, held before the oldest and beyond the newest report. Empty without any report.
  [[nodiscard]] std::optional<Value> at(TimePoint time) const noexcept {
    if (count_ == 0) return std::nullopt;
    if (time >= newest_time()) {
      const Duration last = count_ > 1 ? newest_time() - report_[index(1)].time : Duration{0};
      return Value{report_[index(0)].speed_rad_s, seconds(std::max(time - newest_time(), last))};
    }
    for (std::size_t back = 1; back < count_; ++back) {
      const Report& before = report_[index(back)];
      if (before.time > time) continue;
      const Report& after = report_[index(back - 1)];
      const Scalar spacing_s = seconds(after.time - before.time);
      const Scalar share = seconds(time - before.time) / spacing_s;
      return Value{before.speed_rad_s + share * (after.speed_rad_s - before.speed_rad_s), spacing_s};
    }
    const Report& oldest = report_[index(count_ - 1)];
    return Value{oldest.speed_rad_s, seconds(oldest.time - time)};
  }

 private:
  struct Report {
    TimePoint time;
    Scalar speed_rad_s;
  };
  [[nodiscard]] std::size_t index(std::size_t back) const noexcept {
    return (next_ + 2 * kReports - 1 - back) % kReports;
  }
  [[nodiscard]] static Scalar seconds(Duration duration) noexcept {
    return static_cast<Scalar>(to_seconds(duration));
  }

  std::array<Report, kReports> report_{};
  std::size_t next_ = 0;
  std::size_t count_ = 0;
};

}  // namespace airworthy
