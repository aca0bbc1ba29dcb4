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

TEST_F(ResponseConfigTest, TheShippedFilesOfOtherVehiclesAreValid) {
  for (const char* name : {"response_elevon", "response_lift", "response_multirotor"}) {
    const auto config =
        ResponseConfig::load(std::string{AIRWORTHY_SOURCE_DIR "/config/"} + name + ".toml", {});
    ASSERT_TRUE(config) << config.error().text;
    EXPECT_EQ(config->monitor.pace,
              name == std::string{"response_elevon"} ? Pace::kAttitude : Pace::kInertial);
  }
}

TEST_F(ResponseConfigTest, AMultirotorThatIsDescribedIsJudgedByItsFlightPhase) {
  const auto load = [](const char* file, const char* vehicle) {
    return ResponseConfig::load(std::string{AIRWORTHY_SOURCE_DIR "/config/"} + file,
                                {std::string{"vehicle=" AIRWORTHY_SOURCE_DIR "/config/"} + vehicle});
  };
  const auto multirotor = load("response_multirotor.toml", "vehicles/f450.toml");
  ASSERT_TRUE(multirotor) << multirotor.error().text;
  EXPECT_TRUE(multirotor->monitor.needs_flight_phase);
  ASSERT_TRUE(multirotor->multirotor);
  EXPECT_EQ(multirotor->multirotor->rotor_count, 4U);
  const auto fixed_wing = load("response_multirotor.toml", "vehicle.toml");
  ASSERT_TRUE(fixed_wing) << fixed_wing.error().text;
  EXPECT_FALSE(fixed_wing->monitor.needs_flight_phase);
  const auto by_attitude = load("response_elevon.toml", "vehicles/f450.toml");
  ASSERT_TRUE(by_attitude) << by_attitude.error().text;
  EXPECT_FALSE(by_attitude->monitor.needs_flight_phase) << "too little inertial data to tell it by";
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
      "altitude_error_m, airspeed_error_m_s, airspeed_m_s, climb_m_s, thrust_setpoint_ratio, "
      "command_0_ratio, "
      "command_1_ratio, command_2_ratio, command_3_ratio, command_4_ratio, command_5_ratio, command_6_ratio, "
      "command_7_ratio\n"
      "response.toml:12:27: channel[0].terms[0].delay_s: 0.25 is not a multiple of input.tick_period_s "
      "(0.1)\n"
      "response.toml:12:67: channel[0].terms[1].transform: must be one of none, sine, absolute_sine, "
      "load_factor, is \"cube\"\n"
      "response.toml:15:1: channel[0].learning_delay_s: 30 is not between 1 and 127 ticks\n"
      "response.toml:16:1: channel[0].colour: unknown key");
}

TEST_F(ResponseConfigTest, TheFileOfThePublishedMethodIsValidAndSaysWhatWasPublished) {
  const auto config = ResponseConfig::load(AIRWORTHY_SOURCE_DIR "/config/response_arx.toml", {});
  ASSERT_TRUE(config) << config.error().text;
  ASSERT_EQ(config->monitor.channel_count, 2);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(config->monitor.methods[i], Method::kArx);
    const ArxParams& arx = config->monitor.arx[i];
    EXPECT_EQ(arx.past_outputs, 25);
    EXPECT_EQ(arx.past_inputs, 25);
    EXPECT_EQ(arx.forgetting, 1.0);
    EXPECT_EQ(arx.threshold_sigmas, 4.5);
    EXPECT_EQ(arx.arm_after_samples, 200);
    EXPECT_EQ(arx.samples, Samples::kEverySetpoint);
    EXPECT_EQ(config->channels[i].unit, "rad");
  }
  EXPECT_EQ(config->monitor.arx[0].output, Signal::kRoll);
  EXPECT_EQ(config->monitor.arx[0].input, Signal::kRollSetpoint);
  EXPECT_EQ(config->monitor.arx[1].output, Signal::kPitch);
  EXPECT_EQ(config->monitor.arx[1].input, Signal::kPitchSetpoint);
}

TEST_F(ResponseConfigTest, ProblemsOfAnArxChannel) {
  EXPECT_EQ(error_of(R"(vehicle = "vehicle.toml"
[[channel]]
name = "roll"
component = "roll control"
fault_kind = "response_anomaly"
severity = "warning"
summary = "s"
method = "arx"
output = "accel_x_m_s2"
input = "roll_rad"
samples = "stale"
past_outputs = 26
forgetting = 1.5
threshold_sigmas = 0.0
drift_sigmas = 1.0
[[channel]]
name = "pitch"
component = "pitch control"
fault_kind = "response_anomaly"
severity = "warning"
summary = "s"
method = "arx"
output = "pitch_rad"
input = "pitch_setpoint_rad"
arm_after_samples = 40
[[channel]]
name = "thrust"
component = "engine"
fault_kind = "thrust_loss"
severity = "warning"
summary = "s"
method = "neural"
response = {signal = "accel_x_m_s2"}
side = "low"
terms = [{signal = "one"}]
drift_sigmas = 1.0
threshold = 8.0
)"),
            "response.toml:9:1: channel[0].output: must be one of roll_rad, pitch_rad, is \"accel_x_m_s2\"\n"
            "response.toml:10:1: channel[0].input: must be one of roll_setpoint_rad, pitch_setpoint_rad, is "
            "\"roll_rad\"\n"
            "response.toml:11:1: channel[0].samples: must be one of every_setpoint, fresh, is \"stale\"\n"
            "response.toml:12:1: channel[0].past_outputs: must lie in [0, 25], is 26\n"
            "response.toml:13:1: channel[0].forgetting: must lie in [0.5, 1], is 1.5\n"
            "response.toml:14:1: channel[0].threshold_sigmas: must lie in [0.5, 1000], is 0\n"
            "response.toml:15:1: channel[0].drift_sigmas: unknown key\n"
            "response.toml:25:1: channel[1].arm_after_samples: 40 samples cannot tell 51 coefficients apart\n"
            "response.toml:32:1: channel[2].method: must be one of regression, arx, is \"neural\"");
}

TEST_F(ResponseConfigTest, WithoutChannelsThereIsNothingToDo) {
  EXPECT_EQ(error_of("vehicle = \"vehicle.toml\"\n"),
            "response.toml:1:1: channel: 0 channels; must be 1 to 8");
}

}  // namespace
}  // namespace airworthy::response
