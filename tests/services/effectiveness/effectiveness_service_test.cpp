#include "services/effectiveness/effectiveness_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "runtime/bus/channels.h"
#include "tests/support/flown_service.h"

namespace airworthy::effectiveness {
namespace {

using ::testing::HasSubstr;

constexpr double kOnset_s = 12.0;

EffectivenessConfig quad_config() {
  auto config = EffectivenessConfig::load(AIRWORTHY_CONFIG "/effectiveness.toml",
                                          {"vehicle=" AIRWORTHY_CONFIG "/vehicles/unbalance_medium.toml"});
  EXPECT_TRUE(config.has_value()) << (config ? "" : config.error().text);
  return *config;
}

/// A simulated quadrotor and its service.
class EffectivenessServiceTest : public ::testing::Test,
                                 protected test::FlownService<EffectivenessService, EffectivenessConfig> {
 protected:
  EffectivenessServiceTest() : EffectivenessServiceTest{quad_config(), plan()} {}

  /// What flies is as the shipped configuration describes it, whatever `config` says.
  EffectivenessServiceTest(EffectivenessConfig config, const sim::Scenario& scenario)
      : FlownService{"airworthy-effectiveness", std::move(config), quad_config().monitor.vehicle, scenario,
                     3} {
    observer_.subscribe<fault_event_t>(channel::kFaultEvent,
                                       [this](const fault_event_t&) { told_at_.push_back(clock_.now()); });
  }

  static sim::Scenario plan() {
    sim::Scenario scenario;
    scenario.segments = {{.manoeuvre = sim::Manoeuvre::kGround, .duration_s = 2.0},
                         {.manoeuvre = sim::Manoeuvre::kTakeOff, .duration_s = 3.0, .height_m = 3.0},
                         {.manoeuvre = sim::Manoeuvre::kRandom, .duration_s = 60.0}};
    scenario.faults = {
        {.kind = sim::FaultKind::kPropellerLost, .onset_s = kOnset_s, .rotor = 3, .magnitude = 1.0}};
    return scenario;
  }

  static sim::Scenario healthy() {
    sim::Scenario scenario = plan();
    scenario.faults.clear();
    return scenario;
  }

  std::vector<TimePoint> told_at_;  ///< each of events_
};

TEST_F(EffectivenessServiceTest, NamesTheRotorThatLostItsPropeller) {
  fly_until(1.8);
  EXPECT_EQ(status_.state, static_cast<int>(DetectorState::kMuted));
  EXPECT_THAT(status_.muted_reason, HasSubstr("not in flight: on_ground"));

  fly_until(kOnset_s);
  EXPECT_TRUE(events_.empty());
  EXPECT_EQ(status_.state, static_cast<int>(DetectorState::kMonitoring)) << status_.muted_reason;
  ASSERT_EQ(status_.components.size(), 4U);
  EXPECT_EQ(status_.components[2].judged, 1);
  EXPECT_EQ(status_.components[2].evidence.at(0).name, "effectiveness");
  EXPECT_NEAR(status_.components[2].evidence.at(0).value, 1.0, 0.5);

  fly_until(kOnset_s + 0.2);
  ASSERT_FALSE(events_.empty());
  const fault_event_t& event = events_[0];
  EXPECT_EQ(event.phase, 1);
  EXPECT_EQ(event.detector, "effectiveness");
  EXPECT_EQ(event.component, "rotor 3");
  EXPECT_EQ(event.fault_kind, "propeller_lost");
  EXPECT_EQ(event.severity, 3);
  EXPECT_EQ(event.latched, 1);
  EXPECT_GT(event.probability, 0.5);
  EXPECT_LT(event.magnitude, 0.35);
  EXPECT_LE(event.onset_us, event.detected_us);
  EXPECT_EQ(event.header.time_us, event.detected_us);
  const double delay_s = to_seconds(from_us(event.detected_us) - sim::LogOutput::vehicle_time(kOnset_s));
  EXPECT_GT(delay_s, 0.0);
  EXPECT_LT(delay_s, 0.06);
  // Told within the step of the message that decided.
  EXPECT_LE(told_at_[0] - from_us(event.detected_us), Duration{2'000});
  for (const fault_event_t& one : events_) EXPECT_EQ(one.component, "rotor 3");
  ASSERT_EQ(status_.active.size(), 1U);
  EXPECT_THAT(status_.muted_reason, HasSubstr("rotor 3 is lost"));
  EXPECT_EQ(status_.components[0].judged, 0);
}

EffectivenessConfig config_with_a_wrong_spin() {
  EffectivenessConfig config = quad_config();
  config.monitor.vehicle.rotor[2].spin = -config.monitor.vehicle.rotor[2].spin;
  config.monitor.effectiveness = EffectivenessMatrix<double>::of(config.monitor.vehicle);
  return config;
}

EffectivenessConfig config_with_swapped_rotors() {
  EffectivenessConfig config = quad_config();
  std::swap(config.monitor.vehicle.rotor[0], config.monitor.vehicle.rotor[2]);
  config.monitor.effectiveness = EffectivenessMatrix<double>::of(config.monitor.vehicle);
  return config;
}

class WrongSpin : public EffectivenessServiceTest {
 protected:
  WrongSpin() : EffectivenessServiceTest{config_with_a_wrong_spin(), healthy()} {}
};

TEST_F(WrongSpin, IsAFaultOfTheVehicleFile) {
  fly_until(50.0);
  ASSERT_FALSE(events_.empty());
  for (const fault_event_t& event : events_) {
    EXPECT_EQ(event.component, "vehicle file");
    EXPECT_EQ(event.fault_kind, "implausible_configuration");
    EXPECT_EQ(event.severity, 1);
    EXPECT_EQ(event.latched, 1);
  }
  EXPECT_EQ(events_.back().summary,
            "rotor 3 seems to turn clockwise, the vehicle file says counter-clockwise");
  EXPECT_EQ(events_.back().evidence.at(0).name, "log_likelihood_ratio");
  EXPECT_GE(events_.back().evidence.at(0).value, events_.back().evidence.at(1).value);
  ASSERT_EQ(status_.active.size(), 1U);
  // Losses are judged without the sense of rotation.
  EXPECT_EQ(status_.state, static_cast<int>(DetectorState::kMonitoring)) << status_.muted_reason;
}

class SwappedRotors : public EffectivenessServiceTest {
 protected:
  SwappedRotors() : EffectivenessServiceTest{config_with_swapped_rotors(), healthy()} {}
};

TEST_F(SwappedRotors, AreAFaultOfTheVehicleFileAndMute) {
  fly_until(50.0);
  ASSERT_EQ(events_.size(), 1U);
  EXPECT_EQ(events_[0].component, "vehicle file");
  EXPECT_EQ(events_[0].summary, "rotors 1 and 3 seem to be swapped in the vehicle file");
  EXPECT_EQ(status_.muted_reason,
            "vehicle file implausible: rotors 1 and 3 seem to be swapped in the vehicle file");
}

class WrongPropeller : public EffectivenessServiceTest {
 protected:
  WrongPropeller() : EffectivenessServiceTest{quad_config(), too_much_thrust()} {}

  static sim::Scenario too_much_thrust() {
    sim::Scenario scenario = plan();
    scenario.faults = {
        {.kind = sim::FaultKind::kOverEffective, .onset_s = 0.0, .rotor = 2, .magnitude = 0.7}};
    return scenario;
  }
};

TEST_F(WrongPropeller, IsNamedWithWhatItGives) {
  fly_until(60.0);
  ASSERT_FALSE(events_.empty());
  const fault_event_t& event = events_[0];
  EXPECT_EQ(event.phase, 1);
  EXPECT_EQ(event.component, "rotor 2");
  EXPECT_EQ(event.fault_kind, "over_effective");
  EXPECT_EQ(event.severity, 2);
  EXPECT_EQ(event.latched, 0);
  EXPECT_NEAR(event.magnitude, 1.7, 0.3);
  EXPECT_GT(event.probability, 0.99);
  EXPECT_THAT(event.summary, HasSubstr("is it the right propeller?"));
  for (const fault_event_t& one : events_) EXPECT_EQ(one.component, "rotor 2");
  ASSERT_EQ(status_.active.size(), 1U);
}

constexpr int kRaised = 1;
constexpr int kUpdated = 2;
constexpr int kCleared = 3;

/// What gave too much from the ground on is as described at last, and then loses its propeller.
class ExcessThatComesAndGoes : public EffectivenessServiceTest {
 protected:
  ExcessThatComesAndGoes() : EffectivenessServiceTest{quad_config(), comes_and_goes()} {}

  static sim::Scenario comes_and_goes() {
    sim::Scenario scenario = plan();
    scenario.faults = {
        {.kind = sim::FaultKind::kOverEffective, .end_s = 56.0, .rotor = 2, .magnitude = 0.7},
        {.kind = sim::FaultKind::kPropellerLost, .onset_s = 60.0, .rotor = 2, .magnitude = 1.0}};
    return scenario;
  }
};

TEST_F(ExcessThatComesAndGoes, IsRaisedAndClearedByNumber) {
  fly_until(61.0);
  // Of every number: raised once, and nothing after it was cleared.
  std::map<std::int64_t, std::vector<const fault_event_t*>> by_number;
  for (const fault_event_t& event : events_) {
    EXPECT_EQ(event.component, "rotor 2") << event.fault_kind;
    by_number[event.number].push_back(&event);
  }
  ASSERT_EQ(by_number.size(), 2U);
  for (const auto& [number, events] : by_number) {
    const bool is_lost = number == by_number.rbegin()->first;
    EXPECT_EQ(events.front()->phase, kRaised) << number;
    EXPECT_EQ(events.back()->phase == kCleared, !is_lost) << number;
    for (std::size_t i = 1; i + 1 < events.size(); ++i) EXPECT_EQ(events[i]->phase, kUpdated) << number;
    for (const auto* event : events)
      EXPECT_EQ(event->fault_kind, is_lost ? "propeller_lost" : "over_effective") << number;
  }
  ASSERT_EQ(status_.active.size(), 1U);
  EXPECT_EQ(status_.active[0].fault_kind, "propeller_lost");
}

TEST_F(EffectivenessServiceTest, SilenceOfTheInertialUnitIsNotHealth) {
  fly_until(10.0);
  fall_silent();
  EXPECT_EQ(status_.state, static_cast<int>(DetectorState::kMuted));
  EXPECT_EQ(status_.muted_reason, "inertial data stale");
}

}  // namespace
}  // namespace airworthy::effectiveness
