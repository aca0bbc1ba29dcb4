#include "services/effectiveness/effectiveness_config.h"

#include <gtest/gtest.h>

#include <fstream>

#include "services/effectiveness/calibration.h"
#include "tests/runtime/temporary_folder.h"

namespace airworthy::effectiveness {
namespace {

constexpr const char* kPolicy = "[policy]\nfalse_alarms_per_hour = 1e-4\n";
constexpr const char* kCalibration = "calibration = \"calibration.toml\"\n";

/// All that is mandatory, and these lines.
std::string config_with(const std::string& lines) { return "vehicle = \"vehicle.toml\"\n" + lines + kPolicy; }

class EffectivenessConfigTest : public ::testing::Test {
 protected:
  EffectivenessConfigTest() {
    std::ifstream vehicle{AIRWORTHY_CONFIG "/vehicles/unbalance_medium.toml"};
    write("vehicle.toml", std::string{std::istreambuf_iterator<char>{vehicle}, {}});
    write("plane.toml", "name = \"medium\"\nkind = \"fixed_wing\"\ndescription = \"\"\n");
  }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream{folder_.path() / name} << text;
  }

  [[nodiscard]] rt::Expected<EffectivenessConfig> load(const std::string& text) const {
    write("effectiveness.toml", text);
    return EffectivenessConfig::load((folder_.path() / "effectiveness.toml").string(), {});
  }

  [[nodiscard]] std::string vehicle_hash() const { return load(config_with(""))->vehicle_hash; }
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

Calibration learned(const std::string& vehicle_hash) {
  Calibration calibration;
  calibration.vehicle = "medium";
  calibration.vehicle_hash = vehicle_hash;
  calibration.flights = 2;
  calibration.used_s = 80.0;
  calibration.axis = {{{0.5, 0.01, 0.9}, {1.5, 0.02, 0.8}, {1.25, 0.005, 0.7}}};
  calibration.motor_time_constant_s = 0.025;
  calibration.command_latency_s = 0.006;
  calibration.telemetry_latency_s = 0.012;
  calibration.gyro_noise_rad_s = 0.05;
  calibration.accel_noise_m_s2 = 0.9;
  calibration.smallest_loss_ratio = 0.3;
  return calibration;
}

TEST_F(EffectivenessConfigTest, TheShippedFileSaysWhatIsTheDefault) {
  const auto config = EffectivenessConfig::load(AIRWORTHY_CONFIG "/effectiveness.toml", {});
  ASSERT_TRUE(config.has_value()) << config.error().text;
  EXPECT_EQ(config->vehicle, "hexa");
  const EffectivenessParams defaults;
  EXPECT_EQ(config->monitor.noise.acceleration_ratio, defaults.noise.acceleration_ratio);
  EXPECT_EQ(config->monitor.noise.gain_error_ratio, defaults.noise.gain_error_ratio);
  EXPECT_EQ(config->monitor.noise.disturbance_ratio_per_sqrt_s, defaults.noise.disturbance_ratio_per_sqrt_s);
  EXPECT_EQ(config->monitor.noise.vertical_ratio_per_sqrt_s, defaults.noise.vertical_ratio_per_sqrt_s);
  EXPECT_EQ(config->monitor.false_alarms_per_hour, defaults.false_alarms_per_hour);
  EXPECT_EQ(config->monitor.settle_partial, defaults.settle_partial);
  EXPECT_FALSE(config->monitor.mapping_is_known);
  EXPECT_EQ(config->monitor.learns_inertial_delay, defaults.learns_inertial_delay);
}

TEST_F(EffectivenessConfigTest, EveryProblemIsReportedAtOnce) {
  EXPECT_EQ(error_of("vehicle = \"vehicle.toml\"\n"
                     "extra = 1\n"
                     "[input]\n"
                     "command_latency_ms = -1\n"
                     "[policy]\n"
                     "least_loss_ratio = 0.9\n"),
            "effectiveness.toml:2:1: extra: unknown key\n"
            "effectiveness.toml:4:1: input.command_latency_ms: must lie in [0, 100], is -1\n"
            "effectiveness.toml:5:1: policy.false_alarms_per_hour: missing mandatory key\n"
            "effectiveness.toml:6:1: policy.least_loss_ratio: must lie in [0.05, 0.5], is 0.9");
  EXPECT_EQ(error_of(config_with("") + "settle_s = 5.0\n"),
            "effectiveness.toml:2:1: policy.settle_partial_s: 3 must not be less than settle_s (5)");
  EXPECT_EQ(error_of("vehicle = \"plane.toml\"\n" + std::string{kPolicy}),
            "effectiveness.toml:1:1: vehicle: has no table [multirotor]: there are no rotors to watch");
}

TEST_F(EffectivenessConfigTest, ACalibrationComesBackAsItWasWritten) {
  write("calibration.toml", to_toml(learned(vehicle_hash())));
  const auto plain = load(config_with(""));
  const auto config = load(config_with(kCalibration));
  ASSERT_TRUE(plain.has_value()) << plain.error().text;
  ASSERT_TRUE(config.has_value()) << config.error().text;
  EXPECT_TRUE(config->is_calibrated);
  const auto& before = plain->monitor.effectiveness.per_speed2;
  const auto& after = config->monitor.effectiveness.per_speed2;
  EXPECT_DOUBLE_EQ(after[kRollRow][2], 0.5 * before[kRollRow][2]);
  EXPECT_DOUBLE_EQ(after[kPitchRow][0], 1.5 * before[kPitchRow][0]);
  EXPECT_DOUBLE_EQ(after[kVerticalRow][3], 1.25 * before[kVerticalRow][3]);
  EXPECT_DOUBLE_EQ(after[kYawRow][1], before[kYawRow][1]);
  EXPECT_EQ(config->monitor.speeds.time_constant_s, 0.025);
  EXPECT_EQ(config->monitor.speeds.command_latency, Duration{6'000});
  EXPECT_EQ(config->monitor.speeds.telemetry_latency, Duration{12'000});
  EXPECT_EQ(config->monitor.noise.gyro_rad_s, 0.05);
  EXPECT_TRUE(config->monitor.mapping_is_known);
  EXPECT_NE(config->hash, plain->hash);
}

TEST_F(EffectivenessConfigTest, ACalibrationShowsTheNumberingOnlyWhereRollAndPitchWereExcited) {
  const auto is_known = [this](const std::string& calibration, const std::string& input = "") {
    write("calibration.toml", calibration);
    const auto config = load(config_with(kCalibration + input));
    EXPECT_TRUE(config.has_value()) << (config ? "" : config.error().text);
    return config && config->monitor.mapping_is_known;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Calibration one = learned(vehicle_hash());
    one.axis[axis].is_excited = false;
    EXPECT_EQ(is_known(to_toml(one)), axis == 2) << axis;
    EXPECT_TRUE(is_known(to_toml(one), "[input]\nrotor_mapping_checked = true\n")) << axis;
  }
  std::string unsaid = to_toml(learned(vehicle_hash()));
  for (std::size_t at = unsaid.find("excited = true"); at != std::string::npos;
       at = unsaid.find("excited = true"))
    unsaid.erase(at, std::string{"excited = true"}.size());
  EXPECT_FALSE(is_known(unsaid));
}

TEST_F(EffectivenessConfigTest, TheInertialDelayIsLearnedOfAtMost1000SamplesASecond) {
  EXPECT_EQ(
      error_of(config_with("[input]\nimu_rate_Hz = 2000\ninertial_delay_learned = true\n")),
      "effectiveness.toml:3:1: input.imu_rate_Hz: 2000 is more than the 1000 of which inertial_delay_learned "
      "can learn a delay");
  EXPECT_TRUE(load(config_with("[input]\nimu_rate_Hz = 1000\ninertial_delay_learned = true\n")).has_value());
  EXPECT_TRUE(load(config_with("[input]\nimu_rate_Hz = 2000\n")).has_value());
}

TEST_F(EffectivenessConfigTest, ACalibrationOfAnotherVehicleIsRefused) {
  Calibration other = learned(vehicle_hash());
  other.vehicle = "small";
  write("calibration.toml", to_toml(other));
  EXPECT_EQ(error_of(config_with(kCalibration)),
            "effectiveness.toml:2:1: calibration: is of vehicle \"small\", not of \"medium\"");
}

TEST_F(EffectivenessConfigTest, ACalibrationWithAnotherContentOfTheVehicleFileIsRefused) {
  write("calibration.toml", to_toml(learned("0123456789abcdef")));
  EXPECT_EQ(error_of(config_with(kCalibration)),
            "effectiveness.toml:2:1: calibration: was learned with another content of the file of vehicle "
            "\"medium\": calibrate again");
}

TEST_F(EffectivenessConfigTest, NoMoreSamplesMayWaitThanTheDetectorHolds) {
  EXPECT_EQ(
      error_of(config_with("[input]\nimu_rate_Hz = 4000\n")),
      "effectiveness.toml:2:1: input.most_wait_ms: at imu_rate_Hz = 4000 that is 80 samples; the detector "
      "holds 60");
  EXPECT_TRUE(load(config_with("[input]\nimu_rate_Hz = 4000\nmost_wait_ms = 15\n")).has_value());
}

}  // namespace
}  // namespace airworthy::effectiveness
