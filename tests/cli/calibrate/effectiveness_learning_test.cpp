#include "cli/calibrate/effectiveness_learning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "sim/simulation.h"

namespace airworthy::calibrate {
namespace {

using ::testing::HasSubstr;

TimePoint at(double time_s) { return from_us(1'000'000) + Duration{std::llround(time_s * 1e6)}; }

/// Keeps what a simulated vehicle sends while it flies.
class Recorder final : public sim::Output {
 public:
  explicit Recorder(std::size_t rotors) : rotors_{rotors} {}

  void on_truth(const sim::Truth&) override {}
  void on_imu(const sim::ImuSample& sample) override {
    if (sample.time_s < 7.0) return;
    recording.in_flight.push_back({at(sample.time_s),
                                   {sample.accel_m_s2.x(), sample.accel_m_s2.y(), sample.accel_m_s2.z()},
                                   {sample.gyro_rad_s.x(), sample.gyro_rad_s.y(), sample.gyro_rad_s.z()}});
  }
  void on_esc(const sim::EscSample& sample) override {
    EffectivenessRecording::PerRotor speeds{at(sample.time_s), {}};
    for (std::size_t i = 0; i < rotors_; ++i) speeds.value[i] = sample.speed_rpm[i] * std::numbers::pi / 30.0;
    recording.speeds.push_back(speeds);
  }
  void on_attitude(const sim::AutopilotSample&) override {}
  void on_commands(const sim::AutopilotSample& sample) override {
    recording.commands.push_back({at(sample.time_s), sample.control.command_ratio});
  }
  void on_flight_state(const sim::AutopilotSample&, sim::LandedState) override {}

  EffectivenessRecording recording;

 private:
  std::size_t rotors_;
};

struct Flown {
  EffectivenessRecording recording;
  Multirotor vehicle;  ///< what really flew
};

effectiveness::EffectivenessConfig quad_config() {
  auto config = effectiveness::EffectivenessConfig::load(
      AIRWORTHY_CONFIG "/effectiveness.toml",
      {"vehicle=" AIRWORTHY_CONFIG "/vehicles/unbalance_medium.toml"});
  EXPECT_TRUE(config.has_value()) << (config ? "" : config.error().text);
  return *config;
}

Flown fly(const Multirotor& vehicle, sim::Manoeuvre manoeuvre, sim::Level level, std::uint64_t seed) {
  sim::Scenario scenario;
  scenario.segments = {{.manoeuvre = sim::Manoeuvre::kGround, .duration_s = 1.5},
                       {.manoeuvre = sim::Manoeuvre::kTakeOff, .duration_s = 4.0, .height_m = 3.0},
                       {.manoeuvre = manoeuvre, .duration_s = 40.0}};
  sim::Realism realism = sim::Realism::at(level);
  realism.wind.mean_m_s = 1.0;
  sim::Simulation simulation{vehicle, scenario, realism, seed};
  Recorder recorder{vehicle.rotor_count};
  while (simulation.time_s() < 45.0) simulation.step(recorder);
  return {recorder.recording, simulation.vehicle()};
}

TEST(EffectivenessLearning, FindsGainsLagAndNoiseOfASimulatedVehicle) {
  const auto config = quad_config();
  for (const std::uint64_t seed : {3U, 8U}) {
    const Flown flown = fly(config.monitor.vehicle, sim::Manoeuvre::kRandom, sim::Level::kHard, seed);
    const auto learned = learn_effectiveness({flown.recording}, config);
    ASSERT_TRUE(learned.has_value()) << learned.error().text;
    const Multirotor& nominal = config.monitor.vehicle;
    const Multirotor& real = flown.vehicle;
    const double thrust = real.thrust_coefficient_N_s2 / nominal.thrust_coefficient_N_s2;
    // The truth has rotors that differ by 3 %, and turning rotors lose thrust to the air: the effective gain is lower.
    EXPECT_NEAR(learned->axis[0].gain, thrust * nominal.inertia_kg_m2[0] / real.inertia_kg_m2[0], 0.15)
        << seed;
    EXPECT_NEAR(learned->axis[1].gain, thrust * nominal.inertia_kg_m2[1] / real.inertia_kg_m2[1], 0.15)
        << seed;
    EXPECT_NEAR(learned->axis[2].gain, thrust * nominal.mass_kg / real.mass_kg, 0.15) << seed;
    EXPECT_GT(learned->axis[0].gain_sigma, 0.0);
    EXPECT_LT(learned->axis[0].gain_sigma, 0.1);
    EXPECT_NEAR(learned->motor_time_constant_s, nominal.motor_time_constant_s,
                0.3 * nominal.motor_time_constant_s);
    // 8 ms and 1.5 ms of mean jitter, seen from rates that are late themselves.
    EXPECT_NEAR(learned->telemetry_latency_s, 0.008, 0.005);
    EXPECT_GT(learned->gyro_noise_rad_s, 0.005);
    EXPECT_LT(learned->gyro_noise_rad_s, 0.1);
    EXPECT_GT(learned->smallest_loss_ratio, 0.02);
    EXPECT_LT(learned->smallest_loss_ratio, 0.5);
  }
}

TEST(EffectivenessLearning, RefusesAnAxisThatWasNotExcited) {
  const auto config = quad_config();
  Flown flown = fly(config.monitor.vehicle, sim::Manoeuvre::kRandom, sim::Level::kHard, 3);
  // Roll rates of another flight: nothing there goes with these rotors.
  const Flown other = fly(config.monitor.vehicle, sim::Manoeuvre::kRandom, sim::Level::kHard, 4);
  const std::size_t samples = std::min(flown.recording.in_flight.size(), other.recording.in_flight.size());
  flown.recording.in_flight.resize(samples);
  for (std::size_t i = 0; i < samples; ++i)
    flown.recording.in_flight[i].gyro_rad_s[0] = other.recording.in_flight[i].gyro_rad_s[0];
  const auto refused = learn_effectiveness({flown.recording}, config);
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().text, HasSubstr("roll axis not excited"));
  EXPECT_THAT(refused.error().text, ::testing::Not(HasSubstr("pitch axis")));
  const auto kept = learn_effectiveness({flown.recording}, config, true);
  ASSERT_TRUE(kept.has_value()) << kept.error().text;
  EXPECT_EQ(kept->axis[0].gain, 1.0);
  EXPECT_EQ(kept->axis[0].gain_sigma, kDescribedSigma);
  EXPECT_NE(kept->axis[1].gain, 1.0);
}

TEST(EffectivenessLearning, LeavesOutSamplesThatAreNotFinite) {
  const auto config = quad_config();
  const Flown flown = fly(config.monitor.vehicle, sim::Manoeuvre::kRandom, sim::Level::kHard, 3);
  const auto whole = learn_effectiveness({flown.recording}, config);
  ASSERT_TRUE(whole.has_value()) << whole.error().text;
  EffectivenessRecording holed = flown.recording;
  holed.in_flight[4000].gyro_rad_s[1] = std::nan("");
  holed.in_flight[8000].accel_m_s2[2] = std::numeric_limits<double>::infinity();
  const auto learned = learn_effectiveness({holed}, config);
  ASSERT_TRUE(learned.has_value()) << learned.error().text;
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(learned->axis[i].gain, whole->axis[i].gain, 0.01) << i;
}

TEST(EffectivenessLearning, AWrongNumberingIsNotTakenForKnownWhereAnAxisIsKept) {
  const auto config = quad_config();
  Flown flown = fly(config.monitor.vehicle, sim::Manoeuvre::kRandom, sim::Level::kHard, 3);
  const auto right = learn_effectiveness({flown.recording}, config, true);
  ASSERT_TRUE(right.has_value()) << right.error().text;
  EXPECT_TRUE(with_calibration(config.monitor, *right).mapping_is_known);
  for (auto& sample : flown.recording.speeds) std::swap(sample.value[0], sample.value[2]);
  for (auto& sample : flown.recording.commands) std::swap(sample.value[0], sample.value[2]);
  const auto refused = learn_effectiveness({flown.recording}, config);
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().text, HasSubstr("axis not excited"));
  const auto kept = learn_effectiveness({flown.recording}, config, true);
  ASSERT_TRUE(kept.has_value()) << kept.error().text;
  EXPECT_FALSE(kept->axis[0].is_excited && kept->axis[1].is_excited);
  EXPECT_FALSE(with_calibration(config.monitor, *kept).mapping_is_known);
}

TEST(EffectivenessLearning, FindsHowMuchLaterInertialDataComeAndRefusesMoreThanItLooksFor) {
  auto config = quad_config();
  config.monitor.learns_inertial_delay = true;
  const Flown flown = fly(config.monitor.vehicle, sim::Manoeuvre::kRandom, sim::Level::kHard, 3);
  const auto later = [&flown](Duration by) {
    EffectivenessRecording recording = flown.recording;
    recording.log = "late.lcm";
    for (auto& sample : recording.in_flight) sample.time += by;
    return recording;
  };
  // Speeds come some 9 ms late themselves.
  const auto found = inertial_delay_of(later(Duration{40'000}), config.monitor);
  ASSERT_TRUE(found.has_value()) << found.error().text;
  EXPECT_NEAR(to_seconds(*found), 0.031, 0.005);
  const auto beyond = learn_effectiveness({later(Duration{80'000})}, config);
  ASSERT_FALSE(beyond.has_value());
  EXPECT_EQ(beyond.error().text,
            "late.lcm: inertial data (IMU) come 60 ms or more after the rotor speeds (ESC_STATUS), longer "
            "than what "
            "input.inertial_delay_learned can tell");
  EffectivenessRecording mute = later(Duration{40'000});
  mute.speeds.clear();
  const auto without = learn_effectiveness({mute}, config);
  ASSERT_FALSE(without.has_value());
  EXPECT_EQ(
      without.error().text,
      "late.lcm: no rotor speeds (ESC_STATUS), but input.inertial_delay_learned needs them to calibrate");
}

TEST(EffectivenessLearning, RefusesABestValueAtTheEdgeOfItsGrid) {
  const auto config = quad_config();
  Flown flown = fly(config.monitor.vehicle, sim::Manoeuvre::kRandom, sim::Level::kHard, 3);
  flown.recording.in_flight.resize(10'000);
  EffectivenessRecording slow = flown.recording;
  for (auto& sample : slow.speeds) sample.time += Duration{40'000};
  const auto late = learn_effectiveness({slow}, config);
  ASSERT_FALSE(late.has_value());
  EXPECT_THAT(late.error().text, HasSubstr("rotor speeds (ESC_STATUS) fit the motion best 40 ms late"));
  EffectivenessRecording early = flown.recording;
  for (auto& sample : early.commands) sample.time -= Duration{60'000};
  early.speeds.clear();
  const auto unheard = learn_effectiveness({early}, config);
  ASSERT_FALSE(unheard.has_value());
  EXPECT_THAT(unheard.error().text, HasSubstr("at the edge of what is looked for"));
}

TEST(EffectivenessLearning, RefusesTooLittleFlightAndMissingSpeeds) {
  const auto config = quad_config();
  Flown flown = fly(config.monitor.vehicle, sim::Manoeuvre::kHover, sim::Level::kNominal, 1);
  EffectivenessRecording mute = flown.recording;
  mute.log = "mute.lcm";
  mute.speeds.clear();
  const auto mixed = learn_effectiveness({flown.recording, mute}, config);
  ASSERT_FALSE(mixed.has_value());
  EXPECT_EQ(
      mixed.error().text,
      "mute.lcm: no rotor speeds (ESC_STATUS), but other flights have them; learn from flights of one kind");
  mute.commands.clear();
  const auto without = learn_effectiveness({mute}, config);
  ASSERT_FALSE(without.has_value());
  EXPECT_EQ(without.error().text, "mute.lcm: neither rotor speeds (ESC_STATUS) nor commands (ROTOR_COMMAND)");
  flown.recording.in_flight.resize(1000);
  const auto brief = learn_effectiveness({flown.recording}, config);
  ASSERT_FALSE(brief.has_value());
  EXPECT_THAT(brief.error().text, HasSubstr("only 2.0 s of free flight"));
  flown.recording.after_onset_s = 30.0;
  EXPECT_THAT(learn_effectiveness({flown.recording}, config).error().text,
              HasSubstr("8 s are needed; 30.0 s more came after the onset of a fault in GROUND_TRUTH"));
}

}  // namespace
}  // namespace airworthy::calibrate
