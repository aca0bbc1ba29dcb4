#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "airworthy/attitude_setpoint_t.hpp"
#include "airworthy/attitude_t.hpp"
#include "airworthy/esc_status_t.hpp"
#include "airworthy/imu_t.hpp"
#include "airworthy/rotor_command_t.hpp"
#include "core/protocol/mavlink/messages.h"
#include "core/protocol/mavlink/values.h"
#include "drivers/mavlink/mavlink_config.h"
#include "runtime/process/counters.h"

namespace airworthy::drivers {

// One device message to one of ours: units, frames, indices, "no data". Headers are left to the publisher. A
// value that is no number or cannot be true becomes NaN, a message without a usable value becomes nothing;
// both are counted under `refused.<cause>`. MAVLink's body frame is ours: x forward, y right, z down.

[[nodiscard]] std::optional<imu_t> to_imu(const mavlink::HighresImu& message, double averaging_window_s,
                                          rt::Counters& counters);
/// Of SCALED_IMU, SCALED_IMU2 and SCALED_IMU3: sensors 0, 1 and 2.
[[nodiscard]] std::optional<imu_t> to_imu(const mavlink::ScaledImuFields& message, int sensor_id,
                                          double averaging_window_s, rt::Counters& counters);
/// RAW_IMU in milli-g and mrad/s, as ArduPilot sends it. From others its unit is the sensor's own: not to be
/// used.
[[nodiscard]] std::optional<imu_t> to_imu(const mavlink::RawImu& message, double averaging_window_s,
                                          rt::Counters& counters);

[[nodiscard]] std::optional<attitude_t> to_attitude(const mavlink::Attitude& message, rt::Counters& counters);
[[nodiscard]] std::optional<attitude_t> to_attitude(const mavlink::AttitudeQuaternion& message,
                                                    rt::Counters& counters);

[[nodiscard]] std::optional<attitude_setpoint_t> to_setpoint(const mavlink::AttitudeTarget& message,
                                                             rt::Counters& counters);
/// Roll and pitch only.
[[nodiscard]] std::optional<attitude_setpoint_t> to_setpoint(const mavlink::NavControllerOutput& message,
                                                             rt::Counters& counters);

/// Telemetry of the ESCs first_esc, first_esc + 1, ... as one message of all rotors, NaN where there is
/// nothing.
[[nodiscard]] std::optional<esc_status_t> to_esc_status(std::span<const mavlink::EscValues> escs,
                                                        std::size_t first_esc, const MavlinkConfig& config,
                                                        const std::string& source, rt::Counters& counters);

[[nodiscard]] std::optional<rotor_command_t> to_rotor_command(const mavlink::ServoOutputRaw& message,
                                                              const MavlinkConfig& config);
[[nodiscard]] std::optional<rotor_command_t> to_rotor_command(const mavlink::ActuatorOutputStatus& message,
                                                              const MavlinkConfig& config,
                                                              rt::Counters& counters);

/// Airspeed error of NAV_CONTROLLER_OUTPUT, target minus actual. ArduPilot sends cm/s where the message says
/// m/s. NaN while the unit is not known.
[[nodiscard]] double airspeed_error_m_s(float wire, AirspeedErrorUnit unit, Autopilot autopilot);

}  // namespace airworthy::drivers
