#include "runtime/config/vehicle.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/runtime/config_support.h"
#include "tests/runtime/temporary_folder.h"

namespace airworthy::rt {
namespace {

std::string errors_of_vehicle(std::string_view text) {
  const auto vehicle = VehicleFile::read(ConfigFile::parse(text, "v.toml"));
  return vehicle ? "" : vehicle.error().text;
}

TEST(Vehicle, IsRead) {
  const auto vehicle = VehicleFile::read(ConfigFile::parse(
      "name = \"Hexa_1-b\"\nkind = \"fixed_wing\"\ndescription = \"Skywalker X8\"\n", "v.toml"));
  ASSERT_TRUE(vehicle.has_value()) << vehicle.error().text;
  EXPECT_EQ(vehicle->name, "Hexa_1-b");
  EXPECT_EQ(vehicle->kind, VehicleKind::kFixedWing);
  EXPECT_EQ(vehicle->description, "Skywalker X8");
  EXPECT_EQ(vehicle->hash.size(), 16U);
}

TEST(Vehicle, EveryBrokenRule) {
  EXPECT_EQ(errors_of_vehicle(""),
            "v.toml:1:1: name: missing mandatory key\n"
            "v.toml:1:1: kind: missing mandatory key, one of multirotor, fixed_wing");
  EXPECT_EQ(errors_of_vehicle("name = \"a\"\nkind = \"kite\"\ncolour = \"red\"\n"),
            "v.toml:2:1: kind: must be one of multirotor, fixed_wing, is \"kite\"\n"
            "v.toml:3:1: colour: unknown key");
  EXPECT_EQ(errors_of_vehicle("name = 3\nkind = \"multirotor\"\ndescription = 4\n"),
            "v.toml:1:1: name: expected a string, found the integer 3\n"
            "v.toml:3:1: description: expected a string, found the integer 4");
}

TEST(Vehicle, NameIsFitForAChannel) {
  const auto error_of_name = [](const std::string& name) {
    return errors_of_vehicle("kind = \"multirotor\"\nname = \"" + name + "\"\n");
  };
  for (const std::string name : {"a", "Z9_-", "0123456789abcdef"}) EXPECT_EQ(error_of_name(name), "") << name;
  for (const std::string name : {"", "0123456789abcdefg", "a b", "a/b", "a.b", "ä", "a\\n"}) {
    EXPECT_EQ(error_of_name(name), "v.toml:2:1: name: must be 1 to 16 of A-Z a-z 0-9 _ -") << name;
  }
}

TEST(Vehicle, IsNamedByAProcessFile) {
  const TemporaryFolder folder;
  folder.write("vehicle.toml", "name = \"quad1\"\nkind = \"multirotor\"\n");
  const auto path = folder.write("process.toml", "vehicle = \"vehicle.toml\"\n");
  auto file = ConfigFile::load(path);
  const VehicleFile vehicle = VehicleFile::named_by(file.root());
  EXPECT_EQ(vehicle.name, "quad1");
  EXPECT_EQ(errors_of(file), "");

  // What the vehicle file says is part of what the process runs with.
  const std::string hash = file.hash();
  folder.write("vehicle.toml", "name = \"quad2\"\nkind = \"multirotor\"\n");
  auto changed = ConfigFile::load(path);
  EXPECT_EQ(VehicleFile::named_by(changed.root()).name, "quad2");
  EXPECT_NE(changed.hash(), hash);
}

TEST(Vehicle, ErrorsOfBothFilesAreReported) {
  const TemporaryFolder folder;
  const auto vehicle_path = folder.write("v.toml", "name = \"quad 1\"\nkind = \"multirotor\"\n");
  const auto path = folder.write("process.toml", "vehicle = \"v.toml\"\nextra = 1\n");
  auto file = ConfigFile::load(path);
  EXPECT_EQ(VehicleFile::named_by(file.root()).name, "");
  EXPECT_EQ(errors_of(file), path.string() + ":2:1: extra: unknown key\n" + vehicle_path.string() +
                                 ":1:1: name: must be 1 to 16 of A-Z a-z 0-9 _ -");
}

TEST(Vehicle, FileThatIsNotThere) {
  auto file = ConfigFile::parse("vehicle = \"nope.toml\"\n", "/nowhere/process.toml");
  EXPECT_EQ(VehicleFile::named_by(file.root()).name, "");
  EXPECT_EQ(errors_of(file), "/nowhere/nope.toml: cannot be opened: No such file or directory");
  auto unnamed = ConfigFile::parse("", "process.toml");
  EXPECT_EQ(VehicleFile::named_by(unnamed.root()).name, "");
  EXPECT_EQ(errors_of(unnamed), "process.toml:1:1: vehicle: missing mandatory key");
}

TEST(Vehicle, NothingIsSaidOfWhatAFileDoesNotHaveThatIsNotThere) {
  auto file = ConfigFile::parse("vehicle = \"nope.toml\"\n", "/nowhere/process.toml");
  ConfigTable root = file.root();
  if (!VehicleFile::named_by(root).multirotor) root.fail("vehicle", "has no table [multirotor]");
  EXPECT_EQ(errors_of(file), "/nowhere/nope.toml: cannot be opened: No such file or directory");
}

const std::filesystem::path kShipped = std::filesystem::path{AIRWORTHY_SOURCE_DIR} / "config";

TEST(Vehicle, ShippedFilesAreValid) {
  std::vector<std::filesystem::path> files{kShipped / "vehicle.toml", kShipped / "multirotor.toml"};
  for (const auto& entry : std::filesystem::directory_iterator{kShipped / "vehicles"})
    files.push_back(entry.path());
  EXPECT_GE(files.size(), 11U);
  for (const auto& path : files) {
    const auto vehicle = VehicleFile::load(path);
    EXPECT_TRUE(vehicle.has_value()) << vehicle.error().text;
  }
}

TEST(Vehicle, TheDocumentedMultirotorIsTheHexarotorOfTheEvidence) {
  const auto documented = VehicleFile::load(kShipped / "multirotor.toml");
  const auto measured = VehicleFile::load(kShipped / "vehicles" / "unbalance_hexa.toml");
  ASSERT_TRUE(documented.has_value() && measured.has_value());
  EXPECT_EQ(documented->hash, measured->hash);
}

/// A multirotor with these hubs; the first line of a rotor is 16, then every third.
std::string multirotor_with(const std::vector<std::string>& positions, const std::string& mass = "1.0",
                            const std::string& thrust = "1e-5", const std::string& speed_min = "100") {
  std::string text = "name = \"v\"\nkind = \"multirotor\"\n[multirotor]\nmass_kg = " + mass +
                     "\ninertia_kg_m2 = [0.01, 0.01, 0.02]\nthrust_coefficient_N_s2 = " + thrust +
                     "\ntorque_ratio_m = 0.01\npropeller_radius_m = 0.1\npropeller_inertia_kg_m2 = 1e-5\n"
                     "motor_time_constant_s = 0.03\nspeed_min_rad_s = " +
                     speed_min +
                     "\nspeed_max_rad_s = 900\n"
                     "gear_height_m = 0.1\ngear_radius_m = 0.1\n";
  for (const std::string& position : positions) {
    text += "[[multirotor.rotor]]\nposition_m = " + position + "\nspin = \"clockwise\"\n";
  }
  return text;
}

const std::vector<std::string> kSquare{"[0.2, 0.2, 0.0]", "[-0.2, 0.2, 0.0]", "[-0.2, -0.2, 0.0]",
                                       "[0.2, -0.2, 0.0]"};

TEST(MultirotorTable, TakesThreeToEightRotorsEachInItsPlace) {
  EXPECT_EQ(errors_of_vehicle(multirotor_with(kSquare)), "");
  EXPECT_EQ(errors_of_vehicle(multirotor_with({"[0.2, 0.0, 0.0]", "[-0.1, 0.2, 0.0]", "[-0.1, -0.2, 0.0]"})),
            "");
  auto coaxial = kSquare;
  for (const std::string& hub : kSquare) coaxial.push_back(hub.substr(0, hub.size() - 4) + "0.05]");
  EXPECT_EQ(errors_of_vehicle(multirotor_with(coaxial)), "");
  EXPECT_EQ(errors_of_vehicle(multirotor_with({})),
            "v.toml:3:1: multirotor.rotor: missing mandatory tables, must have 3 to 8 elements");
  EXPECT_EQ(errors_of_vehicle(multirotor_with({kSquare[0], kSquare[2]})),
            "v.toml:15:14: multirotor.rotor: must have 3 to 8 elements, has 2");
  coaxial.emplace_back("[0.3, 0.0, 0.0]");
  EXPECT_EQ(errors_of_vehicle(multirotor_with(coaxial)),
            "v.toml:15:14: multirotor.rotor: must have 3 to 8 elements, has 9");
}

TEST(MultirotorTable, RefusesWhatCannotFly) {
  EXPECT_EQ(errors_of_vehicle(multirotor_with(kSquare, "-1.0")),
            "v.toml:4:1: multirotor.mass_kg: must lie in [0.001, 1000], is -1");
  EXPECT_EQ(errors_of_vehicle(multirotor_with(kSquare, "nan")),
            "v.toml:4:1: multirotor.mass_kg: must be finite, is nan");
  EXPECT_EQ(errors_of_vehicle(multirotor_with(kSquare, "4.0")),
            "v.toml:12:1: multirotor.speed_max_rad_s: all rotors at full speed lift 32.4 N, less than the "
            "weight of 39.2 N");
  EXPECT_EQ(errors_of_vehicle(multirotor_with(kSquare, "1.0", "1e-5", "600")),
            "v.toml:11:1: multirotor.speed_min_rad_s: 600 must be less than the 495.2 rad/s at which the "
            "rotors lift "
            "the weight of 9.81 N: idling, the vehicle would climb");
  EXPECT_EQ(errors_of_vehicle(multirotor_with(kSquare, "1.0", "8.5")),
            "v.toml:6:1: multirotor.thrust_coefficient_N_s2: must lie in [1e-10, 0.1], is 8.5");
  EXPECT_EQ(errors_of_vehicle(multirotor_with(kSquare, "1.0", "0.01")),
            "v.toml:11:1: multirotor.speed_min_rad_s: 100 must be less than the 15.66 rad/s at which the "
            "rotors lift "
            "the weight of 9.81 N: idling, the vehicle would climb");
  auto twice = kSquare;
  twice.push_back(kSquare[1]);
  EXPECT_EQ(errors_of_vehicle(multirotor_with(twice)),
            "v.toml:28:1: multirotor.rotor[4].position_m: is that of rotor[1]");
  const std::string unbalanced =
      "v.toml:15:14: multirotor.rotor: the centre of mass must lie between the hubs, or nothing holds the "
      "vehicle level";
  EXPECT_EQ(errors_of_vehicle(multirotor_with({"[0.2, 0.0, 0.0]", "[0.0, 0.0, 0.0]", "[-0.2, 0.0, 0.0]"})),
            unbalanced)
      << "all on a line";
  EXPECT_EQ(errors_of_vehicle(multirotor_with({"[0.2, 0.2, 0.0]", "[0.2, -0.2, 0.0]", "[0.1, 0.0, 0.0]"})),
            unbalanced)
      << "all in front";
}

}  // namespace
}  // namespace airworthy::rt
