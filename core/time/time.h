#pragma once

#include <chrono>
#include <cstdint>

namespace airworthy {

/// Vehicle time: µs of CLOCK_BOOTTIME on the gateway's computer. Core code never reads it from a clock; it
/// comes as an argument, taken from a message.
struct VehicleTime {
  using rep = std::int64_t;
  using period = std::micro;
  using duration = std::chrono::duration<rep, period>;
  using time_point = std::chrono::time_point<VehicleTime>;
  static constexpr bool is_steady = true;
};

using Duration = VehicleTime::duration;
using TimePoint = VehicleTime::time_point;

constexpr TimePoint from_us(std::int64_t us) noexcept { return TimePoint{Duration{us}}; }
constexpr std::int64_t to_us(TimePoint t) noexcept { return t.time_since_epoch().count(); }

constexpr double to_seconds(Duration d) noexcept { return static_cast<double>(d.count()) * 1e-6; }
constexpr Duration from_seconds(double s) noexcept { return Duration{static_cast<std::int64_t>(s * 1e6)}; }

}  // namespace airworthy
