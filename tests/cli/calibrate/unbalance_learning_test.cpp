#include "cli/calibrate/unbalance_learning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "runtime/bus/log_writer.h"
#include "sim/output/log_output.h"
#include "sim/simulation.h"
#include "tests/runtime/temporary_folder.h"

namespace airworthy::calibrate {
namespace {

using ::testing::HasSubstr;

constexpr double kTrial_mg = 200.0;

/// Simulated flights of one quadrotor at hard realism, recorded once for all tests.
class UnbalanceLearningTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new rt::TemporaryFolder;
    config_ = new unbalance::UnbalanceConfig{*unbalance::UnbalanceConfig::load(
        AIRWORTHY_CONFIG "/unbalance.toml",
        {"vehicle=" AIRWORTHY_CONFIG "/vehicles/unbalance_medium.toml", "input.accel_low_pass_Hz=180"})};
    record("healthy", "medium", 40.0, 11, 0.0);
    record("trial", "medium", 40.0, 12, kTrial_mg, 1.0);
    record("other_blade", "medium", 40.0, 15, kTrial_mg, 1.0 + std::numbers::pi);
    record("short", "medium", 12.0, 13, 0.0);
    record("foreign", "other", 12.0, 14, 0.0);
  }
  static void TearDownTestSuite() {
    delete config_;
    delete folder_;
  }

  static void record(const std::string& name, const std::string& vehicle, double duration_s,
                     std::uint64_t seed, double mass_mg, double angle_rad = 0.0) {
    sim::Scenario scenario;
    scenario.segments = {{.manoeuvre = sim::Manoeuvre::kGround, .duration_s = 2.0},
                         {.manoeuvre = sim::Manoeuvre::kTakeOff, .duration_s = 4.0, .height_m = 3.0},
                         {.manoeuvre = sim::Manoeuvre::kRandom, .duration_s = duration_s, .speed_m_s = 2.0}};
    if (mass_mg > 0.0) {
      scenario.faults = {
          {.kind = sim::FaultKind::kUnbalance, .rotor = 3, .magnitude = mass_mg, .angle_rad = angle_rad}};
    }
    auto writer = rt::LogWriter::create(log(name));
    ASSERT_TRUE(writer.has_value()) << writer.error().text;
    sim::LogOutput output{**writer, vehicle, 4, seed};
    sim::Simulation simulation{config_->monitor.vehicle, scenario, sim::Realism::at(sim::Level::kHard),
                               sim::Seeds{5, seed}};
    while (simulation.time_s() < duration_s) simulation.step(output);
    ASSERT_TRUE((*writer)->commit().has_value());
  }

  static std::string log(const std::string& name) { return (folder_->path() / (name + ".lcm")).string(); }

  static rt::TemporaryFolder* folder_;
  static unbalance::UnbalanceConfig* config_;
};

rt::TemporaryFolder* UnbalanceLearningTest::folder_ = nullptr;
unbalance::UnbalanceConfig* UnbalanceLearningTest::config_ = nullptr;

TEST_F(UnbalanceLearningTest, LearnsBaselineNoiseLagAndWithATrialMassTheResponse) {
  const auto learned = learn_unbalance(
      {log("healthy")}, {{log("trial"), 3, kTrial_mg}, {log("other_blade"), 3, kTrial_mg}}, *config_, 2);
  ASSERT_TRUE(learned.has_value()) << learned.error().text;
  const unbalance::Calibration& calibration = learned->calibration;
  EXPECT_EQ(calibration.vehicle, "medium");
  ASSERT_EQ(calibration.rotors.size(), 4U);
  for (const auto& rotor : calibration.rotors) {
    EXPECT_LT(rotor.baseline_m_s2, 3.5) << "natural unbalance at hard: 1 m/s² rms";
    EXPECT_GT(rotor.baseline_sigma_m_s2, 0.0);
    EXPECT_LT(rotor.baseline_sigma_m_s2, 0.3);
  }
  EXPECT_LE(calibration.speed_latency_s, 0.024);
  EXPECT_GT(calibration.speed_noise_ratio, 0.001);
  EXPECT_LT(calibration.speed_noise_ratio, 0.02);
  EXPECT_GT(calibration.motor_time_constant_s, 0.008);
  EXPECT_LT(calibration.motor_time_constant_s, 0.04);
  EXPECT_TRUE(calibration.has_trial_mass);
  // What this vehicle really does: the response of its airframe and its mass against those of the file.
  sim::Scenario any;
  any.segments.emplace_back();
  const sim::Simulation same{config_->monitor.vehicle, any, sim::Realism::at(sim::Level::kHard),
                             sim::Seeds{5, 1}};
  const double true_response = 0.5 *
                               (same.vehicle().vibration_response[0] + same.vehicle().vibration_response[1]) *
                               config_->monitor.vehicle.mass_kg / same.vehicle().mass_kg;
  EXPECT_NEAR(calibration.response, true_response, 0.08 * true_response);
  for (const auto& rotor : calibration.rotors) EXPECT_LT(rotor.response_sigma_ratio, 0.1);
  EXPECT_LT(calibration.rotors[2].response_sigma_ratio, calibration.rotors[3].response_sigma_ratio)
      << "most is known of the rotor of the trial";
  EXPECT_TRUE(learned->notes.empty()) << learned->notes.front();
}

TEST_F(UnbalanceLearningTest, AFaultFromTheStartIsToldFromAFlightThatNeverFlew) {
  const auto learned = learn_unbalance({log("trial")}, {}, *config_, 2);
  ASSERT_FALSE(learned.has_value());
  EXPECT_NE(learned.error().text.find("s more came after the onset of a fault in GROUND_TRUTH"),
            std::string::npos)
      << learned.error().text;
}

TEST(UnbalanceLearning, PowersOfFlightsThatTaughtTooLittleDoNotCount) {
  const auto mean = mean_powers({{{1.0, 4.0}, kLeastJudged_s}, {{3.0, 0.0}, 60.0}, {{900.0, 900.0}, 5.0}});
  EXPECT_EQ(mean[0], 2.0);
  EXPECT_EQ(mean[1], 2.0);
  EXPECT_EQ(mean_powers({{{900.0}, 5.0}})[0], 0.0) << "not learned";
}

TEST_F(UnbalanceLearningTest, OneTrialSaysHowLittleItKnowsOfThePhase) {
  const auto learned = learn_unbalance({log("healthy")}, {{log("trial"), 3, kTrial_mg}}, *config_, 2);
  ASSERT_TRUE(learned.has_value()) << learned.error().text;
  ASSERT_EQ(learned->notes.size(), 1U);
  EXPECT_THAT(learned->notes[0], HasSubstr("rotor 3: one trial only"));
  // A healthy propeller's amplitude over √2, of the mass's.
  const auto& rotor = learned->calibration.rotors[2];
  UnbalanceParams params = config_->monitor;
  params.response = learned->calibration.response;
  const double made =
      1e-6 * kTrial_mg * params.vehicle.propeller_radius_m / UnbalanceMonitor::kg_m_per_m_s2(params, 2);
  EXPECT_NEAR(rotor.response_sigma_ratio, rotor.baseline_m_s2 / std::sqrt(2.0) / made, 0.01);
}

TEST_F(UnbalanceLearningTest, WithoutATrialMassTheFileIsBelievedAndItsDoubtIsStated) {
  const auto learned = learn_unbalance({log("healthy")}, {}, *config_, 2);
  ASSERT_TRUE(learned.has_value()) << learned.error().text;
  for (const auto& rotor : learned->calibration.rotors) EXPECT_EQ(rotor.response_sigma_ratio, 0.25);
}

TEST_F(UnbalanceLearningTest, RefusesWhatTeachesNothing) {
  const auto error_of = [&](const std::vector<std::string>& logs, const std::vector<TrialFlight>& trials) {
    const auto learned = learn_unbalance(logs, trials, *config_, 2);
    return learned ? std::string{"no error"} : learned.error().text;
  };
  EXPECT_THAT(error_of({log("short")}, {}), HasSubstr("20 s are needed"));
  EXPECT_THAT(error_of({log("healthy"), log("foreign")}, {}),
              HasSubstr("foreign.lcm: of vehicle \"other\", not of \"medium\""));
  EXPECT_THAT(error_of({log("absent")}, {}), HasSubstr("absent.lcm"));
  EXPECT_THAT(error_of({log("healthy")}, {{log("short"), 3, kTrial_mg}}), HasSubstr("could not be judged"));
  EXPECT_THAT(error_of({log("healthy")}, {{log("trial"), 3, 1e3 * kTrial_mg}}),
              HasSubstr("rotor 3: 200000 mg made 0.0"));
  EXPECT_THAT(error_of({log("healthy")}, {{log("trial"), 3, 1e-3 * kTrial_mg}}),
              HasSubstr("rotor 3: 0.2 mg made "));
}

}  // namespace
}  // namespace airworthy::calibrate
