#include "services/response/response_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "runtime/bus/channels.h"
#include "tests/support/flown_service.h"

namespace airworthy::response {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

ResponseConfig thrust_config() {
  ResponseConfig config;
  config.vehicle = "v1";
  config.monitor.channel_count = 1;
  ChannelParams& channel = config.monitor.channels[0];
  channel.response.signal = Signal::kAccelX;
  channel.terms[0].signal = Signal::kPitch;
  channel.terms[1].signal = Signal::kOne;
  channel.term_count = channel.regression.terms = 2;
  channel.side = Side::kLow;
  config.channels.push_back({.name = "thrust",
                             .component = "engine",
                             .fault_kind = "thrust_loss",
                             .severity = rt::Severity::kWarning,
                             .summary = "too slow",
                             .unit = "m/s^2",
                             .candidates = {"engine", "propeller"}});
  return config;
}

/// A driver and a gateway's clock on an in-process bus, and the service between them.
class ResponseServiceTest : public ::testing::Test, protected test::DetectorBench {
 protected:
  ResponseServiceTest() : DetectorBench{"v1", "airworthy-response", kStart} {}

  void fly(double from_s, double to_s, double lost_accel_m_s2 = 0.0) {
    for (int i = static_cast<int>(from_s * 10); i < static_cast<int>(to_s * 10); ++i) {
      const TimePoint now = kStart + Duration{i * 100'000};
      clock_.advance_to(now);
      const double pitch = 0.1 * std::sin(0.03 * i);
      attitude_t attitude{};
      attitude.pitch_rad = pitch;
      attitudes_.publish(attitude, now);
      imu_t imu{};
      imu.accel_m_s2[0] = 5 * pitch + 0.2 * normal_(random_) - lost_accel_m_s2;
      imu.accel_m_s2[2] = -9.81;
      imus_.publish(imu, now);
      tick_t tick{};
      ticks_.publish(tick, now);
      deliver();
    }
  }

  // Lets the service see everything, then waits for its next status.
  void settle() {
    deliver();
    clock_.advance_to(clock_.now() + from_seconds(0.6));
    deliver();
  }

  std::int64_t counter(const std::string& name) const {
    for (const counter_t& one : status_.counters) {
      if (one.name == name) return one.value;
    }
    return 0;
  }

  static constexpr TimePoint kStart = from_us(50'000'000);

  rt::Node driver_{*bus_, clock_, log_, {"v1", "driver", 3}};
  rt::Publisher<imu_t> imus_{driver_.advertise(channel::kImu)};
  rt::Publisher<attitude_t> attitudes_{driver_.advertise(channel::kAttitude)};
  rt::Publisher<tick_t> ticks_{driver_.advertise(channel::kTick)};
  ResponseConfig config_ = thrust_config();
  ResponseService service_{node_, config_};
  std::mt19937 random_{3};
  std::normal_distribution<double> normal_;
};

TEST_F(ResponseServiceTest, AnEventSaysWhatWhereSinceWhenAndHowSure) {
  fly(0, 60);
  ASSERT_TRUE(events_.empty());
  fly(60, 62, 2.0);
  ASSERT_GE(events_.size(), 1U);
  const fault_event_t& event = events_[0];
  EXPECT_EQ(event.phase, 1);
  EXPECT_EQ(event.number, 1);
  EXPECT_EQ(event.detector, "response");
  EXPECT_EQ(event.component, "engine");
  EXPECT_EQ(event.fault_kind, "thrust_loss");
  EXPECT_EQ(event.severity, 3);
  EXPECT_EQ(event.latched, 0);
  EXPECT_EQ(event.magnitude_unit, "m/s^2");
  EXPECT_LT(event.magnitude, -1.0);
  EXPECT_GT(event.magnitude_sigma, 0.0);
  EXPECT_EQ(event.header.time_us, event.detected_us);
  EXPECT_NEAR(static_cast<double>(event.onset_us - to_us(kStart)), 60e6, 0.5e6);
  EXPECT_LE(event.onset_us, event.detected_us);
  EXPECT_THAT(event.summary, HasSubstr("too slow"));
  EXPECT_EQ(event.candidates, (std::vector<std::string>{"engine", "propeller"}));
  ASSERT_EQ(event.evidence.size(), 5U);
  EXPECT_EQ(event.evidence[4].name, "test_ratio");
  EXPECT_GE(event.evidence[4].value, 1.0);
}

TEST_F(ResponseServiceTest, TheStatusRepeatsActiveFaultsAndRecentEvents) {
  fly(0, 60);
  fly(60, 65, 2.0);
  ASSERT_EQ(status_.active.size(), 1U);
  EXPECT_EQ(status_.active[0].number, 1);
  EXPECT_EQ(status_.active[0].component, "engine");
  EXPECT_EQ(status_.state, 2);
  ASSERT_GE(status_.recent.size(), 2U);
  EXPECT_EQ(status_.recent[0].phase, 1);
  EXPECT_EQ(status_.recent[1].phase, 2) << "an active fault is updated";
  fly(65, 90);
  EXPECT_TRUE(status_.active.empty());
  EXPECT_EQ(status_.recent.back().phase, 3);
  EXPECT_EQ(status_.recent.back().number, 1);
}

TEST_F(ResponseServiceTest, SaysWhyAComponentIsNotJudged) {
  clock_.advance_to(kStart + from_seconds(1));
  deliver();
  ASSERT_EQ(status_.components.size(), 1U);
  EXPECT_EQ(status_.state, 0);
  EXPECT_EQ(status_.components[0].judged, 0);
  EXPECT_EQ(status_.components[0].reason, "no inertial data yet");
  fly(2, 10);
  EXPECT_EQ(status_.state, 1);
  EXPECT_EQ(status_.components[0].reason, "converging: still learning this flight");
  fly(10, 40);
  EXPECT_EQ(status_.state, 2);
  EXPECT_EQ(status_.components[0].judged, 1);
  for (int i = 0; i < 40; ++i) {  // only the clock goes on
    clock_.advance_to(kStart + from_seconds(40 + i * 0.05));
    tick_t tick{};
    ticks_.publish(tick, clock_.now());
    deliver();
  }
  EXPECT_EQ(status_.state, 3);
  EXPECT_EQ(status_.muted_reason, "inertial data stale");
  EXPECT_EQ(status_.components[0].judged, 0);
}

TEST_F(ResponseServiceTest, HostileMessagesAreCountedAndChangeNothing) {
  fly(0, 60);
  settle();
  const double test_ratio = status_.components[0].evidence[4].value;
  imu_t hostile{};
  hostile.accel_m_s2[0] = kNan;
  imus_.publish(hostile, kStart + from_seconds(60));  // not a number
  hostile.accel_m_s2[0] = -50;
  imus_.publish(hostile, kStart + from_seconds(30));    // out of order
  imus_.publish(hostile, kStart + from_seconds(6000));  // ahead of its stream
  attitude_t attitude{};
  attitude.roll_rad = kNan;
  attitudes_.publish(attitude, kStart + from_seconds(60));
  settle();
  EXPECT_EQ(counter("IMU.time_backward"), 1);
  EXPECT_EQ(counter("IMU.ahead_of_stream"), 1);
  EXPECT_EQ(counter("samples_refused"), 2);
  EXPECT_EQ(status_.components[0].evidence[4].value, test_ratio);
  EXPECT_TRUE(events_.empty());
}

TEST_F(ResponseServiceTest, ADuplicateIsCountedOnce) {
  fly(0, 5);
  imu_t imu{};
  imus_.publish(imu, kStart + from_seconds(5.1));
  std::vector<std::uint8_t> copy(static_cast<std::size_t>(imu.getEncodedSize()));
  ASSERT_GT(imu.encode(copy.data(), 0, static_cast<int>(copy.size())), 0);
  ASSERT_TRUE(bus_->publish("v1/IMU", copy));
  settle();
  EXPECT_EQ(counter("IMU.duplicate"), 1);
}

TEST_F(ResponseServiceTest, TheOtherInertialUnitIsNotListenedTo) {
  fly(0, 30);
  settle();
  const double before = status_.components[0].evidence[0].value;
  imu_t other{};
  other.sensor_id = 1;
  other.accel_m_s2[0] = -50;
  imus_.publish(other, kStart + from_seconds(30));
  settle();
  EXPECT_EQ(status_.components[0].evidence[0].value, before);
}

/// A simulated quadrotor that takes off and lands every twenty seconds.
class ResponseServiceLandings : public ::testing::TestWithParam<std::uint64_t>,
                                protected test::FlownService<ResponseService, ResponseConfig> {
 protected:
  ResponseServiceLandings()
      : FlownService{"airworthy-response", f450(), *f450().multirotor, landings(), GetParam()} {}

  static ResponseConfig f450() {
    auto config = ResponseConfig::load(AIRWORTHY_CONFIG "/response_multirotor.toml",
                                       {"vehicle=" AIRWORTHY_CONFIG "/vehicles/f450.toml"});
    EXPECT_TRUE(config.has_value()) << (config ? "" : config.error().text);
    return *config;
  }

  static sim::Scenario landings() {
    auto scenario = sim::Scenario::load(AIRWORTHY_CONFIG "/scenarios/landings.toml", 4);
    EXPECT_TRUE(scenario.has_value()) << (scenario ? "" : scenario.error().text);
    return *scenario;
  }
};

// By the attitude errors alone every one of these flights has an alarm when the ground takes the vehicle over.
TEST_P(ResponseServiceLandings, AreNoFaults) {
  fly_until(2.0);
  EXPECT_EQ(status_.state, static_cast<int>(DetectorState::kMuted));
  EXPECT_THAT(status_.muted_reason, "not flying") << "reported on the ground";
  fly_until(51.0);  // in the third flight, enough of it seen
  EXPECT_EQ(status_.state, static_cast<int>(DetectorState::kMonitoring)) << status_.muted_reason;
  EXPECT_EQ(status_.components.at(0).judged, 1);
  fly_until(56.0);
  EXPECT_EQ(status_.state, static_cast<int>(DetectorState::kMuted));
  EXPECT_THAT(status_.muted_reason, "not in flight: landing");
  EXPECT_EQ(status_.components.at(0).judged, 0);
  EXPECT_EQ(status_.components.at(0).reason, status_.muted_reason);
  fly_until(120.0);
  EXPECT_TRUE(events_.empty()) << events_.front().component << ": " << events_.front().summary << " at "
                               << events_.front().header.time_us;
}

// They leave the phase unknown: whoever reads the log must learn why.
TEST_P(ResponseServiceLandings, OfAnotherNumberOfRotorsAreCounted) {
  rt::Node driver{*bus_, clock_, log_, {config_.vehicle, "driver", 7}};
  auto commands = driver.advertise(channel::kRotorCommand);
  rotor_command_t command{};
  command.rotor_count = 6;
  command.command_ratio.assign(6, 0.5);
  commands.publish(command, sim::LogOutput::vehicle_time(0.0));
  fly_until(1.0);
  const auto counter =
      std::find_if(status_.counters.begin(), status_.counters.end(),
                   [](const counter_t& one) { return one.name == "commands.wrong_rotor_count"; });
  ASSERT_NE(counter, status_.counters.end());
  EXPECT_EQ(counter->value, 1);
}

INSTANTIATE_TEST_SUITE_P(Seeds, ResponseServiceLandings, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace airworthy::response
