#include "sim/config/scenario.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "sim/config/realism.h"
#include "tests/runtime/temporary_folder.h"
#include "tests/sim/vehicles.h"

namespace airworthy::sim {
namespace {

constexpr std::string_view kFlight =
    "[[segment]]\nmanoeuvre = \"ground\"\nduration_s = 1.0\n"
    "[[segment]]\nmanoeuvre = \"take_off\"\nduration_s = 4.0\n"
    "[[segment]]\nmanoeuvre = \"hover\"\nduration_s = 10.0\n";

std::string errors_of(const std::string& text, std::size_t rotors = 4) {
  const rt::TemporaryFolder folder;
  const auto path = folder.write("s.toml", text);
  const auto scenario = Scenario::load(path, rotors);
  std::string errors = scenario ? "" : scenario.error().text;
  for (std::size_t at = 0; (at = errors.find(path.string(), at)) != std::string::npos;) {
    errors.replace(at, path.string().size(), "s.toml");
  }
  return errors;
}

std::string errors_with_fault(const std::string& fault) {
  return errors_of(std::string{kFlight} + "[[fault]]\n" + fault);
}

TEST(Scenario, IsRead) {
  const rt::TemporaryFolder folder;
  const auto path = folder.write("s.toml", std::string{kFlight} +
                                               "[[fault]]\nkind = \"unbalance\"\nrotor = 3\nonset_s = 6.0\n"
                                               "tip_mass_mg = 40.0\ngrowth_mg_per_s = 2.0\nangle_deg = 90\n");
  const auto scenario = Scenario::load(path, 4);
  ASSERT_TRUE(scenario.has_value()) << scenario.error().text;
  EXPECT_EQ(scenario->duration_s(), 15.0);
  ASSERT_EQ(scenario->faults.size(), 1U);
  const Fault& fault = scenario->faults[0];
  EXPECT_EQ(fault.component(), "rotor 3");
  EXPECT_FALSE(fault.is_active(5.9));
  EXPECT_TRUE(fault.is_active(1e5));
  EXPECT_DOUBLE_EQ(fault.magnitude_at(8.0), 44.0);
  ASSERT_TRUE(fault.angle_rad.has_value());
  EXPECT_NEAR(*fault.angle_rad, 1.5707963, 1e-6);
}

TEST(Scenario, EveryBrokenRule) {
  EXPECT_EQ(errors_of(""), "s.toml:1:1: segment: missing mandatory tables, must have at least 1 element");
  EXPECT_EQ(errors_of("[[segment]]\nmanoeuvre = \"hover\"\nduration_s = 1.0\n"),
            "s.toml:2:1: segment[0].manoeuvre: the vehicle is on the ground: take_off first");
  EXPECT_EQ(errors_of(std::string{kFlight} + "[[segment]]\nmanoeuvre = \"take_off\"\nduration_s = 1.0\n"),
            "s.toml:11:1: segment[3].manoeuvre: the vehicle is in the air: land first");
  EXPECT_EQ(errors_of("repeat = true\n" + std::string{kFlight}),
            "s.toml:1:1: repeat: the plan ends in the air and starts on the ground");
  EXPECT_EQ(errors_of("[[segment]]\nmanoeuvre = \"ground\"\nduration_s = 0\nradius_m = 1.0\n"),
            "s.toml:3:1: segment[0].duration_s: must lie in [0.1, 1000000], is 0\n"
            "s.toml:4:1: segment[0].radius_m: unknown key");
  EXPECT_EQ(errors_with_fault("kind = \"partial_loss\"\nrotor = 5\nonset_s = 6.0\nloss_ratio = 1.5\n"),
            "s.toml:12:1: fault[0].rotor: must lie in [1, 4], is 5\n"
            "s.toml:14:1: fault[0].loss_ratio: must lie in [0, 1], is 1.5");
  EXPECT_EQ(errors_with_fault(
                "kind = \"unbalance\"\nrotor = 1\nonset_s = 6.0\ntip_mass_mg = 1.0\nangle_deg = 400\n"),
            "s.toml:15:1: fault[0].angle_deg: must lie in [-360, 360], is 400");
  EXPECT_EQ(errors_with_fault(
                "kind = \"partial_loss\"\nrotor = 1\nonset_s = 6.0\nloss_ratio = 0.5\nangle_deg = 40\n"),
            "s.toml:15:1: fault[0].angle_deg: unknown key");
  EXPECT_EQ(errors_with_fault("kind = \"gyro_bias\"\nrotor = 1\nonset_s = 6.0\nbias_rad_s = 0.1\n"),
            "s.toml:10:1: fault[0].axis: missing mandatory key, one of x, y, z\n"
            "s.toml:12:1: fault[0].rotor: unknown key");
  EXPECT_EQ(errors_with_fault("kind = \"link_loss\"\nlink = \"esc\"\nonset_s = 6.0\nend_s = 5.0\n"),
            "s.toml:14:1: fault[0].end_s: 5 must exceed onset_s (6)");
  EXPECT_EQ(errors_with_fault("kind = \"gyro_drift\"\naxis = \"x\"\nonset_s = 6.0\n"),
            "s.toml:10:1: fault[0].drift_rad_s2: missing mandatory key");
  EXPECT_EQ(errors_with_fault("kind = \"gyro_freeze\"\naxis = \"x\"\nonset_s = 6.0\n"),
            "s.toml:12:1: fault[0].axis: unknown key")
      << "a frozen sensor is so in all axes";
  EXPECT_EQ(errors_with_fault("kind = \"dead_esc\"\nrotor = 1\n"),
            "s.toml:10:1: fault[0].onset_s: missing mandatory key");
  EXPECT_EQ(errors_with_fault("kind = \"dead_esc\"\nrotor = 1\nonset_s = nan\n"),
            "s.toml:13:1: fault[0].onset_s: must be finite, is nan");
}

TEST(Scenario, AnUnknownKindIsTheOnlyComplaint) {
  const std::string errors =
      errors_with_fault("kind = \"explosion\"\nrotor = 9\nloss_ratio = 0.5\nonset_s = 6.0\n");
  EXPECT_EQ(errors.find("s.toml:11:1: fault[0].kind: must be one of unbalance, propeller_lost, "), 0U)
      << errors;
  EXPECT_EQ(errors.find('\n'), std::string::npos) << errors;
  EXPECT_NE(errors.find(", is \"explosion\""), std::string::npos) << errors;
}

TEST(Scenario, EveryKindIsReadUnderItsWord) {
  const std::string common = "onset_s = 6.0\n";
  for (const auto& [word, rest] : std::vector<std::pair<std::string, std::string>>{
           {"unbalance", "rotor = 1\ntip_mass_mg = 10.0\n"},
           {"propeller_lost", "rotor = 1\n"},
           {"partial_loss", "rotor = 1\nloss_ratio = 0.3\n"},
           {"stuck_command", "rotor = 1\n"},
           {"dead_esc", "rotor = 1\n"},
           {"desync", "rotor = 1\n"},
           {"telemetry_frozen", "rotor = 1\n"},
           {"telemetry_wrong_unit", "rotor = 1\npole_pairs = 7\n"},
           {"link_loss", "link = \"autopilot\"\n"},
           {"gyro_bias", "axis = \"x\"\nbias_rad_s = 0.1\n"},
           {"gyro_drift", "axis = \"y\"\ndrift_rad_s2 = 0.1\n"},
           {"gyro_spike", "axis = \"z\"\nspike_rad_s = 0.1\n"},
           {"gyro_freeze", ""},
           {"accel_bias", "axis = \"x\"\nbias_m_s2 = 0.1\n"},
           {"accel_drift", "axis = \"y\"\ndrift_m_s3 = 0.1\n"},
           {"accel_spike", "axis = \"z\"\nspike_m_s2 = 0.1\n"},
           {"accel_freeze", ""}}) {
    EXPECT_EQ(errors_with_fault("kind = \"" + word + "\"\n" + common + rest), "") << word;
    const rt::TemporaryFolder folder;
    const auto path =
        folder.write("s.toml", std::string{kFlight} + "[[fault]]\nkind = \"" + word + "\"\n" + common + rest);
    const auto scenario = Scenario::load(path, 4);
    ASSERT_TRUE(scenario.has_value());
    EXPECT_EQ(word_of(scenario->faults.at(0).kind), word);
  }
}

TEST(Scenario, TheShippedOnesAreValidAndHaveEveryKindOfFault) {
  std::set<FaultKind> shipped;
  for (const auto& entry :
       std::filesystem::directory_iterator{std::string{AIRWORTHY_CONFIG} + "/scenarios"}) {
    const auto scenario = Scenario::load(entry.path(), 4);
    EXPECT_TRUE(scenario.has_value()) << scenario.error().text;
    if (!scenario) continue;
    EXPECT_FALSE(scenario->description.empty()) << entry.path();
    for (const Fault& fault : scenario->faults) shipped.insert(fault.kind);
  }
  for (int kind = 0; kind <= static_cast<int>(FaultKind::kAccelFreeze); ++kind) {
    EXPECT_TRUE(shipped.contains(static_cast<FaultKind>(kind))) << word_of(static_cast<FaultKind>(kind));
  }
}

TEST(Vehicles, TheShippedOnesAreValidAndCanFly) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator{std::string{AIRWORTHY_CONFIG} + "/vehicles"}) {
    const auto file = rt::VehicleFile::load(entry.path());
    ASSERT_TRUE(file.has_value()) << file.error().text;
    ASSERT_TRUE(file->multirotor.has_value()) << entry.path();
    double torque = 0.0;
    for (const Rotor& rotor : file->multirotor->rotors()) torque += rotor.spin;
    EXPECT_EQ(torque, 0.0) << entry.path() << ": as many rotors each way";
    ++count;
  }
  EXPECT_EQ(count, static_cast<int>(kVehicles.size()));
}

TEST(Realism, EveryLevelIsReadAndTheHarderOnesAreHarder) {
  for (const Level level : {Level::kNominal, Level::kHard, Level::kBrutal}) {
    const auto realism = Realism::read(kRealismTable, "realism.toml", level);
    ASSERT_TRUE(realism.has_value()) << realism.error().text;
  }
  const Realism nominal = Realism::at(Level::kNominal);
  const Realism hard = Realism::at(Level::kHard);
  const Realism brutal = Realism::at(Level::kBrutal);
  EXPECT_LT(nominal.wind.mean_m_s, hard.wind.mean_m_s);
  EXPECT_LT(hard.wind.mean_m_s, brutal.wind.mean_m_s);
  EXPECT_GT(nominal.esc.rate_Hz, hard.esc.rate_Hz);
  EXPECT_GT(hard.esc.rate_Hz, brutal.esc.rate_Hz);
}

TEST(Realism, EveryNumberNeedsItsLevelsAndASource) {
  std::string text{kRealismTable};
  const auto at = text.find("source = ");
  text.replace(at, text.find('\n', at) - at, "source = \"\"");
  const auto realism = Realism::read(text, "r.toml", Level::kHard);
  ASSERT_FALSE(realism.has_value());
  EXPECT_NE(realism.error().text.find("imu.rate_Hz.source: must say where the numbers come from"),
            std::string::npos)
      << realism.error().text;
  EXPECT_NE(Realism::read("", "r.toml", Level::kHard).error().text.find("r.toml:1:1: wind: missing"),
            std::string::npos);
}

}  // namespace
}  // namespace airworthy::sim
