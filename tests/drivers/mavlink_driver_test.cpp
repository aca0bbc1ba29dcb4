// The driver as a whole: real descriptors on one side, a bus on the other, vehicle time running 20 times
// faster.
#include "drivers/mavlink/mavlink_driver.h"

#include <fcntl.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "runtime/bus/channels.h"
#include "runtime/bus/lcm_bus.h"
#include "runtime/clock/live_clock.h"
#include "tests/drivers/loopback_devices.h"
#include "tests/drivers/mavlink_support.h"

namespace airworthy::drivers {
namespace {

using namespace std::chrono_literals;
using testing::bound_socket;
using testing::Descriptor;
using testing::FakeDevice;
using testing::loopback;

constexpr double kTimeScale = 20.0;

class DriverTest : public ::testing::Test {
 protected:
  DriverTest() {
    EXPECT_TRUE(bus_);
    (*bus_)->attach(io_, [](const rt::Error& error) { FAIL() << error.text; });
    listener_.subscribe<imu_t>(channel::kImu, [this](const imu_t& message) { imu_.push_back(message); });
    listener_.subscribe<attitude_t>(channel::kAttitude,
                                    [this](const attitude_t& m) { attitude_.push_back(m); });
    listener_.subscribe<driver_status_t>(channel::kDriverStatus,
                                         [this](const driver_status_t& m) { status_ = m; });
    listener_.subscribe<process_status_t>(channel::kProcessStatus,
                                          [this](const process_status_t& m) { process_ = m; });
  }

  void start(const std::string& link) {
    config_.link = *LinkAddress::parse(link);
    driver_.emplace(node_, io_, config_, process_status_,
                    Port::Params{.first_pause = 5ms, .longest_pause = 50ms, .longest_queue = 64});
  }
  /// Runs until the condition holds; the deadline only ends a failing test.
  bool wait_for(const std::function<bool()>& condition) {
    const auto deadline = std::chrono::steady_clock::now() + 20s;
    while (!condition() && std::chrono::steady_clock::now() < deadline) {
      io_.restart();
      io_.run_one_for(20ms);
    }
    return condition();
  }
  template <class Message>
  void send(int fd, const Message& message) {
    const auto frame = mavlink::encode(message, {1, 1}, sequence_++);
    ASSERT_EQ(::write(fd, frame.view().data(), frame.size), static_cast<ssize_t>(frame.size));
  }
  std::int64_t count(const std::string& name) {
    for (const counter_t& counter : status_.counters) {
      if (counter.name == name) return counter.value;
    }
    return 0;
  }
  double rate_Hz(const std::string& name) {
    for (const message_rate_t& rate : status_.rates) {
      if (rate.name == name) return rate.rate_Hz;
    }
    return 0.0;
  }
  std::uint32_t device_ms() { return static_cast<std::uint32_t>((to_us(clock_.now()) - boot_us_) / 1000); }

  boost::asio::io_context io_;
  rt::Expected<std::unique_ptr<rt::LcmBus>> bus_ = rt::LcmBus::open("memq://");
  rt::LiveClock clock_{io_, kTimeScale};
  rt::Log log_{"test", rt::LogLevel::kError};
  rt::Node node_{**bus_, clock_, log_, rt::Identity{"quad1", "airworthy-mavlink", 1}};
  rt::Node listener_{**bus_, clock_, log_, rt::Identity{"quad1", "listener", 2}};
  rt::ProcessStatus process_status_{node_, "hash", kTimeScale};
  MavlinkConfig config_ = testing::default_config();
  std::optional<MavlinkDriver> driver_;
  std::uint8_t sequence_ = 0;
  const std::int64_t boot_us_ = to_us(clock_.now()) - 60'000'000;

  std::vector<imu_t> imu_;
  std::vector<attitude_t> attitude_;
  driver_status_t status_{};
  process_status_t process_{};
};

TEST_F(DriverTest, SerialDeviceThatVanishesAndComesBack) {
  config_.silence = Duration{600'000'000};
  FakeDevice device;
  start("serial:" + device.path() + ":921600");
  EXPECT_TRUE(wait_for([&] { return process_.detail.starts_with("no autopilot heard"); }));
  send(device.fd(), testing::heartbeat(mavlink::kAutopilotPx4));
  send(device.fd(), mavlink::Attitude{.time_boot_ms = device_ms(), .roll = 0.5F});
  EXPECT_TRUE(
      wait_for([&] { return !attitude_.empty() && status_.connected == 1 && process_.detail.empty(); }));
  EXPECT_NEAR(attitude_.front().roll_rad, 0.5, 1e-6);
  EXPECT_EQ(attitude_.front().header.producer, "airworthy-mavlink");
  EXPECT_EQ(status_.link, config_.link.text);

  device.unplug();
  EXPECT_TRUE(wait_for([&] { return status_.connected == 0 && !status_.detail.empty(); }));
  EXPECT_EQ(process_.state, static_cast<std::int8_t>(rt::ProcessState::kDegraded));
  EXPECT_NE(process_.detail.find(device.path()), std::string::npos) << process_.detail;

  device.plug();
  EXPECT_TRUE(wait_for([&] { return status_.connected == 1; }));
  const std::size_t before = attitude_.size();
  send(device.fd(), testing::heartbeat(mavlink::kAutopilotPx4));
  send(device.fd(), mavlink::Attitude{.time_boot_ms = device_ms(), .roll = 0.25F});
  EXPECT_TRUE(wait_for([&] { return attitude_.size() > before && process_.detail.empty(); }));
  EXPECT_TRUE(wait_for([&] { return count("port.losses") == 1 && count("port.opens") == 2; }));
}

TEST_F(DriverTest, GarbageIsCountedByCause) {
  FakeDevice device;
  start("serial:" + device.path() + ":115200");
  send(device.fd(), testing::heartbeat(mavlink::kAutopilotPx4));
  auto damaged = mavlink::encode(mavlink::Attitude{.roll = 1.0F}, {1, 1}, sequence_);
  damaged.bytes[12] ^= 0x10;
  ASSERT_EQ(::write(device.fd(), damaged.bytes.data(), damaged.size), static_cast<ssize_t>(damaged.size));
  ASSERT_EQ(::write(device.fd(), "garbage", 7), 7);
  mavlink::HighresImu imu;
  imu.time_usec = 1'000;
  imu.fields_updated = 0x3F;
  imu.zacc = std::numeric_limits<float>::quiet_NaN();
  send(device.fd(), imu);
  imu.zacc = 0.0F;
  imu.fields_updated = 0x07;
  send(device.fd(), imu);
  // Half a frame and then silence: its bytes are given up, not glued to what comes next.
  ASSERT_EQ(::write(device.fd(), damaged.bytes.data(), 15), 15);
  EXPECT_TRUE(wait_for(
      [&] { return count("parser.bytes_skipped") == static_cast<std::int64_t>(damaged.size) + 7 + 15; }));
  EXPECT_EQ(count("parser.crc_errors"), 1);
  EXPECT_EQ(count("parser.frames_ok"), 3);
  EXPECT_EQ(count("refused.imu_implausible"), 1);
  EXPECT_EQ(count("refused.imu_not_inertial"), 1);
  EXPECT_TRUE(imu_.empty());
}

TEST_F(DriverTest, AnnouncesItselfAsksForRatesAndTakesTheClock) {
  std::uint16_t port = 0;
  bound_socket(SOCK_DGRAM, port).close();
  config_.requests = {{.message = "HIGHRES_IMU", .message_id = 105, .rate_Hz = 200.0}};
  config_.timesync_rate_Hz = 10.0;
  start("udp-listen:127.0.0.1:" + std::to_string(port));

  std::uint16_t own_port = 0;
  const Descriptor device = bound_socket(SOCK_DGRAM, own_port);
  const sockaddr_in there = loopback(port);
  ASSERT_EQ(connect(device.get(), reinterpret_cast<const sockaddr*>(&there), sizeof there), 0);
  fcntl(device.get(), F_SETFL, O_NONBLOCK);

  mavlink::Parser parser;
  std::map<std::uint32_t, int> heard;
  mavlink::Heartbeat beat;
  mavlink::CommandLong command;
  const auto answer = [&](const mavlink::Frame& frame) {
    ++heard[frame.message_id];
    EXPECT_EQ(frame.component_id, 191);
    if (frame.message_id == mavlink::Heartbeat::kId) beat = mavlink::decode<mavlink::Heartbeat>(frame);
    if (frame.message_id == mavlink::CommandLong::kId) command = mavlink::decode<mavlink::CommandLong>(frame);
    if (frame.message_id != mavlink::Timesync::kId) return;
    auto timesync = mavlink::decode<mavlink::Timesync>(frame);
    EXPECT_EQ(timesync.tc1, 0);
    timesync.tc1 = (to_us(clock_.now()) - boot_us_) * 1000;
    send(device.get(), timesync);
  };
  std::int64_t last_beat_us = 0;
  EXPECT_TRUE(wait_for([&] {
    const std::int64_t now_us = to_us(clock_.now());
    if (now_us - last_beat_us > 1'000'000) {
      last_beat_us = now_us;
      send(device.get(), testing::heartbeat(mavlink::kAutopilotPx4));
      send(device.get(), mavlink::Attitude{.time_boot_ms = device_ms()});
    }
    std::array<std::uint8_t, 512> buffer{};
    for (ssize_t size = 0; (size = ::read(device.get(), buffer.data(), buffer.size())) > 0;) {
      parser.push(std::span{buffer}.first(static_cast<std::size_t>(size)), answer);
    }
    return heard[mavlink::Heartbeat::kId] > 0 && heard[mavlink::CommandLong::kId] > 1 &&
           status_.clock_source == "timesync" && count("rate_missed.HIGHRES_IMU") > 0;
  }));
  EXPECT_EQ(beat.type, mavlink::kTypeOnboardController);
  EXPECT_EQ(beat.autopilot, mavlink::kAutopilotInvalid);
  EXPECT_EQ(command.command, mavlink::kCommandSetMessageInterval);
  EXPECT_EQ(command.param1, 105.0F);
  EXPECT_EQ(command.param2, 5000.0F);
  EXPECT_EQ(command.target_system, 1);
  EXPECT_EQ(command.target_component, 1);
  // Half a round trip of the test's own loop, in vehicle time.
  EXPECT_NEAR(static_cast<double>(status_.clock_offset_us - boot_us_), 0.0, 250'000.0);
  EXPECT_GE(status_.clock_uncertainty_us, 0.0);
}

TEST_F(DriverTest, WhatIsTurnedOffIsNotSent) {
  std::uint16_t port = 0;
  bound_socket(SOCK_DGRAM, port).close();
  config_.send_heartbeat = false;
  config_.timesync_rate_Hz = 0.0;
  start("udp-listen:127.0.0.1:" + std::to_string(port));
  std::uint16_t own_port = 0;
  const Descriptor device = bound_socket(SOCK_DGRAM, own_port);
  const sockaddr_in there = loopback(port);
  ASSERT_EQ(connect(device.get(), reinterpret_cast<const sockaddr*>(&there), sizeof there), 0);
  send(device.get(), testing::heartbeat(mavlink::kAutopilotPx4));
  const TimePoint start = clock_.now();
  EXPECT_TRUE(wait_for([&] { return clock_.now() - start > Duration{6'000'000}; }));
  EXPECT_EQ(count("port.bytes_sent"), 0);
  EXPECT_EQ(count("frames.autopilot"), 1);
}

TEST_F(DriverTest, TcpServerThatRestartsAndOneThatFallsSilent) {
  config_.silence = Duration{5'000'000};
  std::uint16_t port = 0;
  Descriptor server = bound_socket(SOCK_STREAM, port);
  start("tcp:127.0.0.1:" + std::to_string(port));
  EXPECT_TRUE(wait_for([&] { return status_.connected == 1; }));
  Descriptor connection{accept(server.get(), nullptr, nullptr)};
  send(connection.get(), testing::heartbeat(mavlink::kAutopilotArdupilot));
  EXPECT_TRUE(wait_for([&] { return process_.detail.empty() && count("frames.autopilot") == 1; }));

  connection.close();
  EXPECT_TRUE(wait_for([&] { return count("port.losses") == 1 && count("port.opens") == 2; }));
  connection = Descriptor{accept(server.get(), nullptr, nullptr)};
  send(connection.get(), testing::heartbeat(mavlink::kAutopilotArdupilot));
  EXPECT_TRUE(wait_for([&] { return count("frames.autopilot") == 2; }));

  // The server stays but says nothing more.
  EXPECT_TRUE(wait_for([&] { return count("port.losses") >= 2 && count("port.opens") >= 3; }));
}

TEST_F(DriverTest, RatesPerMessageAreReported) {
  FakeDevice device;
  start("serial:" + device.path() + ":921600");
  std::int64_t last_us = 0;
  EXPECT_TRUE(wait_for([&] {
    const std::int64_t now_us = to_us(clock_.now());
    if (now_us - last_us >= 200'000) {
      if (last_us == 0) send(device.fd(), testing::heartbeat(mavlink::kAutopilotPx4));
      last_us = now_us;
      send(device.fd(), mavlink::Attitude{.time_boot_ms = device_ms()});
    }
    return rate_Hz("ATTITUDE") > 1.0 && rate_Hz("ATTITUDE") < 5.5;
  }));
}

}  // namespace
}  // namespace airworthy::drivers
