#include "drivers/mavlink/mavlink_translation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/drivers/mavlink_support.h"

namespace airworthy::drivers {
namespace {

constexpr double kG = 9.80665;
constexpr float kNaNf = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinityf = std::numeric_limits<float>::infinity();

class TranslationTest : public ::testing::Test {
 protected:
  std::int64_t refused(const std::string& cause) { return counters_.value("refused." + cause); }
  rt::Counters counters_;
  MavlinkConfig config_ = testing::default_config();
};

TEST_F(TranslationTest, HighresImuIsTakenAsItIs) {
  mavlink::HighresImu message;
  message.xacc = 0.25F;
  message.yacc = -0.5F;
  message.zacc = -9.8125F;
  message.zgyro = 0.125F;
  message.temperature = 41.5F;
  message.fields_updated = 0x103F;
  message.id = 2;
  const auto imu = to_imu(message, 0.005, counters_);
  ASSERT_TRUE(imu);
  EXPECT_EQ(imu->accel_m_s2[0], 0.25);
  EXPECT_EQ(imu->accel_m_s2[1], -0.5);
  EXPECT_EQ(imu->accel_m_s2[2], -9.8125);
  EXPECT_EQ(imu->gyro_rad_s[2], 0.125);
  EXPECT_EQ(imu->temperature_degC, 41.5);
  EXPECT_EQ(imu->sensor_id, 2);
  EXPECT_EQ(imu->averaging_window_s, 0.005);
}

TEST_F(TranslationTest, EachInertialBitIsNeeded) {
  for (unsigned bit = 0; bit < 6; ++bit) {
    mavlink::HighresImu message;
    message.fields_updated = static_cast<std::uint16_t>(0xFFFFU & ~(1U << bit));
    EXPECT_FALSE(to_imu(message, 0.0, counters_)) << bit;
  }
  EXPECT_EQ(refused("imu_not_inertial"), 6);
  mavlink::HighresImu message;
  message.fields_updated = 0x3F;
  message.temperature = 20.0F;
  const auto imu = to_imu(message, 0.0, counters_);
  ASSERT_TRUE(imu);
  EXPECT_TRUE(std::isnan(imu->temperature_degC)) << "its bit is not set";
}

TEST_F(TranslationTest, AnImuValueThatIsNoNumberRefusesTheSample) {
  for (const float bad : {kNaNf, kInfinityf, -kInfinityf, 1e6F}) {
    mavlink::HighresImu message;
    message.fields_updated = 0x3F;
    message.yacc = bad;
    EXPECT_FALSE(to_imu(message, 0.0, counters_));
    message.yacc = 0.0F;
    message.xgyro = bad;
    EXPECT_FALSE(to_imu(message, 0.0, counters_));
  }
  EXPECT_EQ(refused("imu_implausible"), 8);
}

TEST_F(TranslationTest, ScaledImuIsMilliGAndMilliradians) {
  mavlink::ScaledImu message;
  message.xacc = 5;
  message.yacc = -6;
  message.zacc = -1000;
  message.xgyro = 7;
  message.ygyro = -8;
  message.temperature = 4512;
  const auto imu = to_imu(message, 1, 0.1, counters_);
  ASSERT_TRUE(imu);
  EXPECT_NEAR(imu->accel_m_s2[0], 0.005 * kG, 1e-12);
  EXPECT_NEAR(imu->accel_m_s2[1], -0.006 * kG, 1e-12);
  EXPECT_NEAR(imu->accel_m_s2[2], -kG, 1e-12);
  EXPECT_NEAR(imu->gyro_rad_s[0], 0.007, 1e-15);
  EXPECT_NEAR(imu->gyro_rad_s[1], -0.008, 1e-15);
  EXPECT_EQ(imu->temperature_degC, 45.12);
  EXPECT_EQ(imu->sensor_id, 1);
  message.temperature = 0;
  EXPECT_TRUE(std::isnan(to_imu(message, 1, 0.1, counters_)->temperature_degC));
}

TEST_F(TranslationTest, ASaturatedSensorIsNoMeasurement) {
  mavlink::RawImu message;
  message.zacc = 32767;
  EXPECT_FALSE(to_imu(message, 0.0, counters_));
  message.zacc = 0;
  message.ygyro = -32768;
  EXPECT_FALSE(to_imu(message, 0.0, counters_));
  EXPECT_EQ(refused("imu_saturated"), 2);
  message.ygyro = 32766;
  EXPECT_TRUE(to_imu(message, 0.0, counters_));
}

TEST_F(TranslationTest, Attitude) {
  const mavlink::Attitude message{
      .time_boot_ms = 1, .roll = 0.1F, .pitch = -0.2F, .yaw = kNaNf, .rollspeed = 0.01F};
  const auto attitude = to_attitude(message, counters_);
  ASSERT_TRUE(attitude);
  EXPECT_NEAR(attitude->roll_rad, 0.1, 1e-7);
  EXPECT_NEAR(attitude->pitch_rad, -0.2, 1e-7);
  EXPECT_TRUE(std::isnan(attitude->yaw_rad));
  EXPECT_NEAR(attitude->rates_rad_s[0], 0.01, 1e-8);
  EXPECT_FALSE(to_attitude(mavlink::Attitude{.roll = kNaNf}, counters_));
  EXPECT_EQ(refused("attitude_not_finite"), 1);
}

/// Quaternion of yaw, then pitch, then roll, by multiplying the three rotations: another way than the one
/// under test.
std::array<double, 4> quaternion(double roll, double pitch, double yaw) {
  const auto multiply = [](const std::array<double, 4>& a, const std::array<double, 4>& b) {
    return std::array<double, 4>{a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
                                 a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                                 a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
                                 a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
  };
  const std::array<double, 4> about_z{std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)};
  const std::array<double, 4> about_y{std::cos(pitch / 2), 0, std::sin(pitch / 2), 0};
  const std::array<double, 4> about_x{std::cos(roll / 2), std::sin(roll / 2), 0, 0};
  return multiply(multiply(about_z, about_y), about_x);
}

TEST_F(TranslationTest, QuaternionsBecomeEulerAnglesEverywhere) {
  for (double roll = -3.0; roll < 3.1; roll += 0.5) {
    for (double pitch = -1.5; pitch < 1.55; pitch += 0.25) {
      for (double yaw = -3.0; yaw < 3.1; yaw += 0.75) {
        const auto q = quaternion(roll, pitch, yaw);
        const auto attitude = to_attitude(mavlink::AttitudeQuaternion{.q1 = static_cast<float>(q[0]),
                                                                      .q2 = static_cast<float>(q[1]),
                                                                      .q3 = static_cast<float>(q[2]),
                                                                      .q4 = static_cast<float>(q[3])},
                                          counters_);
        ASSERT_TRUE(attitude);
        EXPECT_NEAR(attitude->roll_rad, roll, 1e-5);
        EXPECT_NEAR(attitude->pitch_rad, pitch, 1e-5);
        EXPECT_NEAR(attitude->yaw_rad, yaw, 1e-5);
      }
    }
  }
}

TEST_F(TranslationTest, AQuaternionThatIsNoneIsRefused) {
  EXPECT_FALSE(to_attitude(mavlink::AttitudeQuaternion{}, counters_));
  EXPECT_FALSE(to_attitude(mavlink::AttitudeQuaternion{.q1 = kNaNf}, counters_));
  EXPECT_FALSE(to_attitude(mavlink::AttitudeQuaternion{.q1 = 2.0F}, counters_));
  EXPECT_EQ(refused("quaternion_not_unit"), 3);
  // Straight up: roll and yaw are one angle; no NaN comes of it.
  const auto q = quaternion(0.0, std::numbers::pi / 2, 0.0);
  const auto attitude = to_attitude(
      mavlink::AttitudeQuaternion{.q1 = static_cast<float>(q[0]), .q3 = static_cast<float>(q[2])}, counters_);
  ASSERT_TRUE(attitude);
  EXPECT_NEAR(attitude->pitch_rad, std::numbers::pi / 2, 1e-3);
  EXPECT_FALSE(std::isnan(attitude->roll_rad) || std::isnan(attitude->yaw_rad));
}

TEST_F(TranslationTest, AttitudeTargetHonoursItsMask) {
  const auto q = quaternion(0.2, -0.1, 1.0);
  mavlink::AttitudeTarget message;
  for (std::size_t i = 0; i < 4; ++i) message.q[i] = static_cast<float>(q[i]);
  message.body_roll_rate = 0.5F;
  message.body_pitch_rate = 0.25F;
  message.body_yaw_rate = 0.125F;
  message.thrust = 0.5F;
  auto setpoint = to_setpoint(message, counters_);
  ASSERT_TRUE(setpoint);
  EXPECT_NEAR(setpoint->roll_rad, 0.2, 1e-6);
  EXPECT_NEAR(setpoint->pitch_rad, -0.1, 1e-6);
  EXPECT_NEAR(setpoint->yaw_rad, 1.0, 1e-6);
  EXPECT_EQ(setpoint->rates_rad_s[0], 0.5);
  EXPECT_EQ(setpoint->rates_rad_s[1], 0.25);
  EXPECT_EQ(setpoint->rates_rad_s[2], 0.125);
  EXPECT_EQ(setpoint->thrust_ratio, 0.5);

  message.type_mask = 1 | 4 | 64 | 128;
  setpoint = to_setpoint(message, counters_);
  ASSERT_TRUE(setpoint);
  EXPECT_TRUE(std::isnan(setpoint->roll_rad));
  EXPECT_TRUE(std::isnan(setpoint->rates_rad_s[0]));
  EXPECT_EQ(setpoint->rates_rad_s[1], 0.25);
  EXPECT_TRUE(std::isnan(setpoint->rates_rad_s[2]));
  EXPECT_TRUE(std::isnan(setpoint->thrust_ratio));

  message.type_mask = 0xFF;
  EXPECT_FALSE(to_setpoint(message, counters_));
  EXPECT_EQ(refused("setpoint_empty"), 1);
}

TEST_F(TranslationTest, NavControllerOutputIsDegrees) {
  const auto setpoint =
      to_setpoint(mavlink::NavControllerOutput{.nav_roll = 180.0F, .nav_pitch = -90.0F}, counters_);
  ASSERT_TRUE(setpoint);
  EXPECT_NEAR(setpoint->roll_rad, std::numbers::pi, 1e-12);
  EXPECT_NEAR(setpoint->pitch_rad, -std::numbers::pi / 2, 1e-12);
  EXPECT_TRUE(std::isnan(setpoint->yaw_rad));
  EXPECT_TRUE(std::isnan(setpoint->thrust_ratio));
}

TEST_F(TranslationTest, EscValuesGoToTheirRotors) {
  config_.rotor_of_esc = {3, 0, 1};
  const std::array<mavlink::EscValues, 4> escs{
      mavlink::EscValues{.speed_rpm = -6500.0, .voltage_V = 24.5, .current_A = -0.5},
      mavlink::EscValues{.speed_rpm = 1.0}, mavlink::EscValues{.temperature_degC = 81.0, .error_count = 5},
      mavlink::EscValues{.speed_rpm = 2.0}};
  const auto status = to_esc_status(escs, 0, config_, "ESC_STATUS", counters_);
  ASSERT_TRUE(status);
  EXPECT_EQ(status->rotor_count, 4);
  EXPECT_EQ(status->speed_rpm[2], -6500.0);
  EXPECT_EQ(status->voltage_V[2], 24.5);
  EXPECT_EQ(status->current_A[2], -0.5);
  EXPECT_EQ(status->error_count[2], -1);
  EXPECT_EQ(status->temperature_degC[0], 81.0);
  EXPECT_EQ(status->error_count[0], 5);
  EXPECT_TRUE(std::isnan(status->speed_rpm[0]));
  EXPECT_TRUE(std::isnan(status->speed_rpm[1]));
  EXPECT_TRUE(std::isnan(status->speed_rpm[3]));
  EXPECT_EQ(refused("esc_not_mapped"), 2) << "mapped to nothing, and beyond the map";
  EXPECT_FALSE(to_esc_status(escs, 28, config_, "ESC_STATUS", counters_)) << "none of them is ours";
}

TEST_F(TranslationTest, EscValuesThatCannotBeTrueAreNotNumbers) {
  const std::array<mavlink::EscValues, 4> escs{
      mavlink::EscValues{.speed_rpm = 1e7, .temperature_degC = 314.0},
      mavlink::EscValues{.voltage_V = 1e30, .temperature_degC = -100.0}, mavlink::EscValues{},
      mavlink::EscValues{.temperature_degC = 250.0}};
  const auto status = to_esc_status(escs, 0, config_, "ESC_STATUS", counters_);
  ASSERT_TRUE(status);
  EXPECT_TRUE(std::isnan(status->speed_rpm[0]));
  EXPECT_TRUE(std::isnan(status->temperature_degC[0])) << "41 °C in kelvin";
  EXPECT_TRUE(std::isnan(status->voltage_V[1]));
  EXPECT_TRUE(std::isnan(status->temperature_degC[1]));
  EXPECT_EQ(status->temperature_degC[3], 250.0);
  EXPECT_EQ(refused("implausible_value"), 4);
}

TEST_F(TranslationTest, ServoPulsesBecomeRatiosThroughTheMap) {
  config_.outputs = {{.output = 3, .port = 0, .rotor = 1, .stopped = 1000, .full = 2000},
                     {.output = 9, .port = 0, .rotor = 2, .stopped = 2000, .full = 1000},
                     {.output = 1, .port = 1, .rotor = 4}};
  mavlink::ServoOutputRaw message;
  message.servo1_raw = 1500;
  message.servo3_raw = 1250;
  message.servo9_raw = 1250;
  auto command = to_rotor_command(message, config_);
  ASSERT_TRUE(command);
  EXPECT_EQ(command->rotor_count, 4);
  EXPECT_EQ(command->command_ratio[0], 0.25);
  EXPECT_EQ(command->command_ratio[1], 0.75) << "reversed";
  EXPECT_TRUE(std::isnan(command->command_ratio[2]));
  EXPECT_TRUE(std::isnan(command->command_ratio[3])) << "another port";
  message.servo3_raw = 900;
  message.servo9_raw = 65535;
  command = to_rotor_command(message, config_);
  ASSERT_TRUE(command);
  EXPECT_EQ(command->command_ratio[0], 0.0) << "disarmed";
  EXPECT_TRUE(std::isnan(command->command_ratio[1])) << "no data";
  message.servo3_raw = 0;
  EXPECT_FALSE(to_rotor_command(message, config_));
}

TEST_F(TranslationTest, ActuatorOutputsBeyondTheActiveOnesAreUnknown) {
  config_.outputs = {{.output = 1, .rotor = 1, .stopped = 0, .full = 1},
                     {.output = 2, .rotor = 2, .stopped = 0, .full = 1}};
  mavlink::ActuatorOutputStatus message;
  message.active = 1;
  message.actuator[0] = 0.5F;
  auto command = to_rotor_command(message, config_, counters_);
  ASSERT_TRUE(command);
  EXPECT_EQ(command->command_ratio[0], 0.5);
  EXPECT_TRUE(std::isnan(command->command_ratio[1]));
  message.actuator[0] = kNaNf;
  EXPECT_FALSE(to_rotor_command(message, config_, counters_));
}

TEST_F(TranslationTest, AirspeedErrorHasTheAutopilotsUnit) {
  using Unit = AirspeedErrorUnit;
  EXPECT_EQ(airspeed_error_m_s(250.0F, Unit::kByAutopilot, Autopilot::kArdupilot), 2.5);
  EXPECT_EQ(airspeed_error_m_s(2.5F, Unit::kByAutopilot, Autopilot::kPx4), 2.5);
  EXPECT_TRUE(std::isnan(airspeed_error_m_s(2.5F, Unit::kByAutopilot, Autopilot::kUnknown)));
  EXPECT_EQ(airspeed_error_m_s(250.0F, Unit::kCentimetresPerSecond, Autopilot::kPx4), 2.5);
  EXPECT_EQ(airspeed_error_m_s(2.5F, Unit::kMetresPerSecond, Autopilot::kArdupilot), 2.5);
  EXPECT_TRUE(std::isnan(airspeed_error_m_s(kNaNf, Unit::kMetresPerSecond, Autopilot::kPx4)));
}

}  // namespace
}  // namespace airworthy::drivers
