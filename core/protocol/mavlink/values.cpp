#include "core/protocol/mavlink/values.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace airworthy::mavlink {
namespace {

constexpr std::uint16_t kNoU16 = std::numeric_limits<std::uint16_t>::max();
constexpr std::int16_t kNoI16 = std::numeric_limits<std::int16_t>::max();

std::optional<double> centi(std::int16_t wire, std::int16_t no_data) noexcept {
  if (wire == no_data) return std::nullopt;
  return static_cast<double>(wire) / 100.0;
}

std::optional<double> finite(float wire) noexcept {
  if (!std::isfinite(wire)) return std::nullopt;
  return static_cast<double>(wire);
}

}  // namespace

std::optional<double> imu_temperature_degC(std::int16_t wire) noexcept { return centi(wire, 0); }

std::optional<double> battery_voltage_V(const SysStatus& message) noexcept {
  if (message.voltage_battery == kNoU16) return std::nullopt;
  return message.voltage_battery / 1000.0;
}

std::optional<double> battery_current_A(const SysStatus& message) noexcept {
  return centi(message.current_battery, -1);
}

std::optional<double> battery_remaining_ratio(const SysStatus& message) noexcept {
  if (message.battery_remaining < 0) return std::nullopt;
  return message.battery_remaining / 100.0;
}

std::optional<double> battery_voltage_V(const BatteryStatus& message) noexcept {
  double sum_mV = 0.0;
  std::size_t cells = 0;
  for (; cells < message.voltages.size() && message.voltages[cells] != kNoU16; ++cells) {
    sum_mV += message.voltages[cells];
  }
  if (cells == 0) return std::nullopt;
  // The extension uses 0 for "absent", because it is what an older sender leaves there.
  if (cells == message.voltages.size()) {
    for (const std::uint16_t cell : message.voltages_ext) {
      if (cell == 0 || cell == kNoU16) break;
      sum_mV += cell;
    }
  }
  return sum_mV / 1000.0;
}

std::optional<double> battery_current_A(const BatteryStatus& message) noexcept {
  return centi(message.current_battery, -1);
}

std::optional<double> battery_temperature_degC(const BatteryStatus& message) noexcept {
  return centi(message.temperature, kNoI16);
}

EscValues esc_values(const EscInfo& message, std::size_t lane) noexcept {
  EscValues values;
  // Senders differ on whether the bits of `info` count from the batch or from ESC 0; in the first batch both
  // agree.
  const bool is_offline = message.index == 0 && (message.info & (1U << lane)) == 0;
  if (is_offline || message.index + lane >= message.count) return values;
  values.temperature_degC = centi(message.temperature[lane], kNoI16);
  values.error_count = message.error_count[lane];
  return values;
}

EscValues esc_values(const EscStatus& message, std::size_t lane) noexcept {
  EscValues values;
  if (message.voltage[lane] == 0.0F && message.rpm[lane] == 0 && message.current[lane] == 0.0F) return values;
  values.speed_rpm = message.rpm[lane];
  if (message.voltage[lane] != 0.0F) values.voltage_V = finite(message.voltage[lane]);
  values.current_A = finite(message.current[lane]);
  return values;
}

EscValues esc_values(const EscTelemetry1To4& message, std::size_t lane) noexcept {
  EscValues values;
  if (message.voltage[lane] == 0 && message.rpm[lane] == 0 && message.temperature[lane] == 0) return values;
  values.speed_rpm = message.rpm[lane];
  if (message.voltage[lane] != 0) values.voltage_V = message.voltage[lane] / 100.0;
  values.current_A = message.current[lane] / 100.0;
  if (message.temperature[lane] != 0) values.temperature_degC = message.temperature[lane];
  return values;
}

std::optional<double> servo_pulse_us(const ServoOutputRaw& message, std::size_t output) noexcept {
  const std::array<std::uint16_t, 16> pulses{
      message.servo1_raw,  message.servo2_raw,  message.servo3_raw,  message.servo4_raw,
      message.servo5_raw,  message.servo6_raw,  message.servo7_raw,  message.servo8_raw,
      message.servo9_raw,  message.servo10_raw, message.servo11_raw, message.servo12_raw,
      message.servo13_raw, message.servo14_raw, message.servo15_raw, message.servo16_raw};
  if (output == 0 || output > pulses.size()) return std::nullopt;
  const std::uint16_t pulse = pulses[output - 1];
  if (pulse == 0 || pulse == kNoU16) return std::nullopt;
  return pulse;
}

std::string_view text_of(const Statustext& message) noexcept {
  const auto end = std::find(message.text.begin(), message.text.end(), '\0');
  return {message.text.data(), static_cast<std::size_t>(end - message.text.begin())};
}

}  // namespace airworthy::mavlink
