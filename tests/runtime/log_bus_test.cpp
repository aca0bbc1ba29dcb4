#include "runtime/bus/log_bus.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "runtime/bus/channels.h"
#include "runtime/process/node.h"

namespace airworthy::rt {
namespace {

class LogBusTest : public ::testing::Test {
 protected:
  LogBusTest()
      : path_{std::filesystem::temp_directory_path() / ("log_bus_test_" + std::to_string(getpid()))} {}
  ~LogBusTest() override { std::filesystem::remove(path_); }

  // IMU every 10 ms of vehicle time from 100 s on, and one foreign channel.
  void record(int messages) {
    lcm_eventlog_t* log = lcm_eventlog_create(path_.c_str(), "w");
    ASSERT_NE(log, nullptr);
    for (int i = 0; i < messages; ++i) {
      imu_t imu{};
      imu.header.time_us = 100'000'000 + i * 10'000;
      imu.header.sent_us = imu.header.time_us;
      imu.header.seq = i;
      imu.header.producer = "driver";
      imu.header.session = 1;
      std::vector<std::uint8_t> payload(static_cast<std::size_t>(imu.getEncodedSize()));
      imu.encode(payload.data(), 0, static_cast<int>(payload.size()));
      write(log, "v1/IMU", payload, i);
      write(log, "OTHER", {1, 2, 3}, i);
    }
    lcm_eventlog_destroy(log);
  }

  static void write(lcm_eventlog_t* log, const std::string& channel, const std::vector<std::uint8_t>& payload,
                    int i) {
    std::vector<char> name{channel.begin(), channel.end()};
    name.push_back('\0');
    std::vector<std::uint8_t> data = payload;
    lcm_eventlog_event_t event{};
    event.timestamp = 1'700'000'000'000'000 + i * 10'000;
    event.channellen = static_cast<std::int32_t>(channel.size());
    event.datalen = static_cast<std::int32_t>(data.size());
    event.channel = name.data();
    event.data = data.data();
    ASSERT_EQ(lcm_eventlog_write_event(log, &event), 0);
  }

  static bool only_vehicle(std::string_view channel) { return channel.starts_with("v1/"); }

  std::filesystem::path path_;
  ManualClock clock_;
  Log log_{"test", LogLevel::kError};
};

TEST_F(LogBusTest, PlaysOnTheTimeOfTheMessages) {
  record(101);
  auto bus = LogBus::open(path_);
  ASSERT_TRUE(bus);
  Node node{**bus, clock_, log_, Identity{"v1", "tester", 1}};
  int received = 0;
  node.subscribe<imu_t>(channel::kImu, [&](const imu_t& imu) {
    ++received;
    EXPECT_EQ(to_us(clock_.now()), imu.header.sent_us);
  });
  std::vector<std::int64_t> timers;
  node.every(Duration{250'000}, [&](TimePoint t) { timers.push_back(to_us(t)); });
  const auto summary = (*bus)->play(clock_, only_vehicle);
  ASSERT_TRUE(summary) << summary.error().text;
  EXPECT_EQ(received, 101);
  EXPECT_EQ(summary->played, 101);
  EXPECT_EQ(summary->filtered, 101);
  EXPECT_EQ(timers, (std::vector<std::int64_t>{100'250'000, 100'500'000, 100'750'000, 101'000'000}));
}

TEST_F(LogBusTest, WhatAHandlerPublishesReachesTheOthersAndTheTap) {
  record(3);
  auto bus = LogBus::open(path_);
  ASSERT_TRUE(bus);
  Node node{**bus, clock_, log_, Identity{"v1", "tester", 1}};
  auto publisher = node.advertise(channel::kTick);
  node.subscribe<imu_t>(channel::kImu, [&](const imu_t&) {
    tick_t tick{};
    publisher.publish(tick, clock_.now());
  });
  int ticks = 0;
  node.subscribe<tick_t>(channel::kTick, [&](const tick_t&) { ++ticks; });
  int tapped = 0;
  (*bus)->set_tap([&](const std::string& channel, std::span<const std::uint8_t>) {
    EXPECT_EQ(channel, "v1/TICK");
    ++tapped;
  });
  ASSERT_TRUE((*bus)->play(clock_, only_vehicle));
  EXPECT_EQ(ticks, 3);
  EXPECT_EQ(tapped, 3);
}

TEST_F(LogBusTest, ATruncatedFileIsAnErrorThatNamesTheOffset) {
  record(10);
  const auto size = std::filesystem::file_size(path_);
  std::filesystem::resize_file(path_, size - 1);
  auto bus = LogBus::open(path_);
  ASSERT_TRUE(bus);
  const auto summary = (*bus)->play(clock_, only_vehicle);
  ASSERT_FALSE(summary);
  // The last event is "OTHER": 28 bytes of header, 5 of channel, 3 of data.
  EXPECT_EQ(summary.error().text, path_.string() + ": not a whole event at byte " +
                                      std::to_string(size - 36) + " of " + std::to_string(size - 1) +
                                      ": truncated or corrupt");
}

TEST_F(LogBusTest, AFileThatIsNoLogIsAnError) {
  std::ofstream{path_} << "this is not a recording, but long enough to look like one event header";
  auto bus = LogBus::open(path_);
  ASSERT_TRUE(bus);
  EXPECT_FALSE((*bus)->play(clock_, only_vehicle));
}

TEST_F(LogBusTest, AFolderIsNoLog) {
  const std::string folder = std::filesystem::temp_directory_path().string();
  const auto bus = LogBus::open(folder);
  ASSERT_FALSE(bus);
  EXPECT_EQ(bus.error().text, folder + ": Is a directory");
}

TEST_F(LogBusTest, AMissingFileIsAnErrorThatNamesIt) {
  const auto bus = LogBus::open("/nonexistent/flight.lcm");
  ASSERT_FALSE(bus);
  EXPECT_EQ(bus.error().text, "/nonexistent/flight.lcm: No such file or directory");
}

}  // namespace
}  // namespace airworthy::rt
