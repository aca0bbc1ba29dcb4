#include "gateway/gateway_service.h"

#include <gtest/gtest.h>

#include "airworthy/driver_status_t.hpp"
#include "airworthy/process_status_t.hpp"
#include "runtime/bus/channels.h"
#include "runtime/bus/lcm_bus.h"
#include "runtime/clock/manual_clock.h"
#include "tests/gateway/feed/feed_bench.h"

namespace airworthy::gateway {
namespace {

constexpr Duration kTick = GatewayService::kTickPeriod;

/// A process of the vehicle, seen from the bus.
struct Peer {
  Peer(rt::Bus& bus, rt::Clock& clock, rt::Log& log, const std::string& name)
      : node{bus, clock, log, rt::Identity{"quad1", name, 9}},
        process{node.advertise(channel::kProcessStatus)},
        driver{node.advertise(channel::kDriverStatus)},
        events{node.advertise(channel::kFaultEvent)},
        detector{node.advertise(channel::kDetectorStatus)},
        ticks{node.advertise(channel::kTick)} {}

  void sign() {
    process_status_t status{};
    status.state = 1;
    process.publish(status, node.clock().now());
  }
  void link(bool connected) {
    driver_status_t status{};
    status.link = "udp:14550";
    status.connected = connected ? 1 : 0;
    status.seconds_since_data = 0.01;
    driver.publish(status, node.clock().now());
  }
  /// Not sent: what a detector would send.
  fault_event_t fault(std::int64_t number) {
    fault_event_t event{};
    event.number = number;
    event.phase = 1;
    event.detector = "detector";
    event.component = "rotor 2";
    event.fault_kind = "loss";
    event.severity = 3;
    event.onset_us = event.detected_us = to_us(node.clock().now());
    event.summary = "weak";
    return event;
  }
  void verdict(std::vector<fault_event_t> active, std::vector<fault_event_t> recent = {}) {
    detector_status_t status{};
    status.detector = "detector";
    status.state = 2;
    status.components.resize(1);
    status.component_count = 1;
    status.components[0].component = "rotor 2";
    status.components[0].judged = 1;
    status.active = std::move(active);
    status.active_count = static_cast<std::int32_t>(status.active.size());
    status.recent = std::move(recent);
    status.recent_count = static_cast<std::int32_t>(status.recent.size());
    detector.publish(status, node.clock().now());
  }

  rt::Node node;
  rt::Publisher<process_status_t> process;
  rt::Publisher<driver_status_t> driver;
  rt::Publisher<fault_event_t> events;
  rt::Publisher<detector_status_t> detector;
  rt::Publisher<tick_t> ticks;
};

class GatewayServiceTest : public ::testing::Test {
 protected:
  GatewayServiceTest() {
    listener_.subscribe<vehicle_health_t>(
        channel::kVehicleHealth, [this](const vehicle_health_t& message) { health.push_back(message); });
    listener_.subscribe<tick_t>(channel::kTick, [this](const tick_t& message) { ticks.push_back(message); });
  }

  void start(TickSource source, bool wall_time_known = false) {
    service_.emplace(gateway_node_, config_, *feed_, source, wall_time_known);
  }
  void deliver() { ASSERT_TRUE((*bus_)->dispatch(1'000)); }
  /// Own ticks.
  void run_for(Duration duration) {
    for (const TimePoint end = clock_.now() + duration; clock_.now() < end;) {
      deliver();
      clock_.advance_to(clock_.now() + kTick);
      deliver();
    }
  }

  static FeedConfig feed_config() {
    FeedConfig config;
    config.endpoint = "inproc://feed";
    config.linger_ms = 0;
    return config;
  }
  static GatewayConfig config() {
    GatewayConfig config;
    config.vehicle = config.health.vehicle = "quad1";
    config.health.expected_processes = {"driver"};
    return config;
  }

  rt::Expected<std::unique_ptr<rt::LcmBus>> bus_ = rt::LcmBus::open("memq://");
  rt::ManualClock clock_{from_us(50'000'000)};
  rt::Log log_{"test", rt::LogLevel::kError};
  rt::Node gateway_node_{**bus_, clock_, log_, rt::Identity{"quad1", "airworthy-gateway", 77}};
  rt::Node listener_{**bus_, clock_, log_, rt::Identity{"quad1", "listener", 1}};
  zmq::context_t context_;
  const GatewayConfig config_ = config();
  std::unique_ptr<FeedPublisher> feed_ =
      std::move(*FeedPublisher::open(context_, feed_config(), "quad1", 77));
  Subscriber ground_{context_, "inproc://feed"};
  std::optional<GatewayService> service_;
  Peer driver_{**bus_, clock_, log_, "driver"};
  Peer detector_{**bus_, clock_, log_, "detector"};
  std::vector<vehicle_health_t> health;
  std::vector<tick_t> ticks;
};

TEST_F(GatewayServiceTest, TicksTwentyTimesASecondAndPublishesFive) {
  start(TickSource::kOwn);
  run_for(Duration{2'000'000});
  EXPECT_EQ(ticks.size(), 40U);
  EXPECT_EQ(ticks.back().header.time_us, to_us(clock_.now()));
  EXPECT_EQ(health.size(), 10U);
  EXPECT_EQ(health.back().vehicle, "quad1");
}

TEST_F(GatewayServiceTest, OnRecordedTicksItIsNoClock) {
  start(TickSource::kBus);
  run_for(Duration{500'000});
  EXPECT_TRUE(ticks.empty());
  EXPECT_TRUE(health.empty());
  for (int i = 0; i < 20; ++i) {
    clock_.advance_to(clock_.now() + kTick);
    tick_t tick{};
    driver_.ticks.publish(tick, clock_.now());
    deliver();
    deliver();
  }
  EXPECT_EQ(health.size(), 5U);
}

TEST_F(GatewayServiceTest, ProcessesLinksAndComponentsReachBusAndFeed) {
  start(TickSource::kOwn, true);
  for (int i = 0; i < 10; ++i) {
    driver_.sign();
    driver_.link(true);
    detector_.sign();
    detector_.verdict({});
    run_for(Duration{100'000});
  }
  ASSERT_FALSE(health.empty());
  EXPECT_EQ(health.back().status, 1);
  ASSERT_EQ(health.back().component_count, 1);
  EXPECT_EQ(health.back().components[0].status, 1);
  EXPECT_EQ(health.back().process_count, 2);
  ASSERT_EQ(health.back().link_count, 1);
  EXPECT_EQ(health.back().links[0].link, "udp:14550");

  const auto received = ground_.drain(100);
  ASSERT_EQ(received.size(), health.size());
  EXPECT_EQ(received.back().topic, "airworthy/quad1/health");
  EXPECT_EQ(received.back().body.at("status"), "ok");
  EXPECT_EQ(received.back().body.at("session"), 77);
  EXPECT_EQ(received.back().body.at("time_us"), health.back().header.time_us);
  EXPECT_TRUE(received.back().body.at("time_utc").is_string());
  for (std::size_t i = 0; i < received.size(); ++i) EXPECT_EQ(received[i].sequence, std::to_string(i));
}

TEST_F(GatewayServiceTest, AFaultIsPublishedAtOnceAsEventAndWithinTwoTicksAsHealth) {
  start(TickSource::kOwn);
  run_for(Duration{1'000'000});
  const std::size_t before = health.size();
  (void)ground_.drain();
  fault_event_t raise = detector_.fault(1);
  detector_.events.publish(raise, clock_.now());
  deliver();
  const auto at_once = ground_.drain(100);
  ASSERT_EQ(at_once.size(), 1U);
  EXPECT_EQ(at_once[0].topic, "airworthy/quad1/event");
  EXPECT_EQ(at_once[0].body.at("recovered"), false);
  EXPECT_EQ(at_once[0].body.at("event").at("component"), "rotor 2");
  EXPECT_EQ(at_once[0].body.at("event").at("phase"), "raise");
  EXPECT_TRUE(at_once[0].body.at("time_utc").is_null());

  run_for(2 * kTick);
  ASSERT_GT(health.size(), before);
  EXPECT_EQ(health.back().status, 3);
  EXPECT_EQ(health.back().root_cause, "rotor 2");
  ASSERT_EQ(health.back().fault_count, 1);
  EXPECT_EQ(health.back().faults[0].header.producer, "detector");
}

TEST_F(GatewayServiceTest, EachEventGoesOutOnceThoughTheStatusRepeatsIt) {
  start(TickSource::kOwn);
  run_for(Duration{500'000});
  (void)ground_.drain();
  fault_event_t first = detector_.fault(1);
  detector_.events.publish(first, clock_.now());
  fault_event_t lost = detector_.fault(2);
  lost.header = first.header;
  lost.header.seq = 1;
  for (int i = 0; i < 3; ++i) {
    detector_.verdict({first, lost}, {first, lost});
    deliver();
  }
  std::vector<std::pair<int, bool>> events;
  for (const Received& received : ground_.drain(100)) {
    if (received.body.at("kind") != "event") continue;
    events.emplace_back(received.body.at("event").at("number").get<int>(),
                        received.body.at("recovered").get<bool>());
  }
  EXPECT_EQ(events, (std::vector<std::pair<int, bool>>{{1, false}, {2, true}}));
  run_for(Duration{200'000});
  EXPECT_EQ(health.back().fault_count, 2) << "the lost raise counts as well";
}

TEST_F(GatewayServiceTest, AMissingProcessIsToldWithinASecond) {
  start(TickSource::kOwn);
  for (int i = 0; i < 10; ++i) {
    driver_.sign();
    run_for(Duration{100'000});
  }
  const TimePoint died = clock_.now();
  while (health.back().root_cause != "process driver") {
    run_for(kTick);
    ASSERT_LE(clock_.now() - died, Duration{1'000'000});
  }
  ASSERT_EQ(health.back().process_count, 1);
  EXPECT_EQ(health.back().processes[0].status, 3);
}

TEST_F(GatewayServiceTest, HostileTextIsHarmlessOnTheFeed) {
  start(TickSource::kOwn);
  run_for(Duration{500'000});
  (void)ground_.drain();
  fault_event_t event = detector_.fault(1);
  event.component = "rotor\x1b[2J\xff";
  event.summary.assign(100'000, 'x');
  event.magnitude = std::numeric_limits<double>::quiet_NaN();
  detector_.events.publish(event, clock_.now());
  deliver();
  const auto received = ground_.drain(100);
  ASSERT_EQ(received.size(), 1U);
  EXPECT_EQ(received[0].body.at("event").at("component"), "rotor [2J?");
  EXPECT_EQ(received[0].body.at("event").at("summary").get<std::string>().size(), 256U);
  EXPECT_TRUE(received[0].body.at("event").at("magnitude").is_null());
}

TEST_F(GatewayServiceTest, WhatHasNoMeaningIsCounted) {
  start(TickSource::kOwn);
  process_status_t status{};
  status.state = 42;
  driver_.process.publish(status, clock_.now());
  fault_event_t event = detector_.fault(1);
  event.phase = 42;
  detector_.events.publish(event, clock_.now());
  run_for(Duration{500'000});
  EXPECT_EQ(gateway_node_.counters().value("PROCESS_STATUS.meaningless"), 1);
  EXPECT_EQ(gateway_node_.counters().value("FAULT_EVENT.meaningless"), 1);
  EXPECT_EQ(gateway_node_.counters().value("events_forwarded"), 0);
  EXPECT_GT(gateway_node_.counters().value("health.ticks"), 5);
}

}  // namespace
}  // namespace airworthy::gateway
