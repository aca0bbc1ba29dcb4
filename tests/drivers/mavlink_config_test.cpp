#include "drivers/mavlink/mavlink_config.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

namespace airworthy::drivers {
namespace {

/// A folder with a vehicle file, and a process file of the given text.
class MavlinkConfigTest : public ::testing::Test {
 protected:
  MavlinkConfigTest() {
    std::filesystem::create_directories(folder_);
    std::ofstream{folder_ / "vehicle.toml"} << "name = \"quad1\"\nkind = \"multirotor\"\n";
  }
  ~MavlinkConfigTest() override { std::filesystem::remove_all(folder_); }
  rt::Expected<MavlinkConfig> load(const std::string& text) {
    std::ofstream{folder_ / "mavlink.toml"} << "vehicle = \"vehicle.toml\"\n" << text;
    return MavlinkConfig::load((folder_ / "mavlink.toml").string(), {});
  }
  /// The whole message without the folder.
  std::string error(const std::string& text) {
    const auto config = load(text);
    if (config) return "";
    std::string message = config.error().text;
    for (std::size_t at = 0; (at = message.find(folder_.string() + "/")) != std::string::npos;) {
      message.erase(at, folder_.string().size() + 1);
    }
    return message;
  }
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("mavlink_config_test_" + std::to_string(getpid()));
};

constexpr const char* kLink = "link = \"tcp:127.0.0.1:5760\"\n";

TEST(MavlinkConfigFile, TheShippedOneHoldsTheDefaults) {
  const auto shipped = MavlinkConfig::load(AIRWORTHY_SOURCE_DIR "/config/mavlink.toml", {});
  ASSERT_TRUE(shipped) << shipped.error().text;
  EXPECT_FALSE(shipped->vehicle.empty());
  EXPECT_EQ(shipped->link.kind, LinkKind::kUdpListen);
  EXPECT_EQ(shipped->imu_sources, (std::vector<std::uint32_t>{105, 27, 26, 116, 129}));
  EXPECT_EQ(shipped->rotor_of_esc, std::vector<int>{1});
  EXPECT_TRUE(std::isnan(shipped->averaging_window_s));
}

TEST_F(MavlinkConfigTest, DefaultsAndEveryKey) {
  const auto defaults = load(kLink);
  ASSERT_TRUE(defaults) << defaults.error().text;
  EXPECT_EQ(defaults->own_component_id, 191);
  EXPECT_EQ(defaults->field_timeout, Duration{3'000'000});
  const auto config = load(std::string{"silence_s = 20.0\n"} + kLink + R"(
[autopilot]
system_id = 7
component_id = 2
kind = "ardupilot"
[imu]
sources = ["SCALED_IMU2"]
raw_imu_unit = "none"
averaging_window_s = 0.0
[rotors]
count = 2
rotor_of_esc = [2, 0, 1]
[rotor_command]
source = "SERVO_OUTPUT_RAW"
output = [{output = 3, port = 1, rotor = 2, stopped = 1100, full = 1900}]
[flight_state]
field_timeout_s = 1.5
airspeed_error_unit = "m_s"
[send]
heartbeat = false
timesync_rate_Hz = 0.0
system_id = 9
component_id = 192
request = [{message = "ESC_STATUS", rate_Hz = 50.0}]
)");
  ASSERT_TRUE(config) << config.error().text;
  EXPECT_EQ(config->silence, Duration{20'000'000});
  EXPECT_EQ(config->system_id, 7);
  EXPECT_EQ(config->component_id, 2);
  EXPECT_EQ(config->autopilot, Autopilot::kArdupilot);
  EXPECT_EQ(config->imu_sources, std::vector<std::uint32_t>{116});
  EXPECT_EQ(config->raw_imu_unit, RawImuUnit::kNone);
  EXPECT_EQ(config->averaging_window_s, 0.0);
  EXPECT_EQ(config->rotor_of_esc, (std::vector<int>{2, 0, 1}));
  ASSERT_EQ(config->outputs.size(), 1U);
  EXPECT_EQ(config->outputs[0].port, 1);
  EXPECT_EQ(config->outputs[0].full, 1900.0);
  EXPECT_EQ(config->airspeed_error_unit, AirspeedErrorUnit::kMetresPerSecond);
  EXPECT_FALSE(config->send_heartbeat);
  EXPECT_EQ(config->own_system_id, 9);
  ASSERT_EQ(config->requests.size(), 1U);
  EXPECT_EQ(config->requests[0].message_id, 291U);
  EXPECT_NE(config->hash, defaults->hash);
}

TEST(MavlinkConfigFile, RotorsAreAsManyAsTheVehicleFileDescribes) {
  const std::string multirotor = AIRWORTHY_SOURCE_DIR "/config/mavlink_multirotor.toml";
  const auto shipped = MavlinkConfig::load(multirotor, {});
  ASSERT_TRUE(shipped) << shipped.error().text;
  EXPECT_EQ(shipped->rotor_count, 6);
  EXPECT_EQ(shipped->outputs.size(), 6U);
  const auto more = MavlinkConfig::load(multirotor, {"rotors.count=8"});
  ASSERT_FALSE(more);
  EXPECT_EQ(more.error().text, "--set rotors.count: 8, but vehicle \"hexa\" is described with 6 rotors");
  const auto quad = MavlinkConfig::load(AIRWORTHY_SOURCE_DIR "/config/mavlink.toml",
                                        {"vehicle=" AIRWORTHY_SOURCE_DIR "/config/vehicles/f450.toml"});
  ASSERT_FALSE(quad);
  EXPECT_NE(quad.error().text.find("rotors.count: 1, but vehicle \"f450\" is described with 4 rotors"),
            std::string::npos)
      << quad.error().text;
}

TEST_F(MavlinkConfigTest, SaysWhatIsWrongAndWhere) {
  EXPECT_EQ(error("link = \"udp:host:1\"\n"), "mavlink.toml:2:1: link: the address must be numeric");
  EXPECT_EQ(error(std::string{kLink} + "[imu]\nsources = [\"GPS_RAW_INT\"]\n"),
            "mavlink.toml:4:1: imu.sources: \"GPS_RAW_INT\" is not one of HIGHRES_IMU, RAW_IMU, SCALED_IMU, "
            "SCALED_IMU2, SCALED_IMU3");
  EXPECT_EQ(error(std::string{kLink} + "[rotors]\ncount = 2\nrotor_of_esc = [1, 3]\n"),
            "mavlink.toml:5:1: rotors.rotor_of_esc: rotor 3 exceeds count (2)");
  EXPECT_EQ(error(std::string{kLink} + "[rotors]\nrotor_of_esc = [1, 1]\n"),
            "mavlink.toml:4:1: rotors.rotor_of_esc: rotor 1 is given twice");
  EXPECT_EQ(error(std::string{kLink} + "[rotor_command]\nsource = \"SERVO_OUTPUT_RAW\"\n"),
            "mavlink.toml:4:1: rotor_command.source: needs at least one [[rotor_command.output]]");
  EXPECT_EQ(error(std::string{kLink} +
                  "[[rotor_command.output]]\noutput = 1\nrotor = 5\n[[rotor_command.output]]\noutput = 2\n"
                  "rotor = 1\nstopped = 1000\nfull = 1000\n"),
            "mavlink.toml:5:1: rotor_command.output[0].rotor: 5 exceeds rotors.count (4)\n"
            "mavlink.toml:10:1: rotor_command.output[1].full: must differ from stopped (1000)");
  EXPECT_EQ(error(std::string{kLink} + "[[send.request]]\nmessage = \"HIGH_IMU\"\nrate_Hz = 5\n"),
            "mavlink.toml:4:1: send.request[0].message: \"HIGH_IMU\" is no MAVLink message");
}

}  // namespace
}  // namespace airworthy::drivers
