#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <tuple>

#include "core/protocol/mavlink/field.h"

namespace airworthy::mavlink {

// The messages Airworthy reads or sends, exactly as on the wire: the dialect's field names, types, units and
// order, because the checksum depends on them. Values with units, and "no data" told apart from a number:
// values.h.

struct Heartbeat {
  static constexpr std::uint32_t kId = 0;
  static constexpr std::string_view kName = "HEARTBEAT";

  std::uint32_t custom_mode{};   ///< the autopilot's own mode word
  std::uint8_t type{};           ///< MAV_TYPE, see constants.h
  std::uint8_t autopilot{};      ///< MAV_AUTOPILOT
  std::uint8_t base_mode{};      ///< bit 7 = armed
  std::uint8_t system_status{};  ///< MAV_STATE
  std::uint8_t mavlink_version{3};

  static constexpr auto fields() {
    return std::tuple{base("custom_mode", &Heartbeat::custom_mode),
                      base("type", &Heartbeat::type),
                      base("autopilot", &Heartbeat::autopilot),
                      base("base_mode", &Heartbeat::base_mode),
                      base("system_status", &Heartbeat::system_status),
                      base("mavlink_version", &Heartbeat::mavlink_version)};
  }
};

struct SysStatus {
  static constexpr std::uint32_t kId = 1;
  static constexpr std::string_view kName = "SYS_STATUS";

  std::uint32_t onboard_control_sensors_present{};  ///< bit set of sensors and subsystems
  std::uint32_t onboard_control_sensors_enabled{};  ///< same bits
  std::uint32_t onboard_control_sensors_health{};   ///< same bits, 1 = healthy
  std::uint16_t load{};                             ///< 0.1 %
  std::uint16_t voltage_battery{};                  ///< mV; 65535 = not sent
  std::int16_t current_battery{};                   ///< 0.01 A; -1 = not sent
  std::uint16_t drop_rate_comm{};                   ///< 0.01 %
  std::uint16_t errors_comm{};
  std::uint16_t errors_count1{};
  std::uint16_t errors_count2{};
  std::uint16_t errors_count3{};
  std::uint16_t errors_count4{};
  std::int8_t battery_remaining{};  ///< %; -1 = not sent
  std::uint32_t onboard_control_sensors_present_extended{};
  std::uint32_t onboard_control_sensors_enabled_extended{};
  std::uint32_t onboard_control_sensors_health_extended{};

  static constexpr auto fields() {
    return std::tuple{base("onboard_control_sensors_present", &SysStatus::onboard_control_sensors_present),
                      base("onboard_control_sensors_enabled", &SysStatus::onboard_control_sensors_enabled),
                      base("onboard_control_sensors_health", &SysStatus::onboard_control_sensors_health),
                      base("load", &SysStatus::load),
                      base("voltage_battery", &SysStatus::voltage_battery),
                      base("current_battery", &SysStatus::current_battery),
                      base("drop_rate_comm", &SysStatus::drop_rate_comm),
                      base("errors_comm", &SysStatus::errors_comm),
                      base("errors_count1", &SysStatus::errors_count1),
                      base("errors_count2", &SysStatus::errors_count2),
                      base("errors_count3", &SysStatus::errors_count3),
                      base("errors_count4", &SysStatus::errors_count4),
                      base("battery_remaining", &SysStatus::battery_remaining),
                      extension("onboard_control_sensors_present_extended",
                                &SysStatus::onboard_control_sensors_present_extended),
                      extension("onboard_control_sensors_enabled_extended",
                                &SysStatus::onboard_control_sensors_enabled_extended),
                      extension("onboard_control_sensors_health_extended",
                                &SysStatus::onboard_control_sensors_health_extended)};
  }
};

struct SystemTime {
  static constexpr std::uint32_t kId = 2;
  static constexpr std::string_view kName = "SYSTEM_TIME";

  std::uint64_t time_unix_usec{};  ///< µs
  std::uint32_t time_boot_ms{};    ///< ms

  static constexpr auto fields() {
    return std::tuple{base("time_unix_usec", &SystemTime::time_unix_usec),
                      base("time_boot_ms", &SystemTime::time_boot_ms)};
  }
};

/// Common to SCALED_IMU, SCALED_IMU2 and SCALED_IMU3.
struct ScaledImuFields {
  std::uint32_t time_boot_ms{};  ///< ms
  std::int16_t xacc{};           ///< milli-g
  std::int16_t yacc{};           ///< milli-g
  std::int16_t zacc{};           ///< milli-g
  std::int16_t xgyro{};          ///< mrad/s
  std::int16_t ygyro{};          ///< mrad/s
  std::int16_t zgyro{};          ///< mrad/s
  std::int16_t xmag{};           ///< mgauss
  std::int16_t ymag{};           ///< mgauss
  std::int16_t zmag{};           ///< mgauss
  std::int16_t temperature{};    ///< 0.01 °C; 0 = no data; a real 0 °C is sent as 1

  static constexpr auto fields() {
    return std::tuple{base("time_boot_ms", &ScaledImuFields::time_boot_ms),
                      base("xacc", &ScaledImuFields::xacc),
                      base("yacc", &ScaledImuFields::yacc),
                      base("zacc", &ScaledImuFields::zacc),
                      base("xgyro", &ScaledImuFields::xgyro),
                      base("ygyro", &ScaledImuFields::ygyro),
                      base("zgyro", &ScaledImuFields::zgyro),
                      base("xmag", &ScaledImuFields::xmag),
                      base("ymag", &ScaledImuFields::ymag),
                      base("zmag", &ScaledImuFields::zmag),
                      extension("temperature", &ScaledImuFields::temperature)};
  }
};

struct ScaledImu : ScaledImuFields {
  static constexpr std::uint32_t kId = 26;
  static constexpr std::string_view kName = "SCALED_IMU";
};

struct RawImu {
  static constexpr std::uint32_t kId = 27;
  static constexpr std::string_view kName = "RAW_IMU";

  std::uint64_t time_usec{};  ///< µs
  std::int16_t xacc{};
  std::int16_t yacc{};
  std::int16_t zacc{};
  std::int16_t xgyro{};
  std::int16_t ygyro{};
  std::int16_t zgyro{};
  std::int16_t xmag{};
  std::int16_t ymag{};
  std::int16_t zmag{};
  std::uint8_t id{};           ///< 0-based
  std::int16_t temperature{};  ///< 0.01 °C; 0 = no data; a real 0 °C is sent as 1

  static constexpr auto fields() {
    return std::tuple{base("time_usec", &RawImu::time_usec), base("xacc", &RawImu::xacc),
                      base("yacc", &RawImu::yacc),           base("zacc", &RawImu::zacc),
                      base("xgyro", &RawImu::xgyro),         base("ygyro", &RawImu::ygyro),
                      base("zgyro", &RawImu::zgyro),         base("xmag", &RawImu::xmag),
                      base("ymag", &RawImu::ymag),           base("zmag", &RawImu::zmag),
                      extension("id", &RawImu::id),          extension("temperature", &RawImu::temperature)};
  }
};

struct ScaledPressure {
  static constexpr std::uint32_t kId = 29;
  static constexpr std::string_view kName = "SCALED_PRESSURE";

  std::uint32_t time_boot_ms{};           ///< ms
  float press_abs{};                      ///< hPa
  float press_diff{};                     ///< hPa
  std::int16_t temperature{};             ///< 0.01 °C
  std::int16_t temperature_press_diff{};  ///< 0.01 °C

  static constexpr auto fields() {
    return std::tuple{
        base("time_boot_ms", &ScaledPressure::time_boot_ms), base("press_abs", &ScaledPressure::press_abs),
        base("press_diff", &ScaledPressure::press_diff), base("temperature", &ScaledPressure::temperature),
        extension("temperature_press_diff", &ScaledPressure::temperature_press_diff)};
  }
};

struct Attitude {
  static constexpr std::uint32_t kId = 30;
  static constexpr std::string_view kName = "ATTITUDE";

  std::uint32_t time_boot_ms{};  ///< ms
  float roll{};                  ///< rad
  float pitch{};                 ///< rad
  float yaw{};                   ///< rad; -π..π
  float rollspeed{};             ///< rad/s
  float pitchspeed{};            ///< rad/s
  float yawspeed{};              ///< rad/s

  static constexpr auto fields() {
    return std::tuple{base("time_boot_ms", &Attitude::time_boot_ms),
                      base("roll", &Attitude::roll),
                      base("pitch", &Attitude::pitch),
                      base("yaw", &Attitude::yaw),
                      base("rollspeed", &Attitude::rollspeed),
                      base("pitchspeed", &Attitude::pitchspeed),
                      base("yawspeed", &Attitude::yawspeed)};
  }
};

struct AttitudeQuaternion {
  static constexpr std::uint32_t kId = 31;
  static constexpr std::string_view kName = "ATTITUDE_QUATERNION";

  std::uint32_t time_boot_ms{};  ///< ms
  float q1{};
  float q2{};
  float q3{};
  float q4{};
  float rollspeed{};   ///< rad/s
  float pitchspeed{};  ///< rad/s
  float yawspeed{};    ///< rad/s
  std::array<float, 4> repr_offset_q{};

  static constexpr auto fields() {
    return std::tuple{base("time_boot_ms", &AttitudeQuaternion::time_boot_ms),
                      base("q1", &AttitudeQuaternion::q1),
                      base("q2", &AttitudeQuaternion::q2),
                      base("q3", &AttitudeQuaternion::q3),
                      base("q4", &AttitudeQuaternion::q4),
                      base("rollspeed", &AttitudeQuaternion::rollspeed),
                      base("pitchspeed", &AttitudeQuaternion::pitchspeed),
                      base("yawspeed", &AttitudeQuaternion::yawspeed),
                      extension("repr_offset_q", &AttitudeQuaternion::repr_offset_q)};
  }
};

struct LocalPositionNed {
  static constexpr std::uint32_t kId = 32;
  static constexpr std::string_view kName = "LOCAL_POSITION_NED";

  std::uint32_t time_boot_ms{};  ///< ms
  float x{};                     ///< m
  float y{};                     ///< m
  float z{};                     ///< m
  float vx{};                    ///< m/s
  float vy{};                    ///< m/s
  float vz{};                    ///< m/s

  static constexpr auto fields() {
    return std::tuple{base("time_boot_ms", &LocalPositionNed::time_boot_ms),
                      base("x", &LocalPositionNed::x),
                      base("y", &LocalPositionNed::y),
                      base("z", &LocalPositionNed::z),
                      base("vx", &LocalPositionNed::vx),
                      base("vy", &LocalPositionNed::vy),
                      base("vz", &LocalPositionNed::vz)};
  }
};

struct ServoOutputRaw {
  static constexpr std::uint32_t kId = 36;
  static constexpr std::string_view kName = "SERVO_OUTPUT_RAW";

  std::uint32_t time_usec{};    ///< µs
  std::uint16_t servo1_raw{};   ///< µs
  std::uint16_t servo2_raw{};   ///< µs
  std::uint16_t servo3_raw{};   ///< µs
  std::uint16_t servo4_raw{};   ///< µs
  std::uint16_t servo5_raw{};   ///< µs
  std::uint16_t servo6_raw{};   ///< µs
  std::uint16_t servo7_raw{};   ///< µs
  std::uint16_t servo8_raw{};   ///< µs
  std::uint8_t port{};          ///< 0 = MAIN, 1 = AUX
  std::uint16_t servo9_raw{};   ///< µs
  std::uint16_t servo10_raw{};  ///< µs
  std::uint16_t servo11_raw{};  ///< µs
  std::uint16_t servo12_raw{};  ///< µs
  std::uint16_t servo13_raw{};  ///< µs
  std::uint16_t servo14_raw{};  ///< µs
  std::uint16_t servo15_raw{};  ///< µs
  std::uint16_t servo16_raw{};  ///< µs

  static constexpr auto fields() {
    return std::tuple{base("time_usec", &ServoOutputRaw::time_usec),
                      base("servo1_raw", &ServoOutputRaw::servo1_raw),
                      base("servo2_raw", &ServoOutputRaw::servo2_raw),
                      base("servo3_raw", &ServoOutputRaw::servo3_raw),
                      base("servo4_raw", &ServoOutputRaw::servo4_raw),
                      base("servo5_raw", &ServoOutputRaw::servo5_raw),
                      base("servo6_raw", &ServoOutputRaw::servo6_raw),
                      base("servo7_raw", &ServoOutputRaw::servo7_raw),
                      base("servo8_raw", &ServoOutputRaw::servo8_raw),
                      base("port", &ServoOutputRaw::port),
                      extension("servo9_raw", &ServoOutputRaw::servo9_raw),
                      extension("servo10_raw", &ServoOutputRaw::servo10_raw),
                      extension("servo11_raw", &ServoOutputRaw::servo11_raw),
                      extension("servo12_raw", &ServoOutputRaw::servo12_raw),
                      extension("servo13_raw", &ServoOutputRaw::servo13_raw),
                      extension("servo14_raw", &ServoOutputRaw::servo14_raw),
                      extension("servo15_raw", &ServoOutputRaw::servo15_raw),
                      extension("servo16_raw", &ServoOutputRaw::servo16_raw)};
  }
};

struct NavControllerOutput {
  static constexpr std::uint32_t kId = 62;
  static constexpr std::string_view kName = "NAV_CONTROLLER_OUTPUT";

  float nav_roll{};               ///< °
  float nav_pitch{};              ///< °
  float alt_error{};              ///< m
  float aspd_error{};             ///< m/s
  float xtrack_error{};           ///< m
  std::int16_t nav_bearing{};     ///< °
  std::int16_t target_bearing{};  ///< °
  std::uint16_t wp_dist{};        ///< m

  static constexpr auto fields() {
    return std::tuple{base("nav_roll", &NavControllerOutput::nav_roll),
                      base("nav_pitch", &NavControllerOutput::nav_pitch),
                      base("alt_error", &NavControllerOutput::alt_error),
                      base("aspd_error", &NavControllerOutput::aspd_error),
                      base("xtrack_error", &NavControllerOutput::xtrack_error),
                      base("nav_bearing", &NavControllerOutput::nav_bearing),
                      base("target_bearing", &NavControllerOutput::target_bearing),
                      base("wp_dist", &NavControllerOutput::wp_dist)};
  }
};

struct VfrHud {
  static constexpr std::uint32_t kId = 74;
  static constexpr std::string_view kName = "VFR_HUD";

  float airspeed{};          ///< m/s; CAS/IAS on standard aircraft
  float groundspeed{};       ///< m/s
  float alt{};               ///< m; MSL
  float climb{};             ///< m/s; positive up
  std::int16_t heading{};    ///< °; 0–360
  std::uint16_t throttle{};  ///< %; 0–100

  static constexpr auto fields() {
    return std::tuple{base("airspeed", &VfrHud::airspeed), base("groundspeed", &VfrHud::groundspeed),
                      base("alt", &VfrHud::alt),           base("climb", &VfrHud::climb),
                      base("heading", &VfrHud::heading),   base("throttle", &VfrHud::throttle)};
  }
};

struct CommandLong {
  static constexpr std::uint32_t kId = 76;
  static constexpr std::string_view kName = "COMMAND_LONG";

  float param1{};
  float param2{};
  float param3{};
  float param4{};
  float param5{};
  float param6{};
  float param7{};
  std::uint16_t command{};
  std::uint8_t target_system{};
  std::uint8_t target_component{};
  std::uint8_t confirmation{};

  static constexpr auto fields() {
    return std::tuple{base("param1", &CommandLong::param1),
                      base("param2", &CommandLong::param2),
                      base("param3", &CommandLong::param3),
                      base("param4", &CommandLong::param4),
                      base("param5", &CommandLong::param5),
                      base("param6", &CommandLong::param6),
                      base("param7", &CommandLong::param7),
                      base("command", &CommandLong::command),
                      base("target_system", &CommandLong::target_system),
                      base("target_component", &CommandLong::target_component),
                      base("confirmation", &CommandLong::confirmation)};
  }
};

struct CommandAck {
  static constexpr std::uint32_t kId = 77;
  static constexpr std::string_view kName = "COMMAND_ACK";

  std::uint16_t command{};
  std::uint8_t result{};
  std::uint8_t progress{};  ///< %
  std::int32_t result_param2{};
  std::uint8_t target_system{};
  std::uint8_t target_component{};

  static constexpr auto fields() {
    return std::tuple{base("command", &CommandAck::command),
                      base("result", &CommandAck::result),
                      extension("progress", &CommandAck::progress),
                      extension("result_param2", &CommandAck::result_param2),
                      extension("target_system", &CommandAck::target_system),
                      extension("target_component", &CommandAck::target_component)};
  }
};

struct AttitudeTarget {
  static constexpr std::uint32_t kId = 83;
  static constexpr std::string_view kName = "ATTITUDE_TARGET";

  std::uint32_t time_boot_ms{};  ///< ms
  std::array<float, 4> q{};      ///< w x y z
  float body_roll_rate{};        ///< rad/s
  float body_pitch_rate{};       ///< rad/s
  float body_yaw_rate{};         ///< rad/s
  float thrust{};                ///< 0..1 (-1..1 reversible)
  std::uint8_t type_mask{};      ///< bit set, attitude_target_ignore

  static constexpr auto fields() {
    return std::tuple{base("time_boot_ms", &AttitudeTarget::time_boot_ms),
                      base("q", &AttitudeTarget::q),
                      base("body_roll_rate", &AttitudeTarget::body_roll_rate),
                      base("body_pitch_rate", &AttitudeTarget::body_pitch_rate),
                      base("body_yaw_rate", &AttitudeTarget::body_yaw_rate),
                      base("thrust", &AttitudeTarget::thrust),
                      base("type_mask", &AttitudeTarget::type_mask)};
  }
};

struct HighresImu {
  static constexpr std::uint32_t kId = 105;
  static constexpr std::string_view kName = "HIGHRES_IMU";

  std::uint64_t time_usec{};  ///< µs since the epoch or since boot
  float xacc{};               ///< m/s²
  float yacc{};               ///< m/s²
  float zacc{};               ///< m/s²
  float xgyro{};              ///< rad/s
  float ygyro{};              ///< rad/s
  float zgyro{};              ///< rad/s
  float xmag{};               ///< gauss
  float ymag{};               ///< gauss
  float zmag{};               ///< gauss
  float abs_pressure{};       ///< hPa
  float diff_pressure{};      ///< hPa
  float pressure_alt{};
  float temperature{};             ///< °C
  std::uint16_t fields_updated{};  ///< bit set, highres_imu_field
  std::uint8_t id{};               ///< 0-based IMU number

  static constexpr auto fields() {
    return std::tuple{base("time_usec", &HighresImu::time_usec),
                      base("xacc", &HighresImu::xacc),
                      base("yacc", &HighresImu::yacc),
                      base("zacc", &HighresImu::zacc),
                      base("xgyro", &HighresImu::xgyro),
                      base("ygyro", &HighresImu::ygyro),
                      base("zgyro", &HighresImu::zgyro),
                      base("xmag", &HighresImu::xmag),
                      base("ymag", &HighresImu::ymag),
                      base("zmag", &HighresImu::zmag),
                      base("abs_pressure", &HighresImu::abs_pressure),
                      base("diff_pressure", &HighresImu::diff_pressure),
                      base("pressure_alt", &HighresImu::pressure_alt),
                      base("temperature", &HighresImu::temperature),
                      base("fields_updated", &HighresImu::fields_updated),
                      extension("id", &HighresImu::id)};
  }
};

struct Timesync {
  static constexpr std::uint32_t kId = 111;
  static constexpr std::string_view kName = "TIMESYNC";

  std::int64_t tc1{};               ///< ns; responder's time, 0 in a request
  std::int64_t ts1{};               ///< ns; requester's time, mirrored in the reply
  std::uint8_t target_system{};     ///< 0 = broadcast
  std::uint8_t target_component{};  ///< 0 = broadcast

  static constexpr auto fields() {
    return std::tuple{base("tc1", &Timesync::tc1), base("ts1", &Timesync::ts1),
                      extension("target_system", &Timesync::target_system),
                      extension("target_component", &Timesync::target_component)};
  }
};

struct ScaledImu2 : ScaledImuFields {
  static constexpr std::uint32_t kId = 116;
  static constexpr std::string_view kName = "SCALED_IMU2";
};

struct ScaledImu3 : ScaledImuFields {
  static constexpr std::uint32_t kId = 129;
  static constexpr std::string_view kName = "SCALED_IMU3";
};

struct BatteryStatus {
  static constexpr std::uint32_t kId = 147;
  static constexpr std::string_view kName = "BATTERY_STATUS";

  std::int32_t current_consumed{};           ///< mAh
  std::int32_t energy_consumed{};            ///< 100 J
  std::int16_t temperature{};                ///< 0.01 °C
  std::array<std::uint16_t, 10> voltages{};  ///< mV
  std::int16_t current_battery{};            ///< 0.01 A
  std::uint8_t id{};
  std::uint8_t battery_function{};
  std::uint8_t type{};
  std::int8_t battery_remaining{};  ///< %
  std::int32_t time_remaining{};    ///< s
  std::uint8_t charge_state{};
  std::array<std::uint16_t, 4> voltages_ext{};  ///< mV
  std::uint8_t mode{};
  std::uint32_t fault_bitmask{};

  static constexpr auto fields() {
    return std::tuple{base("current_consumed", &BatteryStatus::current_consumed),
                      base("energy_consumed", &BatteryStatus::energy_consumed),
                      base("temperature", &BatteryStatus::temperature),
                      base("voltages", &BatteryStatus::voltages),
                      base("current_battery", &BatteryStatus::current_battery),
                      base("id", &BatteryStatus::id),
                      base("battery_function", &BatteryStatus::battery_function),
                      base("type", &BatteryStatus::type),
                      base("battery_remaining", &BatteryStatus::battery_remaining),
                      extension("time_remaining", &BatteryStatus::time_remaining),
                      extension("charge_state", &BatteryStatus::charge_state),
                      extension("voltages_ext", &BatteryStatus::voltages_ext),
                      extension("mode", &BatteryStatus::mode),
                      extension("fault_bitmask", &BatteryStatus::fault_bitmask)};
  }
};

struct EstimatorStatus {
  static constexpr std::uint32_t kId = 230;
  static constexpr std::string_view kName = "ESTIMATOR_STATUS";

  std::uint64_t time_usec{};  ///< µs
  float vel_ratio{};
  float pos_horiz_ratio{};
  float pos_vert_ratio{};
  float mag_ratio{};
  float hagl_ratio{};
  float tas_ratio{};
  float pos_horiz_accuracy{};  ///< m
  float pos_vert_accuracy{};   ///< m
  std::uint16_t flags{};

  static constexpr auto fields() {
    return std::tuple{base("time_usec", &EstimatorStatus::time_usec),
                      base("vel_ratio", &EstimatorStatus::vel_ratio),
                      base("pos_horiz_ratio", &EstimatorStatus::pos_horiz_ratio),
                      base("pos_vert_ratio", &EstimatorStatus::pos_vert_ratio),
                      base("mag_ratio", &EstimatorStatus::mag_ratio),
                      base("hagl_ratio", &EstimatorStatus::hagl_ratio),
                      base("tas_ratio", &EstimatorStatus::tas_ratio),
                      base("pos_horiz_accuracy", &EstimatorStatus::pos_horiz_accuracy),
                      base("pos_vert_accuracy", &EstimatorStatus::pos_vert_accuracy),
                      base("flags", &EstimatorStatus::flags)};
  }
};

struct Vibration {
  static constexpr std::uint32_t kId = 241;
  static constexpr std::string_view kName = "VIBRATION";

  std::uint64_t time_usec{};  ///< µs
  float vibration_x{};
  float vibration_y{};
  float vibration_z{};
  std::uint32_t clipping_0{};
  std::uint32_t clipping_1{};
  std::uint32_t clipping_2{};

  static constexpr auto fields() {
    return std::tuple{
        base("time_usec", &Vibration::time_usec),     base("vibration_x", &Vibration::vibration_x),
        base("vibration_y", &Vibration::vibration_y), base("vibration_z", &Vibration::vibration_z),
        base("clipping_0", &Vibration::clipping_0),   base("clipping_1", &Vibration::clipping_1),
        base("clipping_2", &Vibration::clipping_2)};
  }
};

struct MessageInterval {
  static constexpr std::uint32_t kId = 244;
  static constexpr std::string_view kName = "MESSAGE_INTERVAL";

  std::int32_t interval_us{};  ///< µs
  std::uint16_t message_id{};

  static constexpr auto fields() {
    return std::tuple{base("interval_us", &MessageInterval::interval_us),
                      base("message_id", &MessageInterval::message_id)};
  }
};

struct ExtendedSysState {
  static constexpr std::uint32_t kId = 245;
  static constexpr std::string_view kName = "EXTENDED_SYS_STATE";

  std::uint8_t vtol_state{};
  std::uint8_t landed_state{};

  static constexpr auto fields() {
    return std::tuple{base("vtol_state", &ExtendedSysState::vtol_state),
                      base("landed_state", &ExtendedSysState::landed_state)};
  }
};

struct Statustext {
  static constexpr std::uint32_t kId = 253;
  static constexpr std::string_view kName = "STATUSTEXT";

  std::uint8_t severity{};      ///< 0–7, RFC 5424
  std::array<char, 50> text{};  ///< not terminated when all 50 characters are used
  std::uint16_t id{};           ///< 0 = not chunked
  std::uint8_t chunk_seq{};     ///< 0-based; NUL inside text marks the last chunk

  static constexpr auto fields() {
    return std::tuple{base("severity", &Statustext::severity), base("text", &Statustext::text),
                      extension("id", &Statustext::id), extension("chunk_seq", &Statustext::chunk_seq)};
  }
};

struct EscInfo {
  static constexpr std::uint32_t kId = 290;
  static constexpr std::string_view kName = "ESC_INFO";

  std::uint64_t time_usec{};  ///< µs
  std::array<std::uint32_t, 4> error_count{};
  std::uint16_t counter{};
  std::array<std::uint16_t, 4> failure_flags{};  ///< bit set
  std::array<std::int16_t, 4> temperature{};     ///< 0.01 °C; 32767 = no data
  std::uint8_t index{};                          ///< first ESC of this batch, multiple of 4
  std::uint8_t count{};                          ///< total ESCs over all batches; ignore fields beyond it
  std::uint8_t connection_type{};                ///< 0 PPM, 1 serial, 2 one-shot, 3 I2C, 4 CAN, 5 DShot
  std::uint8_t info{};                           ///< online bitmap

  static constexpr auto fields() {
    return std::tuple{base("time_usec", &EscInfo::time_usec),
                      base("error_count", &EscInfo::error_count),
                      base("counter", &EscInfo::counter),
                      base("failure_flags", &EscInfo::failure_flags),
                      base("temperature", &EscInfo::temperature),
                      base("index", &EscInfo::index),
                      base("count", &EscInfo::count),
                      base("connection_type", &EscInfo::connection_type),
                      base("info", &EscInfo::info)};
  }
};

struct EscStatus {
  static constexpr std::uint32_t kId = 291;
  static constexpr std::string_view kName = "ESC_STATUS";

  std::uint64_t time_usec{};          ///< µs
  std::array<std::int32_t, 4> rpm{};  ///< rpm; negative = reverse
  std::array<float, 4> voltage{};     ///< V
  std::array<float, 4> current{};     ///< A
  std::uint8_t index{};               ///< first ESC of this batch, multiple of 4

  static constexpr auto fields() {
    return std::tuple{base("time_usec", &EscStatus::time_usec), base("rpm", &EscStatus::rpm),
                      base("voltage", &EscStatus::voltage), base("current", &EscStatus::current),
                      base("index", &EscStatus::index)};
  }
};

struct ActuatorOutputStatus {
  static constexpr std::uint32_t kId = 375;
  static constexpr std::string_view kName = "ACTUATOR_OUTPUT_STATUS";

  std::uint64_t time_usec{};         ///< µs
  std::uint32_t active{};            ///< PX4 sends the number of active outputs
  std::array<float, 32> actuator{};  ///< unused channels are 0

  static constexpr auto fields() {
    return std::tuple{base("time_usec", &ActuatorOutputStatus::time_usec),
                      base("active", &ActuatorOutputStatus::active),
                      base("actuator", &ActuatorOutputStatus::actuator)};
  }
};

struct EscTelemetry1To4 {
  static constexpr std::uint32_t kId = 11030;
  static constexpr std::string_view kName = "ESC_TELEMETRY_1_TO_4";

  std::array<std::uint16_t, 4> voltage{};       ///< 0.01 V
  std::array<std::uint16_t, 4> current{};       ///< 0.01 A
  std::array<std::uint16_t, 4> totalcurrent{};  ///< mAh
  std::array<std::uint16_t, 4> rpm{};  ///< mechanical rpm as ArduPilot fills it; 0 also means unknown
  std::array<std::uint16_t, 4> count{};
  std::array<std::uint8_t, 4> temperature{};  ///< °C

  static constexpr auto fields() {
    return std::tuple{base("voltage", &EscTelemetry1To4::voltage),
                      base("current", &EscTelemetry1To4::current),
                      base("totalcurrent", &EscTelemetry1To4::totalcurrent),
                      base("rpm", &EscTelemetry1To4::rpm),
                      base("count", &EscTelemetry1To4::count),
                      base("temperature", &EscTelemetry1To4::temperature)};
  }
};

/// Every message above; the tests walk it.
using AllMessages =
    std::tuple<Heartbeat, SysStatus, SystemTime, ScaledImu, RawImu, ScaledPressure, Attitude,
               AttitudeQuaternion, LocalPositionNed, ServoOutputRaw, NavControllerOutput, VfrHud, CommandLong,
               CommandAck, AttitudeTarget, HighresImu, Timesync, ScaledImu2, ScaledImu3, BatteryStatus,
               EstimatorStatus, Vibration, MessageInterval, ExtendedSysState, Statustext, EscInfo, EscStatus,
               ActuatorOutputStatus, EscTelemetry1To4>;

}  // namespace airworthy::mavlink
