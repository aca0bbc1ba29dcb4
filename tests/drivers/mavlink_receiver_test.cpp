#include "drivers/mavlink/mavlink_receiver.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/drivers/mavlink_support.h"

namespace airworthy::drivers {
namespace {

constexpr std::int64_t kStart_us = 10'000'000'000;

class ReceiverTest : public ::testing::Test {
 protected:
  explicit ReceiverTest(MavlinkConfig config = testing::default_config()) : config_{std::move(config)} {}

  template <class Message>
  void send(const Message& message, std::int64_t after_ms = 0, std::uint8_t system = 1,
            std::uint8_t component = 1) {
    now_ += Duration{after_ms * 1000};
    receiver_.on_frame(mavlink::make_frame(message, {system, component}, 0), now_);
  }
  void hear(std::uint8_t autopilot) { send(testing::heartbeat(autopilot)); }
  std::int64_t count(const std::string& name) { return counters_.value(name); }
  static mavlink::HighresImu highres(std::uint64_t time_usec, std::uint8_t id = 0) {
    mavlink::HighresImu message;
    message.time_usec = time_usec;
    message.fields_updated = 0x3F;
    message.id = id;
    return message;
  }

  MavlinkConfig config_;
  testing::RecordingSink sink_;
  rt::Counters counters_;
  rt::Log log_{"test", rt::LogLevel::kError};
  MavlinkReceiver receiver_{config_, sink_, counters_, log_};
  TimePoint now_ = from_us(kStart_us);
};

TEST_F(ReceiverTest, NothingCountsBeforeAnAutopilotIsHeard) {
  send(mavlink::Attitude{.time_boot_ms = 1});
  EXPECT_TRUE(sink_.attitude.empty());
  EXPECT_EQ(count("frames.before_autopilot"), 1);
  hear(mavlink::kAutopilotPx4);
  send(mavlink::Attitude{.time_boot_ms = 2});
  EXPECT_EQ(sink_.attitude.size(), 1U);
}

TEST_F(ReceiverTest, OnlyTheAutopilotIsListenedTo) {
  mavlink::Heartbeat ground = testing::heartbeat(mavlink::kAutopilotInvalid);
  ground.type = mavlink::kTypeGroundStation;
  send(ground, 0, 255, 190);
  EXPECT_FALSE(receiver_.system_id());
  send(testing::heartbeat(mavlink::kAutopilotInvalid), 0, 1, 1);
  EXPECT_FALSE(receiver_.system_id()) << "a component that says it is no autopilot";
  hear(mavlink::kAutopilotPx4);
  send(testing::heartbeat(mavlink::kAutopilotPx4), 0, 2, 1);
  EXPECT_EQ(receiver_.system_id(), 1);
  send(mavlink::Attitude{.time_boot_ms = 5}, 0, 2, 1);
  send(mavlink::Attitude{.time_boot_ms = 5}, 0, 1, 154);
  send(mavlink::Attitude{.time_boot_ms = 5}, 0, 255, 190);
  EXPECT_TRUE(sink_.attitude.empty());
  EXPECT_EQ(count("frames.other_system"), 2);
  EXPECT_EQ(count("frames.other_component"), 1);
  EXPECT_EQ(count("frames.ground_station"), 2);
}

TEST_F(ReceiverTest, AnotherAutopilotMayFollowOneThatIsGone) {
  hear(mavlink::kAutopilotPx4);
  EXPECT_TRUE(receiver_.has_autopilot(now_));
  send(testing::heartbeat(mavlink::kAutopilotPx4), 9'000, 7, 1);
  EXPECT_EQ(receiver_.system_id(), 1);
  EXPECT_FALSE(receiver_.has_autopilot(now_));
  send(testing::heartbeat(mavlink::kAutopilotPx4), 2'000, 7, 1);
  EXPECT_EQ(receiver_.system_id(), 7);
}

TEST_F(ReceiverTest, RawImuNeedsAKnownUnit) {
  mavlink::RawImu message;
  message.time_usec = 1000;
  message.zacc = -1000;
  hear(mavlink::kAutopilotPx4);
  send(message);
  EXPECT_TRUE(sink_.imu.empty());
  EXPECT_EQ(count("refused.raw_imu_unit_unknown"), 1);
  hear(mavlink::kAutopilotArdupilot);
  message.time_usec = 2000;
  send(message);
  ASSERT_EQ(sink_.imu.size(), 1U);
  EXPECT_NEAR(sink_.imu[0].second.accel_m_s2[2], -9.80665, 1e-9);
}

TEST_F(ReceiverTest, OfTwoSourcesOfASensorTheBetterCounts) {
  hear(mavlink::kAutopilotArdupilot);
  mavlink::ScaledImu scaled;
  mavlink::ScaledImu2 second;
  for (std::uint32_t i = 1; i <= 10; ++i) {
    send(highres(10'000ULL * i), 10);
    scaled.time_boot_ms = second.time_boot_ms = 10 * i;
    send(scaled);
    send(second);
  }
  EXPECT_EQ(sink_.imu.size(), 20U) << "sensor 0 of HIGHRES_IMU, sensor 1 of SCALED_IMU2";
  EXPECT_EQ(count("superseded.imu"), 10);
  scaled.time_boot_ms = 1600;
  send(scaled, 1500);
  EXPECT_EQ(sink_.imu.size(), 21U) << "the better source is gone";
}

TEST_F(ReceiverTest, AttitudeTargetSupersedesNavControllerOutput) {
  hear(mavlink::kAutopilotPx4);
  send(mavlink::NavControllerOutput{.nav_roll = 10.0F});
  EXPECT_EQ(sink_.setpoint.size(), 1U);
  mavlink::AttitudeTarget target{.time_boot_ms = 100, .q = {1, 0, 0, 0}};
  send(target);
  send(mavlink::NavControllerOutput{.nav_roll = 10.0F}, 100);
  EXPECT_EQ(sink_.setpoint.size(), 2U);
  EXPECT_EQ(count("superseded.setpoint"), 1);
  EXPECT_EQ(sink_.flight_state.size(), 3U) << "its errors are used all the same";
}

TEST_F(ReceiverTest, AttitudeSupersedesAttitudeQuaternion) {
  hear(mavlink::kAutopilotPx4);
  send(mavlink::AttitudeQuaternion{.time_boot_ms = 10, .q1 = 1.0F});
  send(mavlink::Attitude{.time_boot_ms = 20}, 10);
  send(mavlink::AttitudeQuaternion{.time_boot_ms = 30, .q1 = 1.0F}, 10);
  EXPECT_EQ(sink_.attitude.size(), 2U);
  EXPECT_EQ(count("superseded.attitude"), 1);
}

TEST_F(ReceiverTest, FlightStateHoldsTheNewestValuesUntilTheyAge) {
  hear(mavlink::kAutopilotArdupilot);
  ASSERT_EQ(sink_.flight_state.size(), 1U) << "armed and mode became known";
  EXPECT_EQ(sink_.flight_state[0].second.armed, 1);
  EXPECT_EQ(sink_.flight_state[0].second.mode, 0x04030000);
  EXPECT_EQ(sink_.flight_state[0].second.landed_state, -1);
  EXPECT_TRUE(std::isnan(sink_.flight_state[0].second.airspeed_m_s));

  send(mavlink::VfrHud{.airspeed = 12.5F, .groundspeed = 13.0F, .alt = 120.5F, .climb = -0.5F}, 100);
  send(mavlink::NavControllerOutput{.alt_error = 0.5F, .aspd_error = 250.0F, .xtrack_error = -3.0F}, 100);
  const flight_state_t& state = sink_.flight_state.back().second;
  EXPECT_EQ(state.airspeed_m_s, 12.5);
  EXPECT_EQ(state.groundspeed_m_s, 13.0);
  EXPECT_EQ(state.altitude_m, 120.5);
  EXPECT_EQ(state.climb_m_s, -0.5);
  EXPECT_EQ(state.altitude_error_m, 0.5);
  EXPECT_EQ(state.airspeed_error_m_s, 2.5) << "ArduPilot: cm/s";
  EXPECT_EQ(state.crosstrack_error_m, -3.0);
  EXPECT_EQ(sink_.flight_state.size(), 3U);

  send(mavlink::NavControllerOutput{.alt_error = 1.0F}, 3'500);
  const flight_state_t& later = sink_.flight_state.back().second;
  EXPECT_TRUE(std::isnan(later.airspeed_m_s)) << "not refreshed for longer than the timeout";
  EXPECT_EQ(later.armed, -1);
  EXPECT_EQ(later.mode, -1);
  EXPECT_EQ(later.altitude_error_m, 1.0);
}

TEST_F(ReceiverTest, ChangesOfArmedLandedAndModeArePublishedAtOnce) {
  hear(mavlink::kAutopilotPx4);
  hear(mavlink::kAutopilotPx4);
  EXPECT_EQ(sink_.flight_state.size(), 1U) << "no news";
  send(testing::heartbeat(mavlink::kAutopilotPx4, false));
  EXPECT_EQ(sink_.flight_state.back().second.armed, 0);
  send(mavlink::ExtendedSysState{.landed_state = 2});
  send(mavlink::ExtendedSysState{.landed_state = 2});
  EXPECT_EQ(sink_.flight_state.size(), 3U);
  EXPECT_EQ(sink_.flight_state.back().second.landed_state, 2);
  send(mavlink::ExtendedSysState{.landed_state = 0});
  EXPECT_EQ(sink_.flight_state.back().second.landed_state, -1);
  send(mavlink::ExtendedSysState{.landed_state = 77});
  EXPECT_EQ(sink_.flight_state.back().second.landed_state, -1);
  EXPECT_EQ(count("refused.landed_state"), 1);
}

TEST_F(ReceiverTest, EscStatusAndInfoAreOneChannel) {
  hear(mavlink::kAutopilotPx4);
  mavlink::EscStatus status;
  status.time_usec = 1'000'000;
  status.rpm = {6000, 6100, 6200, 6300};
  status.voltage = {16, 16, 16, 16};
  send(status);
  mavlink::EscInfo info;
  info.time_usec = 1'000'000;
  info.count = 4;
  info.info = 0x0F;
  info.temperature = {4000, 4100, 4200, 32767};
  send(info);
  ASSERT_EQ(sink_.esc.size(), 2U);
  EXPECT_EQ(sink_.esc[0].second.source, "ESC_STATUS");
  EXPECT_EQ(sink_.esc[0].second.speed_rpm[3], 6300.0);
  EXPECT_TRUE(std::isnan(sink_.esc[0].second.temperature_degC[0]));
  EXPECT_EQ(sink_.esc[1].second.source, "ESC_INFO");
  EXPECT_EQ(sink_.esc[1].second.temperature_degC[1], 41.0);
  EXPECT_TRUE(std::isnan(sink_.esc[1].second.speed_rpm[1]));
  EXPECT_EQ(sink_.esc[0].first, sink_.esc[1].first);
  send(status, 20);
  EXPECT_EQ(sink_.esc.size(), 2U);
  EXPECT_EQ(count("refused.time_not_newer"), 1) << "the same measurement again";
}

class EightRotors : public ReceiverTest {
 protected:
  static MavlinkConfig eight() {
    MavlinkConfig config = testing::default_config();
    config.rotor_count = 8;
    config.rotor_of_esc = {1, 2, 3, 4, 5, 6, 7, 8};
    return config;
  }
  EightRotors() : ReceiverTest{eight()} {}
};

TEST_F(EightRotors, ABatchThatRepeatsTheFirstIsNotBelieved) {
  hear(mavlink::kAutopilotPx4);
  mavlink::EscInfo info;
  info.time_usec = 1'000'000;
  info.count = 8;
  info.info = 0xFF;
  info.temperature = {4000, 4100, 4200, 4300};
  send(info);
  info.index = 4;
  send(info);
  EXPECT_EQ(sink_.esc.size(), 1U);
  EXPECT_EQ(count("refused.esc_batch_repeated"), 1);
  info.temperature = {5000, 5100, 5200, 5300};
  send(info);
  ASSERT_EQ(sink_.esc.size(), 2U);
  EXPECT_EQ(sink_.esc[1].second.temperature_degC[4], 50.0);
  EXPECT_TRUE(std::isnan(sink_.esc[1].second.temperature_degC[0]));
}

TEST_F(ReceiverTest, ArdupilotsZeroSpeedMeansUnknownUntilTheEscHasTurned) {
  hear(mavlink::kAutopilotArdupilot);
  mavlink::EscTelemetry1To4 message;
  message.voltage = {1660, 1660, 0, 0};
  message.rpm = {0, 3000, 0, 0};
  send(message);
  EXPECT_TRUE(std::isnan(sink_.esc[0].second.speed_rpm[0]));
  EXPECT_EQ(sink_.esc[0].second.speed_rpm[1], 3000.0);
  EXPECT_EQ(sink_.esc[0].second.voltage_V[0], 16.6);
  message.rpm = {0, 0, 0, 0};
  send(message, 100);
  EXPECT_EQ(sink_.esc[1].second.speed_rpm[1], 0.0) << "it stands still now";
}

TEST_F(ReceiverTest, TimesOfAChannelNeverGoBackAndFollowTheDevice) {
  hear(mavlink::kAutopilotPx4);
  for (std::uint64_t i = 1; i <= 100; ++i) {
    send(highres(5'000 * i, 0), 5);
    send(highres(5'000 * i - 2'000, 1));  // measured earlier, sent later
  }
  ASSERT_EQ(sink_.imu.size(), 200U);
  for (std::size_t i = 1; i < sink_.imu.size(); ++i) EXPECT_GE(sink_.imu[i].first, sink_.imu[i - 1].first);
  EXPECT_EQ(sink_.imu[198].first - sink_.imu[0].first, Duration{99 * 5'000});
}

TEST_F(ReceiverTest, A32BitMicrosecondCounterWraps) {
  config_.rotor_command_source = RotorCommandSource::kServoOutputRaw;
  config_.outputs = {{.output = 1, .rotor = 1}};
  hear(mavlink::kAutopilotPx4);
  for (std::uint32_t i = 0; i < 100; ++i) {
    mavlink::ServoOutputRaw message;
    message.time_usec = 0xFFFFFFFFU - 500'000U + 20'000U * i;
    message.servo1_raw = 1500;
    send(message, 20);
  }
  ASSERT_EQ(sink_.rotor_command.size(), 100U);
  for (std::size_t i = 1; i < 100; ++i) {
    EXPECT_EQ(sink_.rotor_command[i].first - sink_.rotor_command[i - 1].first, Duration{20'000}) << i;
  }
}

TEST_F(ReceiverTest, EpochAndBootStampsDoNotDisturbEachOther) {
  hear(mavlink::kAutopilotPx4);
  for (std::uint64_t i = 1; i <= 50; ++i) {
    send(highres(1'700'000'000'000'000 + 10'000 * i, 0), 10);
    send(highres(10'000 * i, 1));
  }
  EXPECT_EQ(sink_.imu.size(), 100U);
  EXPECT_EQ(count("refused.time_implausible"), 0);
}

TEST_F(ReceiverTest, AMessageWithoutDeviceTimeHasItsArrival) {
  hear(mavlink::kAutopilotPx4);
  send(highres(0), 10);
  ASSERT_EQ(sink_.imu.size(), 1U);
  EXPECT_EQ(sink_.imu[0].first, now_);
  EXPECT_EQ(count("time.none_from_device"), 1);
}

TEST_F(ReceiverTest, GarbageInATimeStampIsRefused) {
  hear(mavlink::kAutopilotPx4);
  for (std::uint64_t i = 1; i <= 10; ++i) send(highres(1'000'000 + 5'000 * i), 5);
  send(highres(999'000'000), 5);
  EXPECT_EQ(sink_.imu.size(), 10U);
  EXPECT_EQ(count("refused.time_implausible"), 1);
  send(highres(1'060'000), 5);
  EXPECT_EQ(sink_.imu.size(), 11U);
}

TEST_F(ReceiverTest, ADeviceThatRestartsIsFollowed) {
  hear(mavlink::kAutopilotPx4);
  for (std::uint64_t i = 1; i <= 10; ++i) send(highres(100'000'000 + 5'000 * i), 5);
  for (std::uint64_t i = 1; i <= 10; ++i) send(highres(2'000'000 + 5'000 * i), 5);
  EXPECT_EQ(sink_.imu.size(), 18U) << "two samples until the restart is certain";
  EXPECT_EQ(count("time.device_restarts"), 1);
}

}  // namespace
}  // namespace airworthy::drivers
