#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "core/protocol/mavlink/messages.h"

namespace airworthy::mavlink {

// Values with SI units out of messages whose wire form has a special number for "no data". Empty = the sender
// has no such value.

/// Centi-degrees as the inertial messages carry them: 0 = no data (a true 0 °C is sent as 0.01 °C).
[[nodiscard]] std::optional<double> imu_temperature_degC(std::int16_t wire) noexcept;

[[nodiscard]] std::optional<double> battery_voltage_V(const SysStatus& message) noexcept;
[[nodiscard]] std::optional<double> battery_current_A(const SysStatus& message) noexcept;
[[nodiscard]] std::optional<double> battery_remaining_ratio(const SysStatus& message) noexcept;

/// Sum of the cells that are present. Cells beyond the first absent one are ignored.
[[nodiscard]] std::optional<double> battery_voltage_V(const BatteryStatus& message) noexcept;
[[nodiscard]] std::optional<double> battery_current_A(const BatteryStatus& message) noexcept;
[[nodiscard]] std::optional<double> battery_temperature_degC(const BatteryStatus& message) noexcept;

/// One ESC of a message; `lane` 0..3, ESC number index + lane. An ESC whose values are all zero is not there.
struct EscValues {
  std::optional<double> speed_rpm{};
  std::optional<double> voltage_V{};
  std::optional<double> current_A{};
  std::optional<double> temperature_degC{};
  std::optional<std::int64_t> error_count{};
};
[[nodiscard]] EscValues esc_values(const EscInfo& message, std::size_t lane) noexcept;
[[nodiscard]] EscValues esc_values(const EscStatus& message, std::size_t lane) noexcept;
[[nodiscard]] EscValues esc_values(const EscTelemetry1To4& message, std::size_t lane) noexcept;

/// Pulse width of output 1..16, empty where the sender has no such output (0 or 65535).
[[nodiscard]] std::optional<double> servo_pulse_us(const ServoOutputRaw& message,
                                                   std::size_t output) noexcept;

/// The text up to its terminator, if it has one.
[[nodiscard]] std::string_view text_of(const Statustext& message) noexcept;

}  // namespace airworthy::mavlink
