#include "services/actuator/actuator_config.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace airworthy::actuator {
namespace {

const std::string kShipped = AIRWORTHY_SOURCE_DIR "/config/actuator.toml";

TEST(ActuatorConfig, TheShippedFileIsValidAndSaysTheDefaults) {
  const auto config = ActuatorConfig::load(kShipped, {});
  ASSERT_TRUE(config) << config.error().text;
  EXPECT_EQ(config->vehicle, "hexa");
  EXPECT_EQ(config->monitor.vehicle.rotor_count, 6U);
  const ActuatorMonitorParams defaults;
  EXPECT_EQ(config->monitor.gyro_sigma_rad_s, defaults.gyro_sigma_rad_s);
  EXPECT_EQ(config->monitor.disturbance_ratio, defaults.disturbance_ratio);
  EXPECT_EQ(config->monitor.height_disturbance_ratio, defaults.height_disturbance_ratio);
  EXPECT_EQ(config->monitor.first_spread, defaults.first_spread);
  EXPECT_EQ(config->monitor.settle, defaults.settle);
  EXPECT_EQ(config->monitor.rotor.loss, defaults.rotor.loss);
  EXPECT_EQ(config->monitor.rotor.probability, defaults.rotor.probability);
  EXPECT_EQ(config->monitor.rotor.persistence, defaults.rotor.persistence);
  EXPECT_TRUE(config->monitor.rotor.life_cycle.latched);
  EXPECT_EQ(config->monitor.axis.persistence, defaults.axis.persistence);
  EXPECT_FALSE(config->monitor.axis.life_cycle.latched);
}

/// The shipped file with one key changed, in a folder of its own.
class ActuatorConfigTest : public ::testing::Test {
 protected:
  ActuatorConfigTest() {
    std::filesystem::create_directories(folder_ / "vehicles");
    std::filesystem::copy_file(AIRWORTHY_SOURCE_DIR "/config/multirotor.toml", folder_ / "multirotor.toml");
    std::ofstream{folder_ / "vehicles/plane.toml"} << "name = \"p\"\nkind = \"fixed_wing\"\n";
  }
  ~ActuatorConfigTest() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string error_with(const std::string& key, const std::string& value) const {
    std::ifstream in{kShipped};
    std::ofstream out{folder_ / "actuator.toml"};
    for (std::string line; std::getline(in, line);) {
      out << (line.rfind(key + " = ", 0) == 0 ? key + " = " + value : line) << '\n';
    }
    out.close();
    const auto config = ActuatorConfig::load((folder_ / "actuator.toml").string(), {});
    if (config) return "no error";
    const std::string text = config.error().text;
    return text.substr(text.find(": ") + 2);
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("actuator_config_test_" + std::to_string(getpid()));
};

TEST_F(ActuatorConfigTest, EachRuleIsKept) {
  EXPECT_EQ(error_with("vehicle", "\"vehicles/plane.toml\""),
            "vehicle: \"p\" has no table [multirotor]: rotors must be known");
  EXPECT_NE(error_with("source", "\"esc\"").find("input.source: must be one of auto, speed, command"),
            std::string::npos);
  EXPECT_NE(error_with("gyro_sigma_rad_s", "0.0").find("input.gyro_sigma_rad_s"), std::string::npos);
  EXPECT_NE(error_with("roll_pitch_ratio", "-1.0").find("disturbance.roll_pitch_ratio"), std::string::npos);
  EXPECT_NE(error_with("prior_sigma", "\"wide\"").find("loss.prior_sigma"), std::string::npos);
  EXPECT_NE(error_with("probability", "1.0").find("rotor.probability"), std::string::npos);
  EXPECT_NE(error_with("state_period_s", "-0.1").find("output.state_period_s"), std::string::npos);
  EXPECT_EQ(error_with("nothing", "1"), "no error");
}

TEST_F(ActuatorConfigTest, AnOverrideCounts) {
  const auto config = ActuatorConfig::load(kShipped, {"rotor.loss_ratio=0.3"});
  ASSERT_TRUE(config) << config.error().text;
  EXPECT_EQ(config->monitor.rotor.loss, 0.3);
}

}  // namespace
}  // namespace airworthy::actuator
