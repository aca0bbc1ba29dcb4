#include "sim/output/mavlink_output.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/protocol/mavlink/constants.h"
#include "core/protocol/mavlink/messages.h"
#include "sim/output/pseudo_terminal.h"
#include "tests/runtime/temporary_folder.h"

namespace airworthy::sim {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Six rotors; keeps the frames written.
class MavlinkOutputTest : public ::testing::Test {
 protected:
  template <class Message>
  std::vector<Message> sent() {
    std::vector<Message> result;
    for (const mavlink::Frame& frame : frames_) {
      if (frame.message_id == Message::kId) result.push_back(mavlink::decode<Message>(frame));
    }
    return result;
  }

  std::vector<mavlink::Frame> frames_;
  mavlink::Parser parser_;
  MavlinkOutput output_{[this](std::span<const std::uint8_t> bytes) {
                          parser_.push(bytes,
                                       [this](const mavlink::Frame& frame) { frames_.push_back(frame); });
                        },
                        6};
};

TEST_F(MavlinkOutputTest, InertialSamplesCarryTheDevicesTime) {
  ImuSample sample;
  sample.time_s = 1.25;
  sample.accel_m_s2 = {1.0, -2.0, -9.5};
  sample.gyro_rad_s = {0.5, 0.25, -0.125};
  output_.on_imu(sample);
  sample.time_s = 1.252;
  output_.on_imu(sample);
  const auto messages = sent<mavlink::HighresImu>();
  ASSERT_EQ(messages.size(), 2U);
  EXPECT_EQ(messages[1].time_usec - messages[0].time_usec, 2000U);
  EXPECT_EQ(messages[0].yacc, -2.0F);
  EXPECT_EQ(messages[0].zgyro, -0.125F);
  EXPECT_EQ(messages[0].fields_updated, mavlink::kHighresImuInertial);
}

TEST_F(MavlinkOutputTest, SixEscsNeedTwoMessagesAndASilentOneIsZero) {
  EscSample sample;
  sample.time_s = 0.5;
  for (std::size_t i = 0; i < 6; ++i) {
    sample.speed_rpm[i] = 1000.4 * static_cast<double>(i + 1);
    sample.voltage_V[i] = 16.0;
    sample.temperature_degC[i] = 35.0;
  }
  sample.speed_rpm[4] = sample.voltage_V[4] = sample.temperature_degC[4] = kNaN;
  output_.on_esc(sample);
  const auto messages = sent<mavlink::EscStatus>();
  ASSERT_EQ(messages.size(), 2U);
  EXPECT_EQ(messages[0].index, 0);
  EXPECT_EQ(messages[1].index, 4);
  EXPECT_EQ(messages[0].rpm[3], 4002);
  EXPECT_EQ(messages[1].rpm[0], 0);
  EXPECT_EQ(messages[1].voltage[0], 0.0F);
  EXPECT_EQ(messages[1].rpm[1], 6002);
  const auto infos = sent<mavlink::EscInfo>();
  ASSERT_EQ(infos.size(), 2U);
  EXPECT_EQ(infos[0].count, 6);
  EXPECT_EQ(infos[0].info, 0b1111);
  EXPECT_EQ(infos[1].info, 0b10) << "rotor 5 is offline";
  EXPECT_EQ(infos[0].temperature[0], 3500);
}

TEST_F(MavlinkOutputTest, AttitudeSetPointAndCommandsAreThoseOfTheAutopilot) {
  AutopilotSample sample;
  sample.time_s = 2.0;
  sample.estimate.q_NB = Eigen::AngleAxisd{std::numbers::pi / 3.0, Eigen::Vector3d::UnitX()};
  sample.estimate.gyro_rad_s = {0.0, 0.5, 0.0};
  sample.control.setpoint_q_NB = Eigen::AngleAxisd{0.5, Eigen::Vector3d::UnitZ()};
  sample.control.thrust_ratio = 0.25;
  sample.control.command_ratio = {0.125, 0.25, 0.375, 0.5, 0.625, 0.75};
  output_.on_attitude(sample);
  output_.on_commands(sample);
  const auto attitudes = sent<mavlink::AttitudeQuaternion>();
  ASSERT_EQ(attitudes.size(), 1U);
  EXPECT_NEAR(attitudes[0].q1, std::cos(std::numbers::pi / 6.0), 1e-6);
  EXPECT_NEAR(attitudes[0].q2, 0.5, 1e-6);
  EXPECT_EQ(attitudes[0].pitchspeed, 0.5F);
  const auto targets = sent<mavlink::AttitudeTarget>();
  ASSERT_EQ(targets.size(), 1U);
  EXPECT_NEAR(targets[0].q[3], std::sin(0.25), 1e-6);
  EXPECT_EQ(targets[0].thrust, 0.25F);
  const auto outputs = sent<mavlink::ActuatorOutputStatus>();
  ASSERT_EQ(outputs.size(), 1U);
  EXPECT_EQ(outputs[0].active, 6U);
  EXPECT_EQ(outputs[0].actuator[5], 0.75F);
}

TEST_F(MavlinkOutputTest, HeartbeatsOnceASecondTellWhetherItIsArmed) {
  AutopilotSample sample;
  for (int i = 0; i < 10; ++i) {
    sample.time_s = 0.2 * i;
    sample.control.is_armed = i >= 5;
    output_.on_flight_state(sample, LandedState::kInAir);
  }
  const auto heartbeats = sent<mavlink::Heartbeat>();
  ASSERT_EQ(heartbeats.size(), 2U);
  EXPECT_EQ(heartbeats[0].base_mode & mavlink::kModeFlagArmed, 0);
  EXPECT_NE(heartbeats[1].base_mode & mavlink::kModeFlagArmed, 0);
  ASSERT_EQ(sent<mavlink::ExtendedSysState>().size(), 10U);
  EXPECT_EQ(sent<mavlink::ExtendedSysState>()[0].landed_state, 2);
}

TEST_F(MavlinkOutputTest, AnswersTimesyncOnceWithItsOwnClock) {
  mavlink::Timesync question;
  question.ts1 = 123'456'789;
  const auto asked = mavlink::encode(question, mavlink::Sender{255, 190}, 0);
  output_.on_received(asked.view(), 1.0);
  auto answers = sent<mavlink::Timesync>();
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].ts1, question.ts1);
  ImuSample sample;
  sample.time_s = 1.0;
  output_.on_imu(sample);
  EXPECT_EQ(static_cast<std::uint64_t>(answers[0].tc1), 1000 * sent<mavlink::HighresImu>()[0].time_usec);
  const auto answered = mavlink::encode(answers[0], mavlink::Sender{255, 190}, 1);
  output_.on_received(answered.view(), 1.1);
  EXPECT_EQ(sent<mavlink::Timesync>().size(), 1U) << "an answer is not a question";
}

TEST(PseudoTerminal, CarriesBytesBothWaysUnderItsLinkAndRemovesIt) {
  const rt::TemporaryFolder folder;
  const auto link = folder.path() / "fc";
  const std::vector<std::uint8_t> bytes{0x00, 0x03, 0x0A, 0x0D, 0x11, 0x13, 0x7F, 0xFD, 0xFF};
  {
    auto terminal = PseudoTerminal::open(link);
    ASSERT_TRUE(terminal.has_value()) << terminal.error().text;
    const int line = ::open(link.c_str(), O_RDWR | O_NOCTTY);
    ASSERT_GE(line, 0);
    (*terminal)->write(bytes);
    std::vector<std::uint8_t> got(64);
    pollfd readable{line, POLLIN, 0};
    ASSERT_EQ(::poll(&readable, 1, 5000), 1);
    got.resize(static_cast<std::size_t>(::read(line, got.data(), got.size())));
    EXPECT_EQ(got, bytes) << "no byte is special on this line";
    ASSERT_EQ(::write(line, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
    std::vector<std::uint8_t> back;
    for (int i = 0; i < 1000 && back.size() < bytes.size(); ++i) {
      const auto part = (*terminal)->read();
      back.insert(back.end(), part.begin(), part.end());
      if (part.empty()) ::usleep(1000);
    }
    EXPECT_EQ(back, bytes);
    EXPECT_EQ((*terminal)->writes_dropped(), 0);
    ::close(line);
  }
  EXPECT_FALSE(std::filesystem::is_symlink(link));
}

TEST(PseudoTerminal, WhatNobodyReadsIsDroppedAndCounted) {
  const rt::TemporaryFolder folder;
  auto terminal = PseudoTerminal::open(folder.path() / "fc");
  ASSERT_TRUE(terminal.has_value()) << terminal.error().text;
  const std::vector<std::uint8_t> bytes(4096, 0x55);
  for (int i = 0; i < 100; ++i) (*terminal)->write(bytes);
  EXPECT_GT((*terminal)->writes_dropped(), 50);
}

TEST(PseudoTerminal, ReplacesAnOldLinkButNothingElse) {
  const rt::TemporaryFolder folder;
  const auto file = folder.write("fc", "precious");
  const auto refused = PseudoTerminal::open(file);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().text, file.string() + ": exists and is not a symbolic link");
  EXPECT_EQ(std::filesystem::file_size(file), 8U);
  const auto link = folder.path() / "stale";
  std::filesystem::create_symlink("/nonexistent", link);
  EXPECT_TRUE(PseudoTerminal::open(link).has_value());
}

}  // namespace
}  // namespace airworthy::sim
