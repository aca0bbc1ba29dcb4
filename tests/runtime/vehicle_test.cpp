#include "runtime/config/vehicle.h"

#include <gtest/gtest.h>

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

TEST(Vehicle, ShippedFileIsValid) {
  const auto vehicle =
      VehicleFile::load(std::filesystem::path{AIRWORTHY_SOURCE_DIR} / "config" / "vehicle.toml");
  ASSERT_TRUE(vehicle.has_value()) << vehicle.error().text;
  EXPECT_TRUE(VehicleFile::is_valid_name(vehicle->name));
}

}  // namespace
}  // namespace airworthy::rt
