#include "services/response/response_config.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace airworthy::response {
namespace {

class ResponseConfigTest : public ::testing::Test {
 protected:
  ResponseConfigTest() {
    std::filesystem::create_directories(folder_);
    write("vehicle.toml", "name = \"v1\"\nkind = \"fixed_wing\"\ndescription = \"\"\n");
  }
  ~ResponseConfigTest() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream{folder_ / name} << text;
  }

  // The error text with the folder taken out.
  [[nodiscard]] std::string error_of(const std::string& text) const {
    write("response.toml", text);
    const auto config = ResponseConfig::load((folder_ / "response.toml").string(), {});
    if (config) return "no error";
    std::string error = config.error().text;
    const std::string prefix = folder_.string() + "/";
    for (std::size_t at = error.find(prefix); at != std::string::npos; at = error.find(prefix)) {
      error.erase(at, prefix.size());
    }
    return error;
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("response_config_test_" + std::to_string(getpid()));
};

TEST_F(ResponseConfigTest, TheShippedFileIsValid) {
  const auto config = ResponseConfig::load(AIRWORTHY_SOURCE_DIR "/config/response.toml", {});
  ASSERT_TRUE(config) << config.error().text;
  EXPECT_EQ(config->monitor.channel_count, static_cast<int>(config->channels.size()));
  EXPECT_EQ(config->channels[0].component, "engine");
  EXPECT_EQ(config->monitor.channels[0].term_count, 8);
  EXPECT_EQ(config->monitor.channels[1].terms[1].delay_ticks, 3);
}

TEST_F(ResponseConfigTest, EveryProblemIsReportedAtOnce) {
  EXPECT_EQ(
      error_of(R"(vehicle = "vehicle.toml"
[input]
tick_period_s = 0.1
[[channel]]
name = "thrust"
component = "engine"
fault_kind = "thrust_loss"
severity = "terrible"
summary = "s"
response = {signal = "accel_w_m_s2"}
side = "low"
terms = [{signal = "one", delay_s = 0.25}, {signal = "pitch_rad", transform = "cube"}]
drift_sigmas = 5.0
threshold = 8.0
learning_delay_s = 30.0
colour = "red"
)"),
      "response.toml:4:1: channel[0].clip_sigmas: 4 must exceed drift_sigmas (5)\n"
      "response.toml:8:1: channel[0].severity: must be one of advisory, caution, warning, is \"terrible\"\n"
      "response.toml:10:13: channel[0].response.signal: \"accel_w_m_s2\" is not one of one, accel_x_m_s2, "
      "accel_y_m_s2, accel_z_m_s2, roll_rate_rad_s, pitch_rate_rad_s, yaw_rate_rad_s, roll_rad, pitch_rad, "
      "euler_pitch_rate_rad_s, roll_setpoint_rad, pitch_setpoint_rad, roll_error_rad, pitch_error_rad, "
      "altitude_error_m, airspeed_error_m_s, airspeed_m_s, climb_m_s\n"
      "response.toml:12:27: channel[0].terms[0].delay_s: 0.25 is not a multiple of input.tick_period_s "
      "(0.1)\n"
      "response.toml:12:67: channel[0].terms[1].transform: must be one of none, sine, absolute_sine, "
      "load_factor, is \"cube\"\n"
      "response.toml:15:1: channel[0].learning_delay_s: 30 is not between 1 and 127 ticks\n"
      "response.toml:16:1: channel[0].colour: unknown key");
}

TEST_F(ResponseConfigTest, WithoutChannelsThereIsNothingToDo) {
  EXPECT_EQ(error_of("vehicle = \"vehicle.toml\"\n"),
            "response.toml:1:1: channel: 0 channels; must be 1 to 8");
}

}  // namespace
}  // namespace airworthy::response
