#include <gtest/gtest.h>

#include <string>

#include "core/protocol/mavlink/crc.h"
#include "core/protocol/mavlink/message_table.h"
#include "core/protocol/mavlink/messages.h"
#include "core/protocol/mavlink/parser.h"
#include "core/protocol/mavlink/values.h"
#include "tests/core/protocol/mavlink_vectors.h"

namespace airworthy::mavlink {
namespace {

using testing::bytes_of;
using testing::Vector;

/// The only frame of a vector.
Frame frame_of(const Vector& vector) {
  Parser parser;
  std::vector<Frame> frames;
  const auto bytes = bytes_of(vector);
  parser.push(bytes, [&](const Frame& frame) { frames.push_back(frame); });
  EXPECT_EQ(frames.size(), 1U) << vector.name;
  return frames.empty() ? Frame{} : frames.front();
}

template <class Message>
Message message_of(const Vector& vector) {
  const Frame frame = frame_of(vector);
  EXPECT_EQ(frame.message_id, Message::kId);
  return decode<Message>(frame);
}

/// Calls `visit.operator()<Message>()` for every message we know.
template <class Visitor>
void for_each_message(Visitor&& visit) {
  const auto each = [&]<class... Message>(std::tuple<Message...>*) {
    (visit.template operator()<Message>(), ...);
  };
  each(static_cast<AllMessages*>(nullptr));
}

TEST(MavlinkCrc, MatchesTheCheckValueOfItsDefinition) {
  Crc16 crc;
  for (const char c : std::string{"123456789"}) crc.add(static_cast<std::uint8_t>(c));
  EXPECT_EQ(crc.value(), 0x6F91);
}

TEST(MavlinkMessageTable, IsSortedAndFound) {
  const auto table = message_table();
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (i > 0) {
      EXPECT_LT(table[i - 1].id, table[i].id);
    }
    EXPECT_LE(table[i].min_length, table[i].max_length) << table[i].name;
    EXPECT_EQ(find_message(table[i].id), &table[i]);
  }
  EXPECT_EQ(find_message(3), nullptr);
  EXPECT_EQ(find_message(0xFFFFFF), nullptr);
}

// The seed hashes the message's name and each field's type, name and array length in wire order, so equality
// shows that the definitions are the dialect's.
TEST(MavlinkMessages, DefinitionsHashToThePublishedSeeds) {
  for_each_message([]<class Message>() {
    const MessageInfo* info = find_message(Message::kId);
    ASSERT_NE(info, nullptr) << Message::kName;
    EXPECT_EQ(info->name, Message::kName);
    EXPECT_EQ(info->crc_extra, crc_extra_of<Message>()) << Message::kName;
    EXPECT_EQ(info->min_length, kMinLength<Message>) << Message::kName;
    EXPECT_EQ(info->max_length, kMaxLength<Message>) << Message::kName;
  });
}

TEST(MavlinkMessages, BaseFieldsAreOrderedBySizeAndExtensionsComeLast) {
  for_each_message([]<class Message>() {
    std::size_t last_size = 8;
    bool seen_extension = false;
    for_each_field<Message>([&]<class Owner, class T>(const Field<Owner, T>& field) {
      if (field.is_extension) {
        seen_extension = true;
        return;
      }
      EXPECT_FALSE(seen_extension) << Message::kName << "." << field.name;
      const std::size_t size = sizeof(typename WireType<T>::Element);
      EXPECT_LE(size, last_size) << Message::kName << "." << field.name;
      last_size = size;
    });
  });
}

// Every byte of the payload belongs to one field: what decodes and encodes again is unchanged, whatever the
// bytes.
TEST(MavlinkMessages, DecodeAndEncodeAreInverse) {
  for_each_message([]<class Message>() {
    Frame frame;
    for (std::size_t i = 0; i < kMaxLength<Message>; ++i) {
      frame.payload[i] = static_cast<std::uint8_t>(37 * i + 11);
    }
    std::array<std::uint8_t, kMaxPayload> again{};
    encode_payload(decode<Message>(frame), again);
    EXPECT_EQ(again, frame.payload) << Message::kName;
  });
}

template <class Message>
void expect_same_bytes(const Vector& vector) {
  const Frame frame = frame_of(vector);
  ASSERT_EQ(frame.message_id, Message::kId) << vector.name;
  Frame again = make_frame(decode<Message>(frame), {frame.system_id, frame.component_id, frame.version},
                           frame.sequence);
  again.signature = frame.signature;
  const EncodedFrame encoded = encode_frame(again, crc_extra_of<Message>());
  const auto view = encoded.view();
  EXPECT_EQ(std::vector<std::uint8_t>(view.begin(), view.end()), bytes_of(vector)) << vector.name;
}

TEST(MavlinkVectors, DecodeAndEncodeToTheSameBytes) {
  int checked = 0;
  for (const Vector& vector : testing::kAllVectors) {
    const std::uint32_t id = frame_of(vector).message_id;
    for_each_message([&]<class Message>() {
      if (Message::kId != id) return;
      expect_same_bytes<Message>(vector);
      ++checked;
    });
  }
  EXPECT_EQ(checked, 17);
}

TEST(MavlinkVectors, Heartbeat) {
  for (const Vector& vector : {testing::kHeartbeat, testing::kHeartbeatV1, testing::kHeartbeatSigned}) {
    const auto message = message_of<Heartbeat>(vector);
    EXPECT_EQ(message.custom_mode, 0x04030000U);
    EXPECT_EQ(message.type, 2);
    EXPECT_EQ(message.autopilot, 12);
    EXPECT_EQ(message.base_mode, 0xD1);
    EXPECT_EQ(message.system_status, 4);
    EXPECT_EQ(message.mavlink_version, 3);
  }
  EXPECT_EQ(frame_of(testing::kHeartbeatV1).version, 1);
}

TEST(MavlinkVectors, SignatureIsRead) {
  EXPECT_FALSE(frame_of(testing::kHeartbeat).signature.has_value());
  const Frame frame = frame_of(testing::kHeartbeatSigned);
  ASSERT_TRUE(frame.signature.has_value());
  EXPECT_EQ(frame.signature->link_id, 1);
  EXPECT_EQ(frame.signature->timestamp, 0x123456789AU);
  EXPECT_EQ(frame.signature->digest, (std::array<std::uint8_t, 6>{0xff, 0xfb, 0xeb, 0x3b, 0x29, 0x40}));
}

TEST(MavlinkVectors, Attitude) {
  const auto message = message_of<Attitude>(testing::kAttitude);
  EXPECT_EQ(message.time_boot_ms, 123456U);
  EXPECT_FLOAT_EQ(message.roll, 0.1F);
  EXPECT_FLOAT_EQ(message.pitch, -0.2F);
  EXPECT_FLOAT_EQ(message.yaw, 1.5F);
  EXPECT_FLOAT_EQ(message.rollspeed, 0.01F);
  EXPECT_FLOAT_EQ(message.pitchspeed, -0.02F);
  EXPECT_FLOAT_EQ(message.yawspeed, 0.03F);
}

TEST(MavlinkVectors, EscStatus) {
  const auto message = message_of<EscStatus>(testing::kEscStatus);
  EXPECT_EQ(message.time_usec, 123456789U);
  EXPECT_EQ(message.rpm, (std::array<std::int32_t, 4>{6543, -6500, 6600, 0}));
  EXPECT_EQ(message.voltage, (std::array<float, 4>{24.5F, 24.4F, 24.3F, 0.0F}));
  EXPECT_EQ(message.current, (std::array<float, 4>{5.5F, 5.25F, 5.0F, 0.0F}));
  EXPECT_EQ(message.index, 0);
  EXPECT_EQ(esc_values(message, 1).speed_rpm, -6500.0);
  EXPECT_EQ(esc_values(message, 3).speed_rpm, std::nullopt) << "all zero: no such ESC";
}

TEST(MavlinkVectors, EscInfo) {
  const auto message = message_of<EscInfo>(testing::kEscInfo);
  EXPECT_EQ(message.time_usec, 5000000U);
  EXPECT_EQ(message.error_count, (std::array<std::uint32_t, 4>{0, 1, 2, 3}));
  EXPECT_EQ(message.counter, 77);
  EXPECT_EQ(message.failure_flags, (std::array<std::uint16_t, 4>{0, 0, 4, 0}));
  EXPECT_EQ(message.temperature, (std::array<std::int16_t, 4>{3550, 3600, 8100, 32767}));
  EXPECT_EQ(message.count, 4);
  EXPECT_EQ(message.connection_type, 4);
  EXPECT_EQ(message.info, 7);
  EXPECT_EQ(esc_values(message, 0).temperature_degC, 35.5);
  EXPECT_EQ(esc_values(message, 2).error_count, 2);
  EXPECT_EQ(esc_values(message, 3).error_count, std::nullopt) << "offline by the bitmap";
}

TEST(MavlinkVectors, Statustext) {
  const auto message = message_of<Statustext>(testing::kStatustext);
  EXPECT_EQ(message.severity, 4);
  EXPECT_EQ(text_of(message), "uavhm: motor 3 unbalance");
  EXPECT_EQ(frame_of(testing::kStatustext).component_id, 191);
}

TEST(MavlinkVectors, Timesync) {
  const auto message = message_of<Timesync>(testing::kTimesync);
  EXPECT_EQ(message.tc1, 0);
  EXPECT_EQ(message.ts1, 1234567890123456789);
}

TEST(MavlinkVectors, HighresImu) {
  const auto message = message_of<HighresImu>(testing::kHighresImu);
  EXPECT_EQ(message.time_usec, 987654321U);
  EXPECT_EQ(message.xacc, 0.25F);
  EXPECT_EQ(message.yacc, -0.5F);
  EXPECT_EQ(message.zacc, -9.8125F);
  EXPECT_EQ(message.xgyro, 0.015625F);
  EXPECT_EQ(message.ygyro, -0.03125F);
  EXPECT_EQ(message.fields_updated, 63);
}

TEST(MavlinkVectors, SysStatus) {
  const auto message = message_of<SysStatus>(testing::kSysStatus);
  EXPECT_EQ(message.onboard_control_sensors_present, 0x4000802FU);
  EXPECT_EQ(message.onboard_control_sensors_health, 0x0000802FU);
  EXPECT_EQ(message.load, 435);
  EXPECT_EQ(battery_voltage_V(message), 22.8);
  EXPECT_EQ(battery_current_A(message), 12.34);
  EXPECT_EQ(battery_remaining_ratio(message), 0.87);
}

TEST(MavlinkVectors, RawAndScaledImu) {
  const auto raw = message_of<RawImu>(testing::kRawImu);
  EXPECT_EQ(raw.time_usec, 1000000U);
  EXPECT_EQ(raw.xacc, 10);
  EXPECT_EQ(raw.yacc, -20);
  EXPECT_EQ(raw.zacc, -1000);
  EXPECT_EQ(raw.zgyro, 3);
  EXPECT_EQ(raw.ymag, -200);
  EXPECT_EQ(raw.id, 1);
  EXPECT_EQ(imu_temperature_degC(raw.temperature), 45.12);
  const auto scaled = message_of<ScaledImu>(testing::kScaledImu);
  EXPECT_EQ(scaled.time_boot_ms, 1000U);
  EXPECT_EQ(scaled.zacc, -1001);
  EXPECT_EQ(scaled.ygyro, -8);
  EXPECT_EQ(imu_temperature_degC(scaled.temperature), 0.01);
}

TEST(MavlinkVectors, ServoOutputRaw) {
  const auto message = message_of<ServoOutputRaw>(testing::kServoOutputRaw);
  EXPECT_EQ(message.time_usec, 2000000U);
  EXPECT_EQ(servo_pulse_us(message, 1), 1500.0);
  EXPECT_EQ(servo_pulse_us(message, 4), 1505.0);
  EXPECT_EQ(servo_pulse_us(message, 5), std::nullopt);
  EXPECT_EQ(servo_pulse_us(message, 0), std::nullopt);
  EXPECT_EQ(servo_pulse_us(message, 17), std::nullopt);
}

TEST(MavlinkVectors, AttitudeTarget) {
  const auto message = message_of<AttitudeTarget>(testing::kAttitudeTarget);
  EXPECT_EQ(message.time_boot_ms, 3000U);
  EXPECT_EQ(message.q, (std::array<float, 4>{1.0F, 0.0F, 0.0F, 0.0F}));
  EXPECT_EQ(message.body_yaw_rate, 0.25F);
  EXPECT_EQ(message.thrust, 0.5F);
  EXPECT_EQ(message.type_mask, 0);
}

TEST(MavlinkVectors, NavControllerOutputAndVfrHud) {
  const auto nav = message_of<NavControllerOutput>(testing::kNavControllerOutput);
  EXPECT_EQ(nav.nav_roll, 2.5F);
  EXPECT_EQ(nav.nav_pitch, -1.25F);
  EXPECT_EQ(nav.alt_error, 0.5F);
  EXPECT_EQ(nav.aspd_error, 0.0F);
  EXPECT_EQ(nav.xtrack_error, -3.0F);
  EXPECT_EQ(nav.nav_bearing, 90);
  EXPECT_EQ(nav.target_bearing, 91);
  EXPECT_EQ(nav.wp_dist, 250);
  const auto hud = message_of<VfrHud>(testing::kVfrHud);
  EXPECT_EQ(hud.airspeed, 12.5F);
  EXPECT_EQ(hud.groundspeed, 13.0F);
  EXPECT_EQ(hud.alt, 120.5F);
  EXPECT_EQ(hud.climb, -0.5F);
  EXPECT_EQ(hud.heading, 271);
  EXPECT_EQ(hud.throttle, 63);
}

TEST(MavlinkVectors, ActuatorOutputStatus) {
  const auto message = message_of<ActuatorOutputStatus>(testing::kActuatorOutputStatus);
  EXPECT_EQ(message.time_usec, 6000000U);
  EXPECT_EQ(message.active, 4U);
  EXPECT_FLOAT_EQ(message.actuator[0], 0.5F);
  EXPECT_FLOAT_EQ(message.actuator[3], 0.505F);
  EXPECT_EQ(message.actuator[4], 0.0F);
}

TEST(MavlinkFrame, TruncationNeverCutsTheFirstByte) {
  EXPECT_EQ(make_frame(ExtendedSysState{}, {1, 1}, 0).length, 1);
  EXPECT_EQ(make_frame(ExtendedSysState{0, 2}, {1, 1}, 0).length, 2);
}

TEST(MavlinkFrame, VersionOneSendsBaseFieldsOnlyAndAllOfThem) {
  RawImu message;
  message.xacc = 5;
  message.id = 1;
  message.temperature = 100;
  const Frame frame = make_frame(message, {1, 1, 1}, 0);
  EXPECT_EQ(frame.length, 26);
  const EncodedFrame encoded = encode(message, {1, 1, 1}, 0);
  EXPECT_EQ(encoded.size, 6U + 26U + 2U);
  Parser parser;
  int frames = 0;
  parser.push(encoded.view(), [&](const Frame& received) {
    ++frames;
    EXPECT_EQ(decode<RawImu>(received).xacc, 5);
    EXPECT_EQ(decode<RawImu>(received).id, 0);
  });
  EXPECT_EQ(frames, 1);
}

TEST(MavlinkValues, NoDataIsEmptyAndNeverANumber) {
  SysStatus status;
  status.voltage_battery = 65535;
  status.current_battery = -1;
  status.battery_remaining = -1;
  EXPECT_EQ(battery_voltage_V(status), std::nullopt);
  EXPECT_EQ(battery_current_A(status), std::nullopt);
  EXPECT_EQ(battery_remaining_ratio(status), std::nullopt);

  BatteryStatus battery;
  battery.voltages.fill(65535);
  battery.current_battery = -1;
  battery.temperature = 32767;
  EXPECT_EQ(battery_voltage_V(battery), std::nullopt);
  EXPECT_EQ(battery_current_A(battery), std::nullopt);
  EXPECT_EQ(battery_temperature_degC(battery), std::nullopt);
  battery.voltages[0] = 4100;
  battery.voltages[1] = 4150;
  EXPECT_EQ(battery_voltage_V(battery), 8.25);

  EXPECT_EQ(imu_temperature_degC(0), std::nullopt);

  EscInfo info;
  info.count = 2;
  info.info = 0xFF;
  info.temperature = {32767, -4000, 2000, 2000};
  EXPECT_EQ(esc_values(info, 0).temperature_degC, std::nullopt);
  EXPECT_EQ(esc_values(info, 1).temperature_degC, -40.0);
  EXPECT_EQ(esc_values(info, 2).temperature_degC, std::nullopt) << "beyond the number of ESCs";

  EscStatus esc;
  esc.rpm = {100, 0, 0, 0};
  esc.voltage = {std::numeric_limits<float>::quiet_NaN(), 12.0F, 0.0F, 0.0F};
  EXPECT_EQ(esc_values(esc, 0).voltage_V, std::nullopt);
  EXPECT_EQ(esc_values(esc, 0).speed_rpm, 100.0);
  EXPECT_EQ(esc_values(esc, 1).speed_rpm, 0.0) << "powered and standing still";
  EXPECT_EQ(esc_values(esc, 2).speed_rpm, std::nullopt);

  EscTelemetry1To4 telemetry;
  telemetry.voltage = {1660, 0, 0, 0};
  telemetry.rpm = {4000, 0, 0, 0};
  telemetry.current = {250, 0, 0, 0};
  EXPECT_EQ(esc_values(telemetry, 0).voltage_V, 16.6);
  EXPECT_EQ(esc_values(telemetry, 0).current_A, 2.5);
  EXPECT_EQ(esc_values(telemetry, 0).temperature_degC, std::nullopt);
  EXPECT_EQ(esc_values(telemetry, 1).voltage_V, std::nullopt);

  ServoOutputRaw servo;
  servo.servo2_raw = 65535;
  servo.servo16_raw = 1900;
  EXPECT_EQ(servo_pulse_us(servo, 2), std::nullopt);
  EXPECT_EQ(servo_pulse_us(servo, 16), 1900.0);

  Statustext text;
  text.text.fill('x');
  EXPECT_EQ(text_of(text), std::string(50, 'x'));
}

}  // namespace
}  // namespace airworthy::mavlink
