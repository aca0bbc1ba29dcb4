#include "cli/calibrate/learning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <deque>
#include <filesystem>
#include <random>

#include "cli/calibrate/flight_name.h"
#include "runtime/bus/channels.h"
#include "runtime/bus/log_writer.h"
#include "runtime/clock/manual_clock.h"
#include "runtime/process/node.h"
#include "services/response/response_service.h"

namespace airworthy::calibrate {
namespace {

using ::testing::HasSubstr;

response::ResponseConfig thrust_config() {
  response::ResponseConfig config;
  config.vehicle = "v1";
  config.monitor.channel_count = 1;
  response::ChannelParams& channel = config.monitor.channels[0];
  channel.response.signal = response::Signal::kAccelX;
  channel.terms[0].signal = response::Signal::kPitch;
  channel.terms[1].signal = response::Signal::kOne;
  channel.term_count = channel.regression.terms = 2;
  channel.side = response::Side::kLow;
  config.channels.emplace_back().name = "thrust";
  return config;
}

/// Recorded flights with forward acceleration 5·pitch + 0.4 + noise of 0.2 m/s².
class LearningTest : public ::testing::Test {
 protected:
  LearningTest() { std::filesystem::create_directories(folder_); }
  ~LearningTest() override { std::filesystem::remove_all(folder_); }

  std::string record(const std::string& name, double duration_s, double airspeed_m_s = 20.0,
                     const std::string& vehicle = "v1", double fails_at_s = HUGE_VAL) {
    const std::string path = (folder_ / (name + ".lcm")).string();
    auto writer = *rt::LogWriter::create(path);
    rt::ManualClock clock;
    rt::Log log{"test", rt::LogLevel::kError};
    rt::Node node{*writer, clock, log, {vehicle, "driver", 1}};
    auto imus = node.advertise(channel::kImu);
    auto attitudes = node.advertise(channel::kAttitude);
    auto states = node.advertise(channel::kFlightState);
    auto truths = node.advertise(channel::kGroundTruth);
    const TimePoint start = from_us(5'000'000);
    for (int i = 0; i < static_cast<int>(duration_s * 10); ++i) {
      const TimePoint now = start + Duration{i * 100'000};
      clock.advance_to(now);
      if (i == 0 && std::isfinite(fails_at_s)) {
        ground_truth_t truth{};
        truth.component = "engine";
        truth.fault_kind = "thrust_loss";
        truth.onset_us = to_us(start + from_seconds(fails_at_s));
        truths.publish(truth, now);
      }
      flight_state_t state{};
      state.airspeed_m_s = airspeed_m_s;
      state.groundspeed_m_s = 20.0;
      state.armed = 1;
      state.landed_state = -1;
      states.publish(state, now);
      attitude_t attitude{};
      attitude.pitch_rad = 0.1 * std::sin(0.03 * i);
      attitudes.publish(attitude, now);
      imu_t imu{};
      const bool failed = 0.1 * i >= fails_at_s;
      imu.accel_m_s2[0] = 5 * attitude.pitch_rad + 0.4 + 0.2 * normal_(random_) - (failed ? 2.0 : 0.0);
      imu.accel_m_s2[2] = -9.81;
      imus.publish(imu, now);
    }
    EXPECT_TRUE(writer->commit());
    return path;
  }

  HealthyFlight& read(const std::string& path) {
    auto flight = read_healthy_flight(path, thrust_config());
    EXPECT_TRUE(flight) << (flight ? "" : flight.error().text);
    return flights_.emplace_back(std::move(*flight));
  }

  [[nodiscard]] rt::Expected<Learned> learn_all() const {
    std::vector<const HealthyFlight*> all;
    for (const HealthyFlight& flight : flights_) all.push_back(&flight);
    return learn(all, thrust_config(), {.jobs = 2});
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("learning_test_" + std::to_string(getpid()));
  std::mt19937 random_{17};
  std::normal_distribution<double> normal_;
  std::deque<HealthyFlight> flights_;
};

TEST_F(LearningTest, FindsWhatTheFlightsHaveInCommon) {
  for (int i = 0; i < 5; ++i) read(record("f" + std::to_string(i), 150.0));
  const auto learned = learn_all();
  ASSERT_TRUE(learned) << learned.error().text;
  EXPECT_EQ(learned->calibration.vehicle, "v1");
  ASSERT_EQ(learned->calibration.configurations.size(), 1U);
  const auto& configuration = learned->calibration.configurations[0];
  EXPECT_TRUE(configuration.airspeed_sensor);
  EXPECT_EQ(configuration.flights, 5);
  ASSERT_EQ(configuration.channels.size(), 1U);
  const auto& channel = configuration.channels[0];
  EXPECT_NEAR(channel.prior.theta[0], 5.0, 0.3);
  EXPECT_NEAR(channel.prior.theta[1], 0.4, 0.02);
  EXPECT_NEAR(channel.prior.sigma, 0.2, 0.02);
  EXPECT_NEAR(channel.prior.gram[0], 0.005, 0.001);
  EXPECT_NEAR(channel.prior.gram[3], 1.0, 0.001);
  EXPECT_GT(channel.prior.threshold, 1.0);
  EXPECT_LT(channel.prior.threshold, 12.0);
  // 5 flights of 130 s that were judged: 6 blocks and a half each
  EXPECT_EQ(learned->tails[0].blocks, 5 * 7);
  EXPECT_TRUE(learned->notes.empty());
}

TEST_F(LearningTest, TheSameFlightsTeachTheSame) {
  for (int i = 0; i < 4; ++i) read(record("f" + std::to_string(i), 150.0));
  EXPECT_EQ(to_toml(learn_all()->calibration), to_toml(learn_all()->calibration));
}

TEST_F(LearningTest, WhatHappensInAFaultIsNotLearned) {
  const HealthyFlight& flight = read(record("f", 100.0, 20.0, "v1", 60.0));
  // from 5 s to half a second before the fault
  EXPECT_NEAR(flight.flown_s, 54.5, 0.3);
  for (const double response : flight.channels[0].response) EXPECT_GT(response, -1.0);
}

TEST_F(LearningTest, TooFewFlightsAreRefused) {
  read(record("a", 150.0));
  read(record("b", 150.0));
  const auto learned = learn_all();
  ASSERT_FALSE(learned);
  EXPECT_EQ(learned.error().text,
            "too few flights: with airspeed sensor: 2 independent flights; 3 are needed, so this "
            "configuration stays "
            "cold");
}

TEST_F(LearningTest, PartsOfOneFlightAreNotIndependent) {
  for (int i = 0; i < 4; ++i) read(record("day_" + std::to_string(i), 150.0)).group = "day";
  EXPECT_THAT(learn_all().error().text, HasSubstr("1 independent flight; 3 are needed"));
}

TEST_F(LearningTest, AConfigurationWithTooFewFlightsStaysColdAndSaysSo) {
  for (int i = 0; i < 4; ++i) read(record("f" + std::to_string(i), 150.0));
  read(record("without", 150.0, 0.0));
  const auto learned = learn_all();
  ASSERT_TRUE(learned) << learned.error().text;
  EXPECT_EQ(learned->calibration.configurations.size(), 1U);
  ASSERT_EQ(learned->notes.size(), 1U);
  EXPECT_EQ(learned->notes[0],
            "without airspeed sensor: 1 independent flight; 3 are needed, so this configuration stays cold");
}

TEST_F(LearningTest, FlightsOfTwoVehiclesAreRefused) {
  for (int i = 0; i < 3; ++i) read(record("f" + std::to_string(i), 150.0));
  read(record("other", 150.0, 20.0, "v2"));
  EXPECT_THAT(learn_all().error().text, HasSubstr("of vehicle \"v2\", but"));
}

TEST_F(LearningTest, ChannelsThatLearnNothingAreRefused) {
  read(record("f", 100.0));
  auto config = thrust_config();
  config.monitor.methods[0] = response::Method::kArx;
  EXPECT_EQ(learn({&flights_[0]}, config, {}).error().text,
            "no channel is of method regression, so there is nothing to learn");
}

TEST_F(LearningTest, FlightsTooShortForAThresholdAreRefused) {
  for (int i = 0; i < 3; ++i) read(record("f" + std::to_string(i), 60.0));
  EXPECT_THAT(learn_all().error().text,
              HasSubstr("channel \"thrust\" stays cold: 6 blocks of 20 s were judged; 20"));
}

TEST(FlightName, IsTheFirstGroup) {
  const auto name = FlightName::parse("(\\d{4}-\\d\\d)_");
  ASSERT_TRUE(name);
  EXPECT_EQ(name->of("plane_2018-09_1"), "2018-09");
  EXPECT_EQ(name->of("something else"), "something else");
  EXPECT_EQ(FlightName::parse("")->of("log"), "log");
}

TEST(FlightName, WithoutAGroupOrWithASyntaxErrorIsRefused) {
  EXPECT_EQ(FlightName::parse("abc").error().text, "--flight-name \"abc\": has no group in round brackets");
  EXPECT_THAT(FlightName::parse("(abc").error().text, HasSubstr("--flight-name \"(abc\": "));
}

}  // namespace
}  // namespace airworthy::calibrate
