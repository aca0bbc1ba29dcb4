#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace airworthy::mavlink::testing {

/// Frames made by an independent implementation of the protocol.
struct Vector {
  std::string_view name;
  std::string_view hex;
};

/// HEARTBEAT (PX4 quad, armed, active, mode word 0x04030000)
inline constexpr Vector kHeartbeat{"Heartbeat", "fd09000000010100000000000304020cd10403d3bc"};
/// ATTITUDE t=123456 ms, rpy .1 -.2 1.5 rad, rates .01 -.02 .03 rad/s
inline constexpr Vector kAttitude{
    "Attitude", "fd1c00000101011e000040e20100cdcccc3dcdcc4cbe0000c03f0ad7233c0ad7a3bc8fc2f53cf5fc"};
/// ESC_STATUS t=123456789 us; rpm 6543,-6500,6600,0; V 24.5,24.4,24.3,0; A 5.5,5.25,5,0; index 0
inline constexpr Vector kEscStatus{
    "EscStatus",
    "fd34000002010123010015cd5b07000000008f1900009ce6ffffc8190000000000000000c4413333c3416666c2410000"
    "00000000b0400000a8400000a0402f2f"};
/// STATUSTEXT from comp 191, severity 4, "uavhm: motor 3 unbalance"
inline constexpr Vector kStatustext{
    "Statustext", "fd1900000301bffd000004756176686d3a206d6f746f72203320756e62616c616e63651800"};
/// TIMESYNC request from comp 191, ts1=1234567890123456789, tc1=0
inline constexpr Vector kTimesync{"Timesync", "fd1000000401bf6f000000000000000000001581e97df4102211d83c"};
/// HIGHRES_IMU t=987654321 us, acc .25 -.5 -9.8125, gyro .015625 -.03125 0, fields_updated 63
inline constexpr Vector kHighresImu{
    "HighresImu",
    "fd3d0000050101690000b168de3a000000000000803e000000bf00001dc10000803c000000bd00000000000000000000"
    "000000000000000000000000000000000000000000003ff35a"};
/// SYS_STATUS present=enabled=0x4000802F, health=0x0000802F, load 435 d%, 22800 mV, 1234 cA, drop 0, 87 %
inline constexpr Vector kSysStatus{
    "SysStatus", "fd1f00000601010100002f8000402f8000402f800000b3011059d204000000000000000000000000573794"};
/// RAW_IMU t=1000000 us, acc 10 -20 -1000, gyro 1 -2 3, mag 100 -200 300, id 1, temp 4512 cdegC
inline constexpr Vector kRawImu{
    "RawImu", "fd1d00000701011b000040420f00000000000a00ecff18fc0100feff0300640038ff2c0101a0116ffc"};
/// SCALED_IMU t=1000 ms, acc 5 -6 -1001 mG, gyro 7 -8 9 mrad/s, mag 0, temp 1 cdegC
inline constexpr Vector kScaledImu{"ScaledImu",
                                   "fd1700000801011a0000e80300000500faff17fc0700f8ff0900000000000000017c3f"};
/// SERVO_OUTPUT_RAW t=2000000 us, 1500 1510 1490 1505, rest 0, port 0 (truncated to 12)
inline constexpr Vector kServoOutputRaw{"ServoOutputRaw", "fd0c000009010124000080841e00dc05e605d205e10532fc"};
/// ATTITUDE_TARGET t=3000 ms, q 1 0 0 0, rates 0 0 .25, thrust .5, type_mask 0
inline constexpr Vector kAttitudeTarget{
    "AttitudeTarget",
    "fd2400000a0101530000b80b00000000803f00000000000000000000000000000000000000000000803e0000003fd0a6"};
/// NAV_CONTROLLER_OUTPUT roll 2.5 pitch -1.25 alt_err .5 aspd_err 0 xtrack -3 bearing 90/91 dist 250
inline constexpr Vector kNavControllerOutput{
    "NavControllerOutput", "fd1900000b01013e0000000020400000a0bf0000003f00000000000040c05a005b00fa0cbe"};
/// VFR_HUD as 12.5 gs 13 alt 120.5 climb -.5 hdg 271 thr 63
inline constexpr Vector kVfrHud{"VfrHud", "fd1300000c01014a000000004841000050410000f142000000bf0f013fc525"};
/// ESC_INFO t=5000000 us, errors 0 1 2 3, counter 77, flags 0 0 4 0, temp 3550 3600 8100 32767, index 0,
/// count 4, conn 4 (CAN), info 7
inline constexpr Vector kEscInfo{
    "EscInfo",
    "fd2e00000d0101220100404b4c0000000000000000000100000002000000030000004d000000000004000000de0d100e"
    "a41fff7f000404072425"};
/// ACTUATOR_OUTPUT_STATUS t=6000000 us, active 4, actuators .5 .51 .49 .505, rest 0 (truncated to 28)
inline constexpr Vector kActuatorOutputStatus{
    "ActuatorOutputStatus",
    "fd1c00000e0101770100808d5b0000000000040000000000003f5c8f023f48e1fa3eae47013f8e55"};
/// v1 framing of the same HEARTBEAT
inline constexpr Vector kHeartbeatV1{"HeartbeatV1", "fe090001010000000304020cd10403497f"};
/// Signed HEARTBEAT: key bytes 00..1f, link id 1, timestamp 0x123456789A
inline constexpr Vector kHeartbeatSigned{
    "HeartbeatSigned", "fd09010000010100000000000304020cd104033444019a7856341200fffbeb3b2940"};

inline const std::vector<Vector> kAllVectors{kHeartbeat,      kAttitude,       kEscStatus,
                                             kStatustext,     kTimesync,       kHighresImu,
                                             kSysStatus,      kRawImu,         kScaledImu,
                                             kServoOutputRaw, kAttitudeTarget, kNavControllerOutput,
                                             kVfrHud,         kEscInfo,        kActuatorOutputStatus,
                                             kHeartbeatV1,    kHeartbeatSigned};

inline std::vector<std::uint8_t> bytes_of(std::string_view hex) {
  const auto digit = [](char c) { return static_cast<unsigned>(c <= '9' ? c - '0' : c - 'a' + 10); };
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(digit(hex[i]) << 4U | digit(hex[i + 1])));
  }
  return bytes;
}
inline std::vector<std::uint8_t> bytes_of(const Vector& vector) { return bytes_of(vector.hex); }

}  // namespace airworthy::mavlink::testing
