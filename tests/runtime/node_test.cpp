#include "runtime/process/node.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "runtime/bus/channels.h"
#include "runtime/bus/lcm_bus.h"
#include "runtime/clock/manual_clock.h"

namespace airworthy::rt {
namespace {

class NodeTest : public ::testing::Test {
 protected:
  NodeTest() : bus_{LcmBus::open("memq://")} {
    node_.subscribe<imu_t>(channel::kImu, [this](const imu_t& message) { received_.push_back(message); });
  }

  imu_t message(std::int64_t seq) {
    imu_t imu{};
    imu.header.time_us = 1'000'000 + seq * 10'000;
    imu.header.sent_us = imu.header.time_us + 100;
    imu.header.seq = seq;
    imu.header.producer = "driver";
    imu.header.session = 5;
    return imu;
  }

  void send(const imu_t& imu) {
    std::vector<std::uint8_t> payload(static_cast<std::size_t>(imu.getEncodedSize()));
    ASSERT_GT(imu.encode(payload.data(), 0, static_cast<int>(payload.size())), 0);
    send(payload);
  }
  void send(const std::vector<std::uint8_t>& payload) {
    ASSERT_TRUE((*bus_)->publish("v1/IMU", payload));
    ASSERT_TRUE((*bus_)->dispatch(10));
  }

  Expected<std::unique_ptr<LcmBus>> bus_;
  ManualClock clock_{from_us(5'000'000)};
  Log log_{"test", LogLevel::kError};
  Node node_{**bus_, clock_, log_, Identity{"v1", "tester", 77}};
  std::vector<imu_t> received_;
};

TEST_F(NodeTest, APublisherFillsTheHeader) {
  auto publisher = node_.advertise(channel::kImu);
  imu_t imu{};
  imu.accel_m_s2[2] = -9.81;
  publisher.publish(imu, from_us(4'999'000));
  publisher.publish(imu, from_us(4'999'500));
  ASSERT_TRUE((*bus_)->dispatch(10));
  ASSERT_EQ(received_.size(), 2U);
  EXPECT_EQ(received_[0].header.time_us, 4'999'000);
  EXPECT_EQ(received_[0].header.sent_us, 5'000'000);
  EXPECT_EQ(received_[0].header.seq, 0);
  EXPECT_EQ(received_[1].header.seq, 1);
  EXPECT_EQ(received_[0].header.producer, "tester");
  EXPECT_EQ(received_[0].header.session, 77);
  EXPECT_EQ(received_[0].accel_m_s2[2], -9.81);
}

TEST_F(NodeTest, LossIsCounted) {
  send(message(0));
  send(message(4));
  EXPECT_EQ(received_.size(), 2U);
  EXPECT_EQ(node_.counters().value("IMU.lost"), 3);
  EXPECT_EQ(node_.counters().value("received"), 2);
}

TEST_F(NodeTest, WhatTheStreamRefusesNeverReachesTheHandler) {
  for (int i = 0; i < 3; ++i) send(message(i));
  send(message(2));  // duplicate
  send(message(1));  // out of order
  imu_t backward = message(3);
  backward.header.time_us = 1;
  send(backward);
  imu_t ahead = message(4);
  ahead.header.time_us += 3'600'000'000;
  send(ahead);
  imu_t nobody = message(5);
  nobody.header.producer = "";
  send(nobody);
  nobody.header.producer = std::string(65, 'x');
  send(nobody);
  send(message(5));
  EXPECT_EQ(received_.size(), 4U);
  EXPECT_EQ(node_.counters().value("IMU.duplicate"), 1);
  EXPECT_EQ(node_.counters().value("IMU.out_of_order"), 1);
  EXPECT_EQ(node_.counters().value("IMU.time_backward"), 1);
  EXPECT_EQ(node_.counters().value("IMU.ahead_of_stream"), 1);
  EXPECT_EQ(node_.counters().value("IMU.bad_header"), 2);
  EXPECT_EQ(node_.counters().value("IMU.lost"), 0);
}

TEST_F(NodeTest, TruncatedForeignAndOversizedPayloadsAreCounted) {
  const imu_t imu = message(0);
  std::vector<std::uint8_t> payload(static_cast<std::size_t>(imu.getEncodedSize()));
  ASSERT_GT(imu.encode(payload.data(), 0, static_cast<int>(payload.size())), 0);
  for (std::size_t length = 0; length < payload.size(); ++length) {
    send(std::vector<std::uint8_t>(payload.begin(), payload.begin() + static_cast<std::ptrdiff_t>(length)));
  }
  std::vector<std::uint8_t> longer = payload;
  longer.push_back(0);
  send(longer);
  std::vector<std::uint8_t> foreign = payload;
  foreign[0] ^= 1;  // another fingerprint
  send(foreign);
  EXPECT_TRUE(received_.empty());
  EXPECT_EQ(node_.counters().value("IMU.undecodable"), static_cast<std::int64_t>(payload.size()) + 2);
}

TEST_F(NodeTest, TwoProducersAreTwoStreams) {
  send(message(100));
  imu_t other = message(3);
  other.header.producer = "other";
  send(other);
  EXPECT_EQ(received_.size(), 2U);
  EXPECT_EQ(node_.counters().value("IMU.lost"), 0);
}

TEST_F(NodeTest, AFloodOfProducersIsBounded) {
  for (int i = 0; i < 100; ++i) {
    imu_t imu = message(0);
    imu.header.producer = "p" + std::to_string(i);
    send(imu);
  }
  EXPECT_EQ(received_.size(), 32U);
  EXPECT_EQ(node_.counters().value("IMU.too_many_producers"), 68);
}

TEST_F(NodeTest, TimersRunOnTheNodesClock) {
  int fired = 0;
  node_.every(Duration{100'000}, [&](TimePoint) { ++fired; });
  clock_.advance_to(from_us(5'350'000));
  EXPECT_EQ(fired, 3);
  EXPECT_GE(node_.step_meter().take().steps, 3);
}

TEST(LcmBus, ABadUrlIsAnErrorThatNamesIt) {
  const auto bus = LcmBus::open("nonsense://");
  ASSERT_FALSE(bus);
  EXPECT_EQ(bus.error().text,
            "cannot open the LCM bus nonsense://: no multicast route or bad URL; 'airworthy doctor' tells "
            "the cure");
}

TEST(NewSession, FitsIntoAJsonNumber) {
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t session = new_session();
    EXPECT_GE(session, 1);
    EXPECT_LT(session, std::int64_t{1} << 48);
  }
}

}  // namespace
}  // namespace airworthy::rt
