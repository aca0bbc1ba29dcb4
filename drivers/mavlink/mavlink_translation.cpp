#include "drivers/mavlink/mavlink_translation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/estimators/inertial_range.h"
#include "core/protocol/mavlink/constants.h"

namespace airworthy::drivers {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kMilliG_m_s2 = 9.80665e-3;
constexpr double kRadians = std::numbers::pi / 180.0;

// Beyond what any part of a drone can show: a wrong unit or a damaged sensor, not a measurement.
constexpr double kLeastTemperature_degC = -60.0;
constexpr double kMostTemperature_degC = 250.0;
constexpr double kMostSpeed_rpm = 200'000.0;
constexpr double kMostVoltage_V = 1000.0;
constexpr double kMostCurrent_A = 2000.0;

/// The value if it is finite and within ±limit, else NaN, counted unless it said "no data" itself.
double checked(double value, double limit, rt::Counters& counters) {
  if (std::isnan(value)) return kNaN;
  if (std::abs(value) <= limit) return value;
  counters.add("refused.implausible_value");
  return kNaN;
}

double checked(float value, double limit, rt::Counters& counters) {
  return checked(static_cast<double>(value), limit, counters);
}

double checked_temperature(std::optional<double> value_degC, rt::Counters& counters) {
  if (!value_degC || std::isnan(*value_degC)) return kNaN;
  if (*value_degC >= kLeastTemperature_degC && *value_degC <= kMostTemperature_degC) return *value_degC;
  counters.add("refused.implausible_value");
  return kNaN;
}

/// Three axes of which none may be missing.
bool fill(double (&to)[3], const std::array<float, 3>& from, double limit) {
  std::transform(from.begin(), from.end(), std::begin(to),
                 [](float value) { return static_cast<double>(value); });
  return std::all_of(std::begin(to), std::end(to),
                     [limit](double value) { return std::isfinite(value) && std::abs(value) <= limit; });
}

/// At the end of its range a sensor says "more than this" rather than a value; 32767 is also "no data".
bool is_saturated(std::int16_t value) {
  return value == std::numeric_limits<std::int16_t>::max() ||
         value == std::numeric_limits<std::int16_t>::min();
}

template <class Message>
std::optional<imu_t> from_integers(const Message& message, int sensor_id, double averaging_window_s,
                                   rt::Counters& counters) {
  const std::array<std::int16_t, 3> accel{message.xacc, message.yacc, message.zacc};
  const std::array<std::int16_t, 3> gyro{message.xgyro, message.ygyro, message.zgyro};
  if (std::any_of(accel.begin(), accel.end(), is_saturated) ||
      std::any_of(gyro.begin(), gyro.end(), is_saturated)) {
    counters.add("refused.imu_saturated");
    return std::nullopt;
  }
  imu_t imu{};
  imu.sensor_id = static_cast<std::int8_t>(sensor_id);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    imu.accel_m_s2[axis] = accel[axis] * kMilliG_m_s2;
    imu.gyro_rad_s[axis] = gyro[axis] * 1e-3;
  }
  imu.temperature_degC = checked_temperature(mavlink::imu_temperature_degC(message.temperature), counters);
  imu.averaging_window_s = averaging_window_s;
  return imu;
}

struct Euler {
  double roll_rad = kNaN;
  double pitch_rad = kNaN;
  double yaw_rad = kNaN;
};

/// Roll, pitch, yaw (Z-Y-X) of a unit quaternion w, x, y, z; empty if it is far from one.
std::optional<Euler> to_euler(const std::array<float, 4>& q) {
  const auto w = static_cast<double>(q[0]);
  const auto x = static_cast<double>(q[1]);
  const auto y = static_cast<double>(q[2]);
  const auto z = static_cast<double>(q[3]);
  const double norm2 = w * w + x * x + y * y + z * z;
  if (!(norm2 > 0.9 && norm2 < 1.1)) return std::nullopt;
  Euler euler;
  euler.roll_rad = std::atan2(2.0 * (w * x + y * z), norm2 - 2.0 * (x * x + y * y));
  euler.pitch_rad = std::asin(std::clamp(2.0 * (w * y - z * x) / norm2, -1.0, 1.0));
  euler.yaw_rad = std::atan2(2.0 * (w * z + x * y), norm2 - 2.0 * (y * y + z * z));
  return euler;
}

/// The output's place between stopped and full. Values beyond the two are the same as them: an idle or
/// disarmed output lies below.
double to_ratio(double value, const OutputMap& map) {
  return std::clamp((value - map.stopped) / (map.full - map.stopped), 0.0, 1.0);
}

template <class ValueOf>
std::optional<rotor_command_t> to_rotor_command(const MavlinkConfig& config, ValueOf&& value_of) {
  rotor_command_t command{};
  command.rotor_count = config.rotor_count;
  command.command_ratio.assign(static_cast<std::size_t>(config.rotor_count), kNaN);
  bool is_empty = true;
  for (const OutputMap& map : config.outputs) {
    const std::optional<double> value = value_of(map);
    if (!value) continue;
    command.command_ratio[static_cast<std::size_t>(map.rotor - 1)] = to_ratio(*value, map);
    is_empty = false;
  }
  if (is_empty) return std::nullopt;
  return command;
}

}  // namespace

std::optional<imu_t> to_imu(const mavlink::HighresImu& message, double averaging_window_s,
                            rt::Counters& counters) {
  if ((message.fields_updated & mavlink::kHighresImuInertial) != mavlink::kHighresImuInertial) {
    counters.add("refused.imu_not_inertial");
    return std::nullopt;
  }
  imu_t imu{};
  imu.sensor_id = static_cast<std::int8_t>(message.id & 0x7FU);
  if (!fill(imu.accel_m_s2, {message.xacc, message.yacc, message.zacc}, kMostAccel_m_s2) ||
      !fill(imu.gyro_rad_s, {message.xgyro, message.ygyro, message.zgyro}, kMostRate_rad_s)) {
    counters.add("refused.imu_implausible");
    return std::nullopt;
  }
  const bool has_temperature = (message.fields_updated & mavlink::kHighresImuTemperature) != 0;
  imu.temperature_degC = checked_temperature(
      has_temperature ? std::optional<double>{static_cast<double>(message.temperature)} : std::nullopt,
      counters);
  imu.averaging_window_s = averaging_window_s;
  return imu;
}

std::optional<imu_t> to_imu(const mavlink::ScaledImuFields& message, int sensor_id, double averaging_window_s,
                            rt::Counters& counters) {
  return from_integers(message, sensor_id, averaging_window_s, counters);
}

std::optional<imu_t> to_imu(const mavlink::RawImu& message, double averaging_window_s,
                            rt::Counters& counters) {
  return from_integers(message, message.id & 0x7F, averaging_window_s, counters);
}

std::optional<attitude_t> to_attitude(const mavlink::Attitude& message, rt::Counters& counters) {
  if (!std::isfinite(message.roll) || !std::isfinite(message.pitch)) {
    counters.add("refused.attitude_not_finite");
    return std::nullopt;
  }
  attitude_t attitude{};
  attitude.roll_rad = static_cast<double>(message.roll);
  attitude.pitch_rad = static_cast<double>(message.pitch);
  attitude.yaw_rad = checked(message.yaw, 10.0, counters);
  attitude.rates_rad_s[0] = checked(message.rollspeed, kMostRate_rad_s, counters);
  attitude.rates_rad_s[1] = checked(message.pitchspeed, kMostRate_rad_s, counters);
  attitude.rates_rad_s[2] = checked(message.yawspeed, kMostRate_rad_s, counters);
  return attitude;
}

std::optional<attitude_t> to_attitude(const mavlink::AttitudeQuaternion& message, rt::Counters& counters) {
  const auto euler = to_euler({message.q1, message.q2, message.q3, message.q4});
  if (!euler) {
    counters.add("refused.quaternion_not_unit");
    return std::nullopt;
  }
  attitude_t attitude{};
  attitude.roll_rad = euler->roll_rad;
  attitude.pitch_rad = euler->pitch_rad;
  attitude.yaw_rad = euler->yaw_rad;
  attitude.rates_rad_s[0] = checked(message.rollspeed, kMostRate_rad_s, counters);
  attitude.rates_rad_s[1] = checked(message.pitchspeed, kMostRate_rad_s, counters);
  attitude.rates_rad_s[2] = checked(message.yawspeed, kMostRate_rad_s, counters);
  return attitude;
}

std::optional<attitude_setpoint_t> to_setpoint(const mavlink::AttitudeTarget& message,
                                               rt::Counters& counters) {
  const auto is_ignored = [&message](unsigned bit) { return (message.type_mask & bit) != 0; };
  Euler euler;
  if (!is_ignored(mavlink::kIgnoreAttitude)) {
    if (const auto commanded = to_euler(message.q)) {
      euler = *commanded;
    } else {
      counters.add("refused.quaternion_not_unit");
    }
  }
  const auto rate = [&](float value, unsigned bit) {
    return is_ignored(bit) ? kNaN : checked(value, kMostRate_rad_s, counters);
  };
  attitude_setpoint_t setpoint{};
  setpoint.roll_rad = euler.roll_rad;
  setpoint.pitch_rad = euler.pitch_rad;
  setpoint.yaw_rad = euler.yaw_rad;
  setpoint.rates_rad_s[0] = rate(message.body_roll_rate, mavlink::kIgnoreRollRate);
  setpoint.rates_rad_s[1] = rate(message.body_pitch_rate, mavlink::kIgnorePitchRate);
  setpoint.rates_rad_s[2] = rate(message.body_yaw_rate, mavlink::kIgnoreYawRate);
  setpoint.thrust_ratio =
      is_ignored(mavlink::kIgnoreThrottle) ? kNaN : checked(message.thrust, 1.0, counters);
  const std::array<double, 7> all{setpoint.roll_rad,       setpoint.pitch_rad,      setpoint.yaw_rad,
                                  setpoint.rates_rad_s[0], setpoint.rates_rad_s[1], setpoint.rates_rad_s[2],
                                  setpoint.thrust_ratio};
  if (std::all_of(all.begin(), all.end(), [](double value) { return std::isnan(value); })) {
    counters.add("refused.setpoint_empty");
    return std::nullopt;
  }
  return setpoint;
}

std::optional<attitude_setpoint_t> to_setpoint(const mavlink::NavControllerOutput& message,
                                               rt::Counters& counters) {
  if (!std::isfinite(message.nav_roll) || !std::isfinite(message.nav_pitch)) {
    counters.add("refused.setpoint_empty");
    return std::nullopt;
  }
  attitude_setpoint_t setpoint{};
  setpoint.roll_rad = static_cast<double>(message.nav_roll) * kRadians;
  setpoint.pitch_rad = static_cast<double>(message.nav_pitch) * kRadians;
  setpoint.yaw_rad = kNaN;
  std::fill(std::begin(setpoint.rates_rad_s), std::end(setpoint.rates_rad_s), kNaN);
  setpoint.thrust_ratio = kNaN;
  return setpoint;
}

std::optional<esc_status_t> to_esc_status(std::span<const mavlink::EscValues> escs, std::size_t first_esc,
                                          const MavlinkConfig& config, const std::string& source,
                                          rt::Counters& counters) {
  const auto rotors = static_cast<std::size_t>(config.rotor_count);
  esc_status_t status{};
  status.source = source;
  status.rotor_count = config.rotor_count;
  status.speed_rpm.assign(rotors, kNaN);
  status.voltage_V.assign(rotors, kNaN);
  status.current_A.assign(rotors, kNaN);
  status.temperature_degC.assign(rotors, kNaN);
  status.error_count.assign(rotors, -1);
  bool is_empty = true;
  for (std::size_t lane = 0; lane < escs.size(); ++lane) {
    const mavlink::EscValues& esc = escs[lane];
    if (!esc.speed_rpm && !esc.voltage_V && !esc.current_A && !esc.temperature_degC && !esc.error_count)
      continue;
    const std::size_t number = first_esc + lane;
    if (number >= config.rotor_of_esc.size() || config.rotor_of_esc[number] == 0) {
      counters.add("refused.esc_not_mapped");
      continue;
    }
    const auto rotor = static_cast<std::size_t>(config.rotor_of_esc[number] - 1);
    status.speed_rpm[rotor] = checked(esc.speed_rpm.value_or(kNaN), kMostSpeed_rpm, counters);
    status.voltage_V[rotor] = checked(esc.voltage_V.value_or(kNaN), kMostVoltage_V, counters);
    status.current_A[rotor] = checked(esc.current_A.value_or(kNaN), kMostCurrent_A, counters);
    status.temperature_degC[rotor] = checked_temperature(esc.temperature_degC, counters);
    status.error_count[rotor] = esc.error_count.value_or(-1);
    is_empty = false;
  }
  if (is_empty) return std::nullopt;
  return status;
}

std::optional<rotor_command_t> to_rotor_command(const mavlink::ServoOutputRaw& message,
                                                const MavlinkConfig& config) {
  return to_rotor_command(config, [&message](const OutputMap& map) -> std::optional<double> {
    if (map.port != message.port) return std::nullopt;
    return mavlink::servo_pulse_us(message, static_cast<std::size_t>(map.output));
  });
}

std::optional<rotor_command_t> to_rotor_command(const mavlink::ActuatorOutputStatus& message,
                                                const MavlinkConfig& config, rt::Counters& counters) {
  return to_rotor_command(config, [&](const OutputMap& map) -> std::optional<double> {
    if (static_cast<std::uint32_t>(map.output) > message.active) return std::nullopt;
    const float value = message.actuator[static_cast<std::size_t>(map.output - 1)];
    if (std::isfinite(value)) return static_cast<double>(value);
    if (!std::isnan(value)) counters.add("refused.implausible_value");
    return std::nullopt;
  });
}

double airspeed_error_m_s(float wire, AirspeedErrorUnit unit, Autopilot autopilot) {
  if (!std::isfinite(wire)) return kNaN;
  if (unit == AirspeedErrorUnit::kByAutopilot) {
    if (autopilot == Autopilot::kUnknown) return kNaN;
    unit = autopilot == Autopilot::kArdupilot ? AirspeedErrorUnit::kCentimetresPerSecond
                                              : AirspeedErrorUnit::kMetresPerSecond;
  }
  const auto value = static_cast<double>(wire);
  return unit == AirspeedErrorUnit::kCentimetresPerSecond ? value * 0.01 : value;
}

}  // namespace airworthy::drivers
