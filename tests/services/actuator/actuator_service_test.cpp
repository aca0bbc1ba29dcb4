#include "services/actuator/actuator_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/bus/channels.h"
#include "tests/support/detector_bench.h"
#include "tests/support/hovering_multirotor.h"

namespace airworthy::actuator {
namespace {

using ::testing::HasSubstr;

ActuatorConfig config_of(const Multirotor& vehicle, double isolation_log_likelihood) {
  ActuatorConfig config;
  config.vehicle = "v1";
  config.monitor.vehicle = vehicle;
  config.monitor.isolation_log_likelihood = isolation_log_likelihood;
  return config;
}

/// A driver on an in-process bus, and the service.
class ActuatorServiceTest : public ::testing::Test, protected test::DetectorBench {
 protected:
  explicit ActuatorServiceTest(double isolation_log_likelihood = 5.0)
      : DetectorBench{"v1", "airworthy-actuator", kStart},
        config_{config_of(body_.vehicle, isolation_log_likelihood)} {
    body_.vehicle.gear_height_m = 0.1;
    body_.vehicle.gear_radius_m = 0.1;
    observer_.subscribe<actuator_state_t>(channel::kActuatorState, [this](const actuator_state_t& state) {
      state_ = state;
      ++states_;
    });
  }

  void fly(double seconds, bool airborne = true) {
    const int steps = static_cast<int>(std::lround(seconds / test::HoveringMultirotor::kStep_s));
    body_.excitation = airborne ? 1.0 : 0.0;  // the ground keeps it still
    for (int i = 0; i < steps; ++i) {
      body_.step();
      const TimePoint now = kStart + from_seconds(body_.time_s);
      clock_.advance_to(now);
      if (i % 5 == 0) publish_slow(now, airborne);
      imu_t imu{};
      std::copy(body_.accel_m_s2.begin(), body_.accel_m_s2.end(), imu.accel_m_s2);
      std::copy(body_.gyro_rad_s.begin(), body_.gyro_rad_s.end(), imu.gyro_rad_s);
      imu.sensor_id = 0;
      imus_.publish(imu, now);
      imu.sensor_id = 1;  // another unit, which is not to be listened to
      imu.gyro_rad_s[0] += 5.0;
      imus_.publish(imu, now);
      deliver();
    }
  }

  void publish_slow(TimePoint now, bool airborne) {
    rotor_command_t command{};
    esc_status_t esc{};
    command.rotor_count = esc.rotor_count = 4;
    for (std::size_t i = 0; i < 4; ++i) {
      command.command_ratio.push_back(airborne ? body_.command_ratio[i] : 0.0);
      esc.speed_rpm.push_back((airborne ? body_.speed_rad_s[i] : 0.0) * 30.0 / std::numbers::pi);
    }
    esc.voltage_V = esc.current_A = esc.temperature_degC = {0, 0, 0, 0};
    esc.error_count = {0, 0, 0, 0};
    commands_.publish(command, now);
    escs_.publish(esc, now);
    attitude_t attitude{};
    attitudes_.publish(attitude, now);
    flight_state_t state{};
    state.landed_state = airborne ? 2 : 1;
    state.armed = 1;
    if (!airborne) took_off_s_ = body_.time_s;
    state.climb_m_s = airborne && body_.time_s < took_off_s_ + 5.0 ? 1.0 : 0.0;
    flight_states_.publish(state, now);
    tick_t tick{};
    ticks_.publish(tick, now);
  }

  const component_assessment_t& assessment(const std::string& component) {
    const auto found = std::find_if(status_.components.begin(), status_.components.end(),
                                    [&](const auto& one) { return one.component == component; });
    EXPECT_NE(found, status_.components.end()) << component;
    return *found;
  }

  static constexpr TimePoint kStart = from_us(50'000'000);

  test::HoveringMultirotor body_{4, 11};
  double took_off_s_ = 0;
  rt::Node driver_{*bus_, clock_, log_, {"v1", "driver", 3}};
  rt::Publisher<imu_t> imus_{driver_.advertise(channel::kImu)};
  rt::Publisher<rotor_command_t> commands_{driver_.advertise(channel::kRotorCommand)};
  rt::Publisher<esc_status_t> escs_{driver_.advertise(channel::kEscStatus)};
  rt::Publisher<attitude_t> attitudes_{driver_.advertise(channel::kAttitude)};
  rt::Publisher<flight_state_t> flight_states_{driver_.advertise(channel::kFlightState)};
  rt::Publisher<tick_t> ticks_{driver_.advertise(channel::kTick)};
  ActuatorConfig config_;
  ActuatorService service_{node_, config_};
  actuator_state_t state_;
  int states_ = 0;
};

TEST_F(ActuatorServiceTest, NamesTheRotorInTheSampleThatDecided) {
  fly(25);
  ASSERT_TRUE(events_.empty());
  EXPECT_EQ(status_.state, 2) << status_.muted_reason;
  EXPECT_EQ(assessment("rotor 3").judged, 1) << assessment("rotor 3").reason;
  const double onset_s = body_.time_s;
  body_.loss_ratio[2] = 0.6;
  fly(1);
  ASSERT_GE(events_.size(), 1U);
  const fault_event_t& event = events_[0];
  EXPECT_EQ(event.phase, 1);
  EXPECT_EQ(event.detector, "actuator");
  EXPECT_EQ(event.component, "rotor 3");
  EXPECT_EQ(event.fault_kind, "loss_of_effectiveness");
  EXPECT_EQ(event.latched, 1);
  EXPECT_GE(event.probability, 0.97);
  EXPECT_NEAR(event.magnitude, 0.6, 0.3);
  EXPECT_GT(event.magnitude_sigma, 0.0);
  EXPECT_EQ(event.header.time_us, event.detected_us);
  EXPECT_EQ(event.header.sent_us, event.detected_us);  // in the callback of that sample
  EXPECT_NEAR(static_cast<double>(event.detected_us - to_us(kStart)) * 1e-6, onset_s + 0.25, 0.25);
  EXPECT_NEAR(static_cast<double>(event.onset_us - to_us(kStart)) * 1e-6, onset_s, 0.15);
  EXPECT_THAT(event.summary, HasSubstr("rotor 3 has lost"));
  EXPECT_TRUE(event.candidates.empty());
  ASSERT_EQ(status_.active.size(), 1U);
  EXPECT_EQ(status_.active[0].component, "rotor 3");
}

TEST_F(ActuatorServiceTest, AfterARepairTheFaultStaysLatchedAndTheNextOneUpdatesOrJoinsIt) {
  fly(25);
  body_.loss_ratio[2] = 0.6;
  fly(1);
  body_.loss_ratio[2] = 0.0;
  fly(8, false);
  ASSERT_EQ(status_.active.size(), 1U);
  const std::int64_t first = status_.active[0].number;
  fly(25);
  ASSERT_EQ(status_.state, 2) << status_.muted_reason;
  EXPECT_EQ(assessment("rotor 3").judged, 1);
  EXPECT_EQ(status_.active.size(), 1U);
  EXPECT_EQ(status_.active[0].detected_us, events_[0].detected_us);

  events_.clear();
  body_.loss_ratio[2] = 0.8;
  fly(1);
  ASSERT_GE(events_.size(), 1U);
  EXPECT_EQ(events_[0].phase, 2);
  EXPECT_EQ(events_[0].number, first);
  EXPECT_NEAR(events_[0].magnitude, 0.8, 0.3);
  EXPECT_EQ(status_.active.size(), 1U);

  body_.loss_ratio[2] = 0.0;
  fly(8, false);
  fly(25);
  body_.loss_ratio[0] = 0.6;
  fly(1);
  EXPECT_EQ(events_.back().component, "rotor 1");
  EXPECT_EQ(events_.back().phase, 1);
  EXPECT_GT(events_.back().number, first);
  EXPECT_EQ(status_.active.size(), 2U);
}

/// No rotor is ever told from the others.
class AmbiguousActuatorServiceTest : public ActuatorServiceTest {
 protected:
  AmbiguousActuatorServiceTest() : ActuatorServiceTest{1e9} {}
};

TEST_F(AmbiguousActuatorServiceTest, WhatIsNotNamedIsOneFaultWhicheverRotorIsMostLikely) {
  for (const std::size_t rotor : {2U, 0U}) {
    fly(25);
    body_.loss_ratio[rotor] = 0.6;
    fly(1);
    ASSERT_EQ(status_.active.size(), 1U);
    EXPECT_EQ(status_.active[0].component, "propulsion");
    EXPECT_EQ(status_.active[0].number, 1);
    EXPECT_THAT(status_.active[0].summary, HasSubstr("most likely rotor " + std::to_string(rotor + 1)));
    body_.loss_ratio[rotor] = 0.0;
    fly(8, false);
  }
}

TEST_F(ActuatorServiceTest, PublishesTheCompensatedStateFiftyTimesASecond) {
  fly(8);
  const int before = states_;
  fly(1);
  EXPECT_NEAR(states_ - before, 50, 1);
  ASSERT_EQ(state_.rotor_count, 4);
  EXPECT_NEAR(state_.rate_rad_s[0], body_.rates_rad_s[0], 0.1);
  EXPECT_NEAR(state_.specific_force_up_m_s2, 9.81, 0.8);
  EXPECT_NEAR(state_.commanded_up_m_s2, 9.81, 0.8);
  EXPECT_NEAR(state_.rotor_loss_ratio[0], 0.0, 0.15);
  EXPECT_EQ(state_.rotor_judged[0], 1);
}

TEST_F(ActuatorServiceTest, OnTheGroundEveryComponentIsUnknownAndSaysWhy) {
  body_.loss_ratio[0] = 0.9;
  fly(3, false);
  EXPECT_TRUE(events_.empty());
  EXPECT_EQ(status_.state, 3);
  EXPECT_THAT(status_.muted_reason, HasSubstr("not in free flight"));
  EXPECT_EQ(assessment("rotor 1").judged, 0);
  EXPECT_THAT(assessment("roll axis").reason, HasSubstr("not in free flight"));
  EXPECT_TRUE(std::isnan(state_.rotor_loss_ratio[0]));
  EXPECT_TRUE(std::isnan(state_.rate_rad_s[0]));
}

}  // namespace
}  // namespace airworthy::actuator
