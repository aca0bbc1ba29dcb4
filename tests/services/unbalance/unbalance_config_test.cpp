#include "services/unbalance/unbalance_config.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "services/unbalance/calibration.h"
#include "tests/runtime/temporary_folder.h"

namespace airworthy::unbalance {
namespace {

class UnbalanceConfigTest : public ::testing::Test {
 protected:
  UnbalanceConfigTest() {
    std::ifstream vehicle{AIRWORTHY_CONFIG "/vehicles/unbalance_medium.toml"};
    write("vehicle.toml", std::string{std::istreambuf_iterator<char>{vehicle}, {}});
    write("plane.toml", "name = \"medium\"\nkind = \"fixed_wing\"\ndescription = \"\"\n");
  }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream{folder_.path() / name} << text;
  }

  [[nodiscard]] rt::Expected<UnbalanceConfig> load(const std::string& text) const {
    write("unbalance.toml", text);
    return UnbalanceConfig::load((folder_.path() / "unbalance.toml").string(), {});
  }

  // The error text with the folder taken out.
  [[nodiscard]] std::string error_of(const std::string& text) const {
    const auto config = load(text);
    if (config) return "no error";
    std::string error = config.error().text;
    const std::string prefix = folder_.path().string() + "/";
    for (std::size_t at = error.find(prefix); at != std::string::npos; at = error.find(prefix)) {
      error.erase(at, prefix.size());
    }
    return error;
  }

  rt::TemporaryFolder folder_;
};

constexpr const char* kThreshold = "[threshold]\nunit = \"mg\"\nadvisory = 15\ncaution = 60\nusual = 40\n";

Calibration quad_calibration() {
  Calibration calibration;
  calibration.vehicle = "medium";
  calibration.flights = 2;
  calibration.judged_s = 100.5;
  calibration.speed_latency_s = 0.008;
  calibration.speed_noise_ratio = 0.0035;
  calibration.response = 2.0;
  calibration.has_trial_mass = true;
  calibration.against_ratio = 0.2;
  for (int i = 0; i < 4; ++i) calibration.rotors.push_back({0.1 * i, 0.03, 0.5, -0.005, 0.04});
  return calibration;
}

TEST_F(UnbalanceConfigTest, TheShippedFileIsValid) {
  const auto config = UnbalanceConfig::load(AIRWORTHY_CONFIG "/unbalance.toml", {});
  ASSERT_TRUE(config.has_value()) << config.error().text;
  EXPECT_EQ(config->vehicle, "hexa");
  EXPECT_FALSE(config->monitor.has_baseline);
}

TEST_F(UnbalanceConfigTest, MassesBecomeAccelerationsAtHover) {
  const auto config = load("vehicle = \"vehicle.toml\"\n" + std::string{kThreshold});
  ASSERT_TRUE(config.has_value()) << config.error().text;
  // 0.69 kg on four rotors of 7.64e-6 N·s²/rad²: ω₀² = m·g/(4·κ); 15 mg at 0.1 m shake with m_tip·r·ω₀²/m.
  const double speed2 = 0.69 * 9.81 / (4.0 * 7.64e-6);
  EXPECT_NEAR(config->monitor.smallest_m_s2, 15e-6 * 0.1 * speed2 / 0.69, 1e-9);
  EXPECT_NEAR(config->monitor.caution_m_s2, 60e-6 * 0.1 * speed2 / 0.69, 1e-9);
  const auto by_moment = load(
      "vehicle = \"vehicle.toml\"\n[threshold]\nunit = \"g_mm\"\nadvisory = 1.5\ncaution = 6\nusual = 4\n");
  ASSERT_TRUE(by_moment.has_value()) << by_moment.error().text;
  EXPECT_NEAR(by_moment->monitor.smallest_m_s2, config->monitor.smallest_m_s2, 1e-9) << "15 mg at 100 mm";
}

TEST_F(UnbalanceConfigTest, EveryProblemIsReportedAtOnce) {
  EXPECT_EQ(error_of("vehicle = \"vehicle.toml\"\n"
                     "extra = 1\n"
                     "[input]\n"
                     "accel_low_pass_Hz = -1\n"
                     "[threshold]\n"
                     "unit = \"kg\"\n"
                     "advisory = 0\n"
                     "caution = 60\n"
                     "[policy]\n"
                     "odds = 1\n"
                     "clear_ratio = 2.0\n"),
            "unbalance.toml:2:1: extra: unknown key\n"
            "unbalance.toml:4:1: input.accel_low_pass_Hz: must lie in [0, 100000], is -1\n"
            "unbalance.toml:5:1: threshold.usual: missing mandatory key\n"
            "unbalance.toml:6:1: threshold.unit: must be one of mg, g_mm, m_s2, is \"kg\"\n"
            "unbalance.toml:7:1: threshold.advisory: must lie in (0, 1000000], is 0\n"
            "unbalance.toml:10:1: policy.odds: must lie in [2, 1000000000000], is 1\n"
            "unbalance.toml:11:1: policy.clear_ratio: must lie in [0, 0.9], is 2");
}

TEST_F(UnbalanceConfigTest, RulesBetweenKeysAndFiles) {
  EXPECT_EQ(error_of("vehicle = \"plane.toml\"\n" + std::string{kThreshold}),
            "unbalance.toml:1:1: vehicle: has no table [multirotor]: there are no rotors to watch");
  EXPECT_EQ(error_of("vehicle = \"vehicle.toml\"\n"
                     "[threshold]\nunit = \"mg\"\nadvisory = 15\ncaution = 15\nusual = 40\n"),
            "unbalance.toml:5:1: threshold.caution: 15 must exceed advisory (15)");
}

TEST_F(UnbalanceConfigTest, ACalibrationComesBackAsItWasWritten) {
  write("calibration.toml", to_toml(quad_calibration()));
  const auto config =
      load("vehicle = \"vehicle.toml\"\ncalibration = \"calibration.toml\"\n" + std::string{kThreshold});
  ASSERT_TRUE(config.has_value()) << config.error().text;
  EXPECT_TRUE(config->is_calibrated);
  EXPECT_TRUE(config->monitor.has_baseline);
  EXPECT_EQ(config->monitor.speed_latency_s, 0.008);
  EXPECT_EQ(config->monitor.response, 2.0);
  EXPECT_EQ(config->monitor.baseline_m_s2[3], 0.3);
  EXPECT_EQ(config->monitor.speed_error_ratio[2], -0.005);
  EXPECT_EQ(config->monitor.response_sigma_ratio[1], 0.04);
  // Twice the response: the same mass shakes twice as much.
  const double speed2 = 0.69 * 9.81 / (4.0 * 7.64e-6);
  EXPECT_NEAR(config->monitor.smallest_m_s2, 2.0 * 15e-6 * 0.1 * speed2 / 0.69, 1e-9);
  EXPECT_EQ(config->monitor.baseline_power_m2_s4[0], 0.5);
}

TEST_F(UnbalanceConfigTest, ACalibratedPowerIsWhatWasFeltWhateverTheThresholds) {
  write("calibration.toml", to_toml(quad_calibration()));
  for (const char* threshold : {"unit = \"mg\"\nadvisory = 15\ncaution = 60\nusual = 80\n",
                                "unit = \"m_s2\"\nadvisory = 0.3\ncaution = 1\nusual = 0.5\n"}) {
    const auto config = load("vehicle = \"vehicle.toml\"\ncalibration = \"calibration.toml\"\n[threshold]\n" +
                             std::string{threshold});
    ASSERT_TRUE(config.has_value()) << config.error().text;
    EXPECT_EQ(config->monitor.baseline_power_m2_s4[0], 0.5);
  }
}

TEST_F(UnbalanceConfigTest, ACalibrationThatDoesNotFitIsRefused) {
  const std::string text =
      "vehicle = \"vehicle.toml\"\ncalibration = \"calibration.toml\"\n" + std::string{kThreshold};
  Calibration foreign = quad_calibration();
  foreign.vehicle = "hexa";
  write("calibration.toml", to_toml(foreign));
  EXPECT_EQ(error_of(text), "unbalance.toml:2:1: calibration: is of vehicle \"hexa\", not of \"medium\"");
  Calibration larger = quad_calibration();
  larger.rotors.push_back({0.1, 0.1, 0.0, 0.0, 0.25});
  write("calibration.toml", to_toml(larger));
  EXPECT_EQ(error_of(text),
            "unbalance.toml:2:1: calibration: is for 5 rotors, the vehicle has 4. Calibrate again.");
  write("calibration.toml", to_toml(quad_calibration()));
  EXPECT_EQ(error_of(text + "[input]\naccel_low_pass_Hz = 90\n"),
            "unbalance.toml:2:1: calibration: was learned with input.accel_low_pass_Hz = 0, which is now 90. "
            "Calibrate again.");
  write("calibration.toml", "vehicle = \"medium\"\ngyro_noise_rad_s = 0.01\n");
  EXPECT_EQ(error_of(text), "calibration.toml: is a calibration for airworthy-effectiveness");
  write("calibration.toml", "vehicle = \"medium\"\n[[configuration]]\nairspeed_sensor = false\n");
  EXPECT_EQ(error_of(text), "calibration.toml: is a calibration for airworthy-response");
  write("calibration.toml", "vehicle = \"medium\"\n");
  EXPECT_NE(error_of(text).find("calibration.toml:1:1: rotor: "), std::string::npos) << error_of(text);
}

}  // namespace
}  // namespace airworthy::unbalance
