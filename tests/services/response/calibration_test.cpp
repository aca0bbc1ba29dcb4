#include "services/response/calibration.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "services/response/response_config.h"

namespace airworthy::response {
namespace {

class CalibrationTest : public ::testing::Test {
 protected:
  CalibrationTest() {
    std::filesystem::create_directories(folder_);
    write("vehicle.toml", "name = \"v1\"\nkind = \"fixed_wing\"\ndescription = \"\"\n");
    write("response.toml", R"(vehicle = "vehicle.toml"
calibration = "calibration.toml"
[[channel]]
name = "thrust"
component = "engine"
fault_kind = "thrust_loss"
severity = "warning"
summary = "s"
response = {signal = "accel_x_m_s2"}
alternative = "shift"
side = "low"
terms = [{signal = "pitch_rad", lowpass_s = 2.0, delay_s = 0.1, minus_delay_s = 0.3}, {signal = "one"}]
drift_sigmas = 1.25
threshold = 8.0
)");
    Calibration::Configuration& configuration = calibration_.configurations.emplace_back();
    configuration.airspeed_sensor = true;
    configuration.flights = 3;
    configuration.flown_s = 300.0;
    Calibration::Channel& channel = configuration.channels.emplace_back();
    channel.name = "thrust";
    channel.model = {"accel_x_m_s2", "pitch_rad lowpass 2 s delay 0.1 s minus delay 0.3 s", "one"};
    channel.prior.theta = {5.1, 1.0 / 3.0};
    channel.prior.gram = {0.01, 0.002, 0.002, 1.0};
    channel.prior.sigma = 0.25;
    channel.prior.threshold = 6.5;
    channel.prior.worth_samples = 300;
    channel.samples = 3000;
    channel.flight_spread = 0.05;
    calibration_.vehicle = "v1";
    calibration_.false_alarms_per_hour = 0.01;
  }
  ~CalibrationTest() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream{folder_ / name} << text;
  }

  [[nodiscard]] std::string without_folder(std::string error) const {
    const std::string prefix = folder_.string() + "/";
    for (std::size_t at = error.find(prefix); at != std::string::npos; at = error.find(prefix)) {
      error.erase(at, prefix.size());
    }
    return error;
  }

  [[nodiscard]] std::string config_error() const {
    write("calibration.toml", to_toml(calibration_));
    const auto config = ResponseConfig::load(path("response.toml"), {});
    return config ? "no error" : without_folder(config.error().text);
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("calibration_test_" + std::to_string(getpid()));
  Calibration calibration_;
};

TEST_F(CalibrationTest, IsReadAsItWasWritten) {
  write("calibration.toml", to_toml(calibration_));
  const auto read = load_calibration(path("calibration.toml"));
  ASSERT_TRUE(read) << read.error().text;
  EXPECT_EQ(to_toml(*read), to_toml(calibration_));
  EXPECT_EQ(read->configurations[0].channels[0].prior.theta[1], 1.0 / 3.0);
}

TEST_F(CalibrationTest, MakesTheMonitorStartWarm) {
  write("calibration.toml", to_toml(calibration_));
  const auto config = ResponseConfig::load(path("response.toml"), {});
  ASSERT_TRUE(config) << config.error().text;
  ASSERT_EQ(config->monitor.configuration_count, 1);
  EXPECT_TRUE(config->monitor.configurations[0].airspeed_sensor);
  ASSERT_TRUE(config->monitor.configurations[0].priors[0]);
  EXPECT_EQ(config->monitor.configurations[0].priors[0]->threshold, 6.5);
  const auto cold = ResponseConfig::load_cold(path("response.toml"), {});
  ASSERT_TRUE(cold) << cold.error().text;
  EXPECT_EQ(cold->monitor.configuration_count, 0);
  EXPECT_NE(cold->hash, config->hash);
}

TEST_F(CalibrationTest, OfAnotherVehicleIsRefused) {
  calibration_.vehicle = "v2";
  EXPECT_EQ(config_error(), "response.toml:2:1: calibration: is of vehicle \"v2\", not of \"v1\"");
}

TEST_F(CalibrationTest, OfAChangedModelIsRefused) {
  calibration_.configurations[0].channels[0].model[1] = "pitch_rad";
  EXPECT_EQ(
      config_error(),
      "response.toml:2:1: calibration: channel \"thrust\" was calibrated for the model [accel_x_m_s2, "
      "pitch_rad, "
      "one] but is configured as [accel_x_m_s2, pitch_rad lowpass 2 s delay 0.1 s minus delay 0.3 s, one]. "
      "Calibrate again.");
}

TEST_F(CalibrationTest, OfAnUnknownChannelIsRefused) {
  calibration_.configurations[0].channels[0].name = "yaw";
  EXPECT_EQ(config_error(),
            "response.toml:2:1: calibration: channel \"yaw\" was calibrated but is not configured; there "
            "are: thrust. "
            "Calibrate again.");
}

TEST_F(CalibrationTest, EveryProblemOfTheFileIsReportedAtOnce) {
  write("calibration.toml", R"(vehicle = "v1"
false_alarms_per_hour = 0
[[configuration]]
airspeed_sensor = 1
[[configuration.channel]]
name = "thrust"
model = ["accel_x_m_s2", "pitch_rad", "one"]
theta = [1.0]
gram = [1.0, 0.0, 0.0, 1.0]
sigma = -1.0
threshold = 0.0
worth_samples = 3
)");
  const auto config = ResponseConfig::load(path("response.toml"), {});
  ASSERT_FALSE(config);
  EXPECT_EQ(
      without_folder(config.error().text),
      "calibration.toml:2:1: false_alarms_per_hour: must lie in (0, 1000], is 0\n"
      "calibration.toml:4:1: configuration[0].airspeed_sensor: expected a boolean, found the integer 1\n"
      "calibration.toml:8:1: configuration[0].channel[0].theta: 1 values for a model of 2 terms\n"
      "calibration.toml:10:1: configuration[0].channel[0].sigma: must lie in (0, 1000000000], is -1\n"
      "calibration.toml:11:1: configuration[0].channel[0].threshold: must lie in [0.1, 1000], is 0\n"
      "calibration.toml:12:1: configuration[0].channel[0].worth_samples: must lie in [36, 10000000], is 3");
}

}  // namespace
}  // namespace airworthy::response
