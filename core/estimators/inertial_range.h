#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "core/estimators/update_status.h"

namespace airworthy {

/// Beyond what any part of a drone can show: a wrong unit or a damaged sensor, not a measurement.
inline constexpr double kMostAccel_m_s2 = 2000.0;
inline constexpr double kMostRate_rad_s = 200.0;

/// Whether an inertial sample can be a measurement: kFused, kNotFinite or kOutOfRange.
[[nodiscard]] inline UpdateStatus inertial_status(const std::array<double, 3>& accel_m_s2,
                                                  const std::array<double, 3>& gyro_rad_s) noexcept {
  bool is_in_range = true;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!std::isfinite(accel_m_s2[i]) || !std::isfinite(gyro_rad_s[i])) return UpdateStatus::kNotFinite;
    is_in_range = is_in_range && std::abs(accel_m_s2[i]) <= kMostAccel_m_s2 &&
                  std::abs(gyro_rad_s[i]) <= kMostRate_rad_s;
  }
  return is_in_range ? UpdateStatus::kFused : UpdateStatus::kOutOfRange;
}

}  // namespace airworthy
