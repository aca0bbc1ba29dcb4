#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "core/time/time.h"

namespace airworthy::gateway {

/// Microseconds since 1970 as 2026-11-22T03:20:00.123456Z; empty outside the years 1970 to 9999.
[[nodiscard]] std::string utc_text(std::int64_t utc_us);

/// Writes times into the objects of the feed: vehicle time always, UTC where it is known.
class FeedTime {
 public:
  /// No offset: recorded or scaled time, whose wall time nobody knows.
  explicit FeedTime(std::optional<std::int64_t> utc_offset_us) : utc_offset_us_{utc_offset_us} {}

  /// `<name>_us` and `<name>_utc`.
  void write(nlohmann::json& object, const std::string& name, TimePoint time) const;

 private:
  std::optional<std::int64_t> utc_offset_us_;
};

/// Wall time of this computer, beside vehicle time. The offset it gives only follows what matters, so that
/// the same vehicle time reads the same in every message.
class WallClock {
 public:
  static constexpr std::int64_t kStep_us = 10'000;

  [[nodiscard]] std::int64_t utc_offset_us(TimePoint now);
  /// The same for a wall time at hand.
  [[nodiscard]] std::int64_t utc_offset_us(TimePoint now, std::int64_t wall_us);

 private:
  std::optional<std::int64_t> offset_us_;
};

}  // namespace airworthy::gateway
