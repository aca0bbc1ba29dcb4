#pragma once

#include <cstddef>
#include <cstdint>

namespace airworthy::mavlink {

inline constexpr std::uint8_t kAutopilotComponent = 1;
inline constexpr std::uint8_t kOnboardComputerComponent = 191;

/// HEARTBEAT.autopilot
inline constexpr std::uint8_t kAutopilotArdupilot = 3;
inline constexpr std::uint8_t kAutopilotInvalid = 8;  ///< the sender is no autopilot
inline constexpr std::uint8_t kAutopilotPx4 = 12;

/// HEARTBEAT.type
inline constexpr std::uint8_t kTypeGroundStation = 6;
inline constexpr std::uint8_t kTypeOnboardController = 18;

/// HEARTBEAT.base_mode
inline constexpr std::uint8_t kModeFlagArmed = 128;

/// HEARTBEAT.system_status
inline constexpr std::uint8_t kStateActive = 4;

/// HIGHRES_IMU.fields_updated
inline constexpr std::uint16_t kHighresImuInertial = 0x003F;  ///< all of accelerometer and gyroscope
inline constexpr std::uint16_t kHighresImuTemperature = 0x1000;

/// ATTITUDE_TARGET.type_mask: what the message does not command.
inline constexpr std::uint8_t kIgnoreRollRate = 1;
inline constexpr std::uint8_t kIgnorePitchRate = 2;
inline constexpr std::uint8_t kIgnoreYawRate = 4;
inline constexpr std::uint8_t kIgnoreThrottle = 64;
inline constexpr std::uint8_t kIgnoreAttitude = 128;

/// COMMAND_LONG.command
inline constexpr std::uint16_t kCommandSetMessageInterval = 511;

/// ESCs in one ESC_INFO, ESC_STATUS or ESC_TELEMETRY message.
inline constexpr std::size_t kEscsPerMessage = 4;

}  // namespace airworthy::mavlink
