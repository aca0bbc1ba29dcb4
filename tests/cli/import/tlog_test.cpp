#include "cli/import/tlog.h"

#include <gtest/gtest.h>

#include <numbers>

#include "core/protocol/mavlink/frame.h"
#include "core/protocol/mavlink/messages.h"
#include "tests/cli/import/import_support.h"

namespace airworthy::importer {
namespace {

constexpr std::int64_t kStart_us = 1'500'000'000'000'000;
constexpr mavlink::Sender kAutopilot{1, 1, 1};

class TlogTest : public ::testing::Test {
 protected:
  template <class Message>
  void add(std::int64_t after_us, const Message& message, const mavlink::Sender& sender = kAutopilot) {
    add_time(kStart_us + after_us);
    const auto encoded = mavlink::encode(message, sender, sequence_++);
    const auto bytes = encoded.view();
    offsets_.push_back(content_.size() - 8);
    content_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  void add_time(std::int64_t time_us) {
    for (int shift = 56; shift >= 0; shift -= 8) content_ += static_cast<char>((time_us >> shift) & 0xff);
  }
  // ArduPilot: heartbeat, inertial sample, guidance, attitude.
  void add_flight() {
    mavlink::Heartbeat heartbeat;
    heartbeat.type = 1;
    heartbeat.autopilot = 3;
    add(0, heartbeat);
    mavlink::RawImu imu;
    imu.time_usec = 10'000'000;
    imu.xacc = 100;
    imu.zacc = -1000;
    imu.ygyro = 250;
    add(10'000, imu);
    mavlink::NavControllerOutput guidance;
    guidance.nav_roll = 30.0F;
    guidance.nav_pitch = -10.0F;
    guidance.aspd_error = 150.0F;
    add(20'000, guidance);
    mavlink::Attitude attitude;
    attitude.time_boot_ms = 10'030;
    attitude.roll = 0.5F;
    attitude.pitch = -0.25F;
    add(30'000, attitude);
  }
  rt::Expected<LogSummary> import(std::vector<Truth> truths = {}) {
    auto config = default_mavlink_config();
    config.vehicle = "mavlink";
    const auto file = folder_.write("flight.tlog", content_);
    return import_tlog(file, log_, config, std::move(truths), no_progress);
  }
  std::string error() {
    const auto summary = import();
    if (summary) return "no error";
    EXPECT_EQ(names_in(folder_.path()), std::vector<std::string>{"flight.tlog"});
    return summary.error().text.substr(folder_.path().string().size());
  }

  rt::TemporaryFolder folder_;
  std::filesystem::path log_ = folder_.path() / "flight.lcm";
  std::string content_;
  std::vector<std::size_t> offsets_;
  std::uint8_t sequence_ = 0;
};

TEST_F(TlogTest, EachPacketBecomesWhatTheDriverMakesOfIt) {
  add_flight();
  const auto summary = import({{"engine", "thrust_loss", from_us(kStart_us + 15'000), {}}});
  ASSERT_TRUE(summary) << summary.error().text;
  const auto imu = read_log<imu_t>(log_, "mavlink/IMU");
  ASSERT_EQ(imu.size(), 1U);
  EXPECT_EQ(imu[0].header.time_us, kStart_us + 10'000);
  EXPECT_EQ(imu[0].header.producer, "airworthy-import");
  EXPECT_DOUBLE_EQ(imu[0].accel_m_s2[0], 0.1 * 9.80665);
  EXPECT_DOUBLE_EQ(imu[0].accel_m_s2[2], -9.80665);
  EXPECT_DOUBLE_EQ(imu[0].gyro_rad_s[1], 0.25);
  const auto attitude = read_log<attitude_t>(log_, "mavlink/ATTITUDE");
  ASSERT_EQ(attitude.size(), 1U);
  EXPECT_DOUBLE_EQ(attitude[0].roll_rad, 0.5);
  EXPECT_DOUBLE_EQ(attitude[0].pitch_rad, -0.25);
  const auto setpoint = read_log<attitude_setpoint_t>(log_, "mavlink/ATTITUDE_SETPOINT");
  ASSERT_EQ(setpoint.size(), 1U);
  EXPECT_NEAR(setpoint[0].roll_rad, std::numbers::pi / 6, 1e-6);
  EXPECT_EQ(setpoint[0].header.time_us, kStart_us + 20'000);
  const auto truth = read_log<ground_truth_t>(log_, "mavlink/GROUND_TRUTH");
  ASSERT_EQ(truth.size(), 1U);
  EXPECT_EQ(truth[0].onset_us, kStart_us + 15'000);
  EXPECT_TRUE(read_log<rotor_command_t>(log_, "mavlink/ROTOR_COMMAND").empty());
}

TEST_F(TlogTest, PacketsOfOthersAndOfUnknownMessagesAreLeftOut) {
  add_flight();
  mavlink::Attitude other;
  other.time_boot_ms = 10'060;
  add(60'000, other, {7, 1, 1});
  add_time(kStart_us + 70'000);
  content_ += std::string("\xfe\x01\x00\x01\x01\xf0\x00\x00\x00", 9);  // message 240 is none of ours
  const auto summary = import();
  ASSERT_TRUE(summary) << summary.error().text;
  EXPECT_EQ(summary->messages.at("mavlink/ATTITUDE"), 1);
  EXPECT_EQ(summary->left_out, (std::map<std::string, std::int64_t>{{"packets of unknown messages", 1}}));
}

TEST_F(TlogTest, TheSameInputGivesTheSameBytesCompressedOrNot) {
  add_flight();
  ASSERT_TRUE(import());
  const std::string first = content_of(log_);
  auto config = default_mavlink_config();
  config.vehicle = "mavlink";
  ASSERT_TRUE(import_tlog(folder_.write("flight.tlog.xz", xz(content_)), log_, config, {}, no_progress));
  EXPECT_EQ(content_of(log_), first);
}

TEST_F(TlogTest, DamageIsAnErrorThatNamesTheByte) {
  add_flight();
  const std::string whole = content_;
  content_ = whole.substr(0, whole.size() - 1);
  EXPECT_EQ(error(), "/flight.tlog: byte " + std::to_string(offsets_[3]) + ": truncated record");
  content_ = whole;
  content_[offsets_[2] + 16] = static_cast<char>(content_[offsets_[2] + 16] ^ 1);
  EXPECT_EQ(error(), "/flight.tlog: byte " + std::to_string(offsets_[2]) + ": packet with a wrong checksum");
  content_ = "";
  EXPECT_EQ(error(), "/flight.tlog: the file is empty");
}

TEST_F(TlogTest, RecordsOutOfOrderAreAnError) {
  add_flight();
  add(29'000, mavlink::Heartbeat{});
  EXPECT_EQ(error(), "/flight.tlog: byte " + std::to_string(offsets_[4]) +
                         ": time goes backward by 0.001000 s: records are out of order");
}

TEST_F(TlogTest, ALogWithoutAnAutopilotIsAnError) {
  add(0, mavlink::Attitude{});
  EXPECT_EQ(error(), "/flight.lcm: not written: nothing in the input became a message");
}

TEST_F(TlogTest, AMissingFileIsAnError) {
  const auto summary = import_tlog("/nonexistent/f.tlog", log_, default_mavlink_config(), {}, no_progress);
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().text, "/nonexistent/f.tlog: No such file or directory");
}

TEST(TlogName, HasNeitherSuffix) {
  EXPECT_EQ(tlog_name("/a/flight.1.tlog.xz"), "flight.1");
  EXPECT_EQ(tlog_name("flight.tlog"), "flight");
  EXPECT_EQ(tlog_name("flight.bin"), "flight.bin");
}

class IndexTest : public ::testing::Test {
 protected:
  rt::Expected<std::vector<Truth>> read(const std::string& fault, const std::string& onset_ns) {
    path_ = folder_.write("index.csv",
                          "sequence,fault,fault_onset_ns\nother,none,\nf," + fault + "," + onset_ns + "\n");
    return read_index(path_, "f");
  }
  std::string error(const std::string& fault, const std::string& onset_ns) {
    const auto truths = read(fault, onset_ns);
    return truths ? "no error" : truths.error().text.substr(folder_.path().string().size());
  }

  rt::TemporaryFolder folder_;
  std::filesystem::path path_;
};

TEST_F(IndexTest, GivesTheFaultsOfASequence) {
  using Faults = std::vector<std::pair<std::string, std::string>>;
  const std::vector<std::pair<std::string, Faults>> cases{
      {"engine", {{"engine", "thrust_loss"}}},
      {"elevator", {{"elevator", "stuck"}}},
      {"rudder_left", {{"rudder", "hardover_left"}}},
      {"rudder_right", {{"rudder", "hardover_right"}}},
      {"rudder+left_aileron", {{"rudder", "stuck"}, {"left aileron", "stuck"}}},
      {"both_ailerons", {{"left aileron", "stuck"}, {"right aileron", "stuck"}}},
      {"right_aileron", {{"right aileron", "stuck"}}},
      {"unknown", {}},
  };
  for (const auto& [fault, expected] : cases) {
    const auto truths = read(fault, "1536690374324825782");
    ASSERT_TRUE(truths) << truths.error().text;
    Faults found;
    for (const Truth& truth : *truths) {
      found.emplace_back(truth.component, truth.fault_kind);
      EXPECT_EQ(truth.time, from_us(1'536'690'374'324'825));
    }
    EXPECT_EQ(found, expected) << fault;
  }
  const auto healthy = read("none", "");
  ASSERT_TRUE(healthy);
  ASSERT_EQ(healthy->size(), 1U);
  EXPECT_EQ(healthy->front().fault_kind, "none");
  EXPECT_FALSE(healthy->front().time);
}

TEST_F(IndexTest, WhatIsWrongIsNamed) {
  EXPECT_EQ(error("engine", ""), "/index.csv:3: column fault_onset_ns: \"\" is not an integer");
  EXPECT_EQ(error("wing", "1"), "/index.csv:3: column fault: \"wing\" is not a fault this program knows");
  const auto truths = read_index(path_, "g");
  ASSERT_FALSE(truths);
  EXPECT_EQ(truths.error().text, path_.string() + ": has no row for g");
}

}  // namespace
}  // namespace airworthy::importer
