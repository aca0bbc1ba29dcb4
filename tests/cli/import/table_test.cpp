#include "cli/import/table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/cli/import/import_support.h"

namespace airworthy::importer {
namespace {

constexpr const char* kMap = R"(
vehicle = "quad1"
[[table]]
time = {column = "t", unit = "s"}
[[table.message]]
channel = "IMU"
fields = [
  {field = "accel_m_s2[0]", column = "x", unit = "g"},
  {field = "accel_m_s2[1]", column = "y", unit = "g", scale = -1},
  {field = "accel_m_s2[2]", column = "z", unit = "g", scale = -1, offset = 0.5},
  {field = "averaging_window_s", value = 0},
]
)";

class TableTest : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& content) const {
    const auto path = folder_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream{path, std::ios::binary} << content;
  }
  rt::Expected<LogSummary> import(const std::string& map_text, const std::string& input = "flight.csv",
                                  const Window& window = {}) {
    write("map.toml", map_text);
    const auto map = ImportMap::load(folder_.path() / "map.toml");
    if (!map) return tl::unexpected<rt::Error>{map.error()};
    return import_table(folder_.path() / input, *map, window, map->vehicle, log_, no_progress);
  }
  /// The errors without the folder's name, one a line.
  std::string error(const std::string& map_text, const std::string& input = "flight.csv") {
    const auto summary = import(map_text, input);
    if (summary) return "no error";
    EXPECT_FALSE(std::filesystem::exists(log_));
    EXPECT_FALSE(std::filesystem::exists(log_.string() + ".partial"));
    std::string text = summary.error().text;
    const std::string folder = folder_.path().string() + "/";
    for (auto at = text.find(folder); at != std::string::npos; at = text.find(folder))
      text.erase(at, folder.size());
    return text;
  }
  std::vector<imu_t> imu() const { return read_log<imu_t>(log_, "quad1/IMU"); }
  std::vector<ground_truth_t> truth() const { return read_log<ground_truth_t>(log_, "quad1/GROUND_TRUTH"); }

  rt::TemporaryFolder folder_;
  std::filesystem::path log_ = folder_.path() / "flight.lcm";
};

TEST_F(TableTest, MapsColumnsWithUnitSignAndOffset) {
  write("flight.csv", "t,x,y,z,other\n1.5,1,2,3,text\n");
  const auto summary = import(kMap);
  ASSERT_TRUE(summary) << summary.error().text;
  const auto messages = imu();
  ASSERT_EQ(messages.size(), 1U);
  EXPECT_EQ(messages[0].header.time_us, 1'500'000);
  EXPECT_DOUBLE_EQ(messages[0].accel_m_s2[0], 9.80665);
  EXPECT_DOUBLE_EQ(messages[0].accel_m_s2[1], -2 * 9.80665);
  EXPECT_DOUBLE_EQ(messages[0].accel_m_s2[2], -3 * 9.80665 + 0.5);
  EXPECT_EQ(messages[0].averaging_window_s, 0.0);
  for (const double rate : messages[0].gyro_rad_s) EXPECT_TRUE(std::isnan(rate));
  EXPECT_TRUE(std::isnan(messages[0].temperature_degC));
  EXPECT_EQ(messages[0].sensor_id, 0);
}

TEST_F(TableTest, ReadsOtherDelimitersAndFilesWithoutHeaderCompressedOrNot) {
  write("flight.csv", "# made by hand\n1;10;20\n2;11;21\n");
  const std::string map = R"(
vehicle = "quad1"
[[table]]
delimiter = ";"
skip_lines = 1
header = ["when", "a", "b"]
time = {column = "when", unit = "ms", base_s = 100.0}
[[table.message]]
channel = "ROTOR_COMMAND"
fields = [
  {field = "command_ratio[1]", column = "a", unit = "percent"},
  {field = "command_ratio[0]", sum = [{column = "a"}, {column = "b", scale = -2}], offset = 100, min = 0, max = 69.5},
]
)";
  ASSERT_TRUE(import(map));
  const auto messages = read_log<rotor_command_t>(log_, "quad1/ROTOR_COMMAND");
  ASSERT_EQ(messages.size(), 2U);
  EXPECT_EQ(messages[0].header.time_us, 100'001'000);
  ASSERT_EQ(messages[0].rotor_count, 2);
  EXPECT_DOUBLE_EQ(messages[0].command_ratio[0], 69.5);
  EXPECT_DOUBLE_EQ(messages[0].command_ratio[1], 0.1);
  EXPECT_DOUBLE_EQ(messages[1].command_ratio[0], 69.0);
  const std::string plain = content_of(log_);
  write("flight.csv.xz", xz(content_of(folder_.path() / "flight.csv")));
  ASSERT_TRUE(import(map, "flight.csv.xz"));
  EXPECT_EQ(content_of(log_), plain);
}

TEST_F(TableTest, CombinesColumnsToANorm) {
  write("flight.csv", "t,x,y\n0,3,4\n");
  ASSERT_TRUE(import(R"(
vehicle = "quad1"
[[table]]
time = {column = "t", unit = "us"}
[[table.message]]
channel = "FLIGHT_STATE"
fields = [{field = "groundspeed_m_s", norm = ["x", "y"], unit = "cm_s"}, {field = "mode", column = "x"}]
)"));
  const auto messages = read_log<flight_state_t>(log_, "quad1/FLIGHT_STATE");
  ASSERT_EQ(messages.size(), 1U);
  EXPECT_DOUBLE_EQ(messages[0].groundspeed_m_s, 0.05);
  EXPECT_EQ(messages[0].mode, 3);
  EXPECT_EQ(messages[0].armed, -1);
  EXPECT_TRUE(std::isnan(messages[0].airspeed_m_s));
}

TEST_F(TableTest, AnEmptyCellIsUnknown) {
  write("flight.csv", "t,x,y,z\n1,,2,3\n");
  ASSERT_TRUE(import(kMap));
  const auto messages = imu();
  ASSERT_EQ(messages.size(), 1U);
  EXPECT_TRUE(std::isnan(messages[0].accel_m_s2[0]));
  EXPECT_DOUBLE_EQ(messages[0].accel_m_s2[1], -2 * 9.80665);
}

TEST_F(TableTest, PublishesOnlyWhenAWatchedColumnChanges) {
  write("flight.csv", "t,x,y,z,n\n1,0,0,0,5\n2,1,0,0,5\n3,2,0,0,6\n4,3,0,0,\n5,4,0,0,\n6,5,0,0,6\n");
  const auto summary = import(std::string{kMap} + "only_on_change = [\"n\"]\n");
  ASSERT_TRUE(summary) << summary.error().text;
  std::vector<std::int64_t> times_s;
  for (const auto& message : imu()) times_s.push_back(message.header.time_us / 1'000'000);
  EXPECT_EQ(times_s, (std::vector<std::int64_t>{1, 3, 4, 6}));
  EXPECT_EQ(summary->left_out, (std::map<std::string, std::int64_t>{{"IMU, repeated", 2}}));
}

constexpr const char* kFolderMap = R"(
vehicle = "quad1"
[[table]]
path = "b.csv"
time = {column = "t", unit = "s"}
[[table.message]]
channel = "ATTITUDE"
fields = [{field = "roll_rad", column = "roll", unit = "deg"}]
[[table]]
path = "a.csv"
time = {column = "t", unit = "ms"}
[[table.message]]
channel = "ATTITUDE_SETPOINT"
fields = [{field = "roll_rad", column = "roll"}]
)";

TEST_F(TableTest, MergesTheTablesOfAFolder) {
  write("run/b.csv", "t,roll\n1,90\n2,0\n");
  write("run/a.csv", "t,roll\n1000,1\n1500,2\n");
  const auto summary = import(kFolderMap, "run");
  ASSERT_TRUE(summary) << summary.error().text;
  using Entry = std::pair<std::string, std::int64_t>;
  EXPECT_EQ(order_of(log_), (std::vector<Entry>{{"quad1/ATTITUDE", 1'000'000},
                                                {"quad1/ATTITUDE_SETPOINT", 1'000'000},
                                                {"quad1/ATTITUDE_SETPOINT", 1'500'000},
                                                {"quad1/ATTITUDE", 2'000'000}}));
  EXPECT_DOUBLE_EQ(read_log<attitude_t>(log_, "quad1/ATTITUDE")[0].roll_rad, std::numbers::pi / 2);
}

TEST_F(TableTest, AGateIsOpenBetweenTwoRowsThatAgree) {
  write("run/b.csv", "t,roll\n1,0\n2,0\n3,0\n4,0\n5,0\n6,0\n7,0\n8,0\n20,0\n31,0\n");
  write("run/a.csv", "t,roll\n0,0\n");
  write("run/mode.csv", "t,m\n0,1\n2,2\n4,2\n6.5,1\n7,2\n30,2\n");
  const auto summary = import(std::string{kFolderMap} + R"(
[[gate]]
name = "not in mode 2"
path = "mode.csv"
time = {column = "t", unit = "s"}
column = "m"
values = [2]
longest_gap_s = 10.0
)",
                              "run");
  ASSERT_TRUE(summary) << summary.error().text;
  std::vector<std::int64_t> times_s;
  for (const auto& message : read_log<attitude_t>(log_, "quad1/ATTITUDE")) {
    times_s.push_back(message.header.time_us / 1'000'000);
  }
  // 5 and 6: the mode changed somewhere between 4 and 6.5. 8 and 20: nobody knows the mode between 7 and 30.
  EXPECT_EQ(times_s, (std::vector<std::int64_t>{2, 3, 4, 7}));
  EXPECT_EQ(summary->left_out, (std::map<std::string, std::int64_t>{{"rows of a.csv, not in mode 2", 1},
                                                                    {"rows of b.csv, not in mode 2", 6}}));
}

TEST_F(TableTest, ImportsAWindowWithTheFaultsThatConcernIt) {
  write("run/b.csv", "t,roll\n1,0\n2,0\n3,0\n4,0\n5,0\n6,0\n");
  write("run/a.csv", "t,roll\n0,0\n");
  write("run/set.csv", "t,what,v\n1,a,0\n1.5,a,1\n2,b,0.5\n5,c,0\n");
  std::string map = kFolderMap;
  for (const std::string name : {"a", "b", "c"}) {
    map +=
        "[[truth_setting]]\npath = \"set.csv\"\ntime = {column = \"t\", unit = \"s\"}\nname_column = "
        "\"what\"\nname = \"" +
        name + "\"\nvalue_column = \"v\"\nhealthy = [1, 1]\ncomponent = \"" + name +
        "\"\nfault_kind = \"stuck\"\n";
  }
  const auto summary = import(map, "run", {from_us(3'000'000), from_us(4'000'000)});
  ASSERT_TRUE(summary) << summary.error().text;
  EXPECT_EQ(summary->start_us, 3'000'000);
  EXPECT_EQ(summary->end_us, 4'000'000);
  const auto found = truth();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].component, "b");
  EXPECT_EQ(found[0].onset_us, 3'000'000);
}

TEST_F(TableTest, AnImportOfNothingIsAnError) {
  write("flight.csv", "t,x,y,z\n1,0,0,0\n");
  const std::string map = std::string{kMap} + "[[truth]]\nfault_kind = \"none\"\n";
  const auto summary = import(map, "flight.csv", {from_us(2'000'000), {}});
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().text, log_.string() + ": not written: nothing in the input became a message");
  EXPECT_EQ(names_in(folder_.path()), (std::vector<std::string>{"flight.csv", "map.toml"}));
}

TEST_F(TableTest, TruthCountsFromTheFirstRow) {
  write("flight.csv", "t,x,y,z\n100,0,0,0\n101,0,0,0\n102,0,0,0\n");
  ASSERT_TRUE(import(
      std::string{kMap} +
      "[[truth]]\ncomponent = \"rotor 2\"\nfault_kind = \"stuck\"\nonset_s = 1.25\nmagnitude = 0.5\n"));
  const auto found = truth();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].component, "rotor 2");
  EXPECT_EQ(found[0].fault_kind, "stuck");
  EXPECT_EQ(found[0].onset_us, 101'250'000);
  EXPECT_EQ(found[0].header.time_us, 101'250'000);
  EXPECT_EQ(found[0].magnitude, 0.5);
}

constexpr const char* kIndex = R"(
[truth_index]
path = "../index.csv"
key_column = "file"
onset = {column = "at", unit = "s"}
magnitude = {column = "gain", scale = -1, offset = 1}
[truth_index.component]
column = "where"
words = [{cell = "M1", means = "rotor 1"}, {cell = "M3", means = "rotor 3"}]
[truth_index.fault_kind]
column = "what"
words = [{cell = "none", means = "none"}, {cell = "cut", means = "propeller_damage"}]
)";

TEST_F(TableTest, TruthComesFromTheRowOfTheIndexThatNamesTheFlight) {
  write("index.csv",
        "file,what,where,at,gain\nx/flight.csv,none,,,\nset/flight.csv,cut,M1 "
        "M3,1.5,0.25\nset/ok.csv,none,,,\n");
  write("set/flight.csv", "t,x,y,z\n1,0,0,0\n2,0,0,0\n");
  write("set/ok.csv", "t,x,y,z\n1,0,0,0\n2,0,0,0\n");
  const std::string map = std::string{kMap} + kIndex;
  const auto summary = import(map, "set/flight.csv");
  ASSERT_TRUE(summary) << summary.error().text;
  auto found = truth();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].component, "rotor 1");
  EXPECT_EQ(found[1].component, "rotor 3");
  EXPECT_EQ(found[1].fault_kind, "propeller_damage");
  EXPECT_EQ(found[1].onset_us, 1'500'000);
  EXPECT_EQ(found[1].magnitude, 0.75);
  ASSERT_TRUE(import(map, "set/ok.csv"));
  found = truth();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].component, "");
  EXPECT_EQ(found[0].fault_kind, "none");
  EXPECT_EQ(found[0].onset_us, -1);
  std::filesystem::remove(log_);
  write("set/other.csv", "t,x,y,z\n1,0,0,0\n");
  EXPECT_EQ(error(map, "set/other.csv"), "index.csv: has no row for set/other.csv");
  write("index.csv", "file,what,where,at,gain\nset/flight.csv,cut,M2,1.5,0.25\n");
  EXPECT_EQ(error(map, "set/flight.csv"), "index.csv:2: column where: the map has no meaning for \"M2\"");
}

TEST_F(TableTest, TruthFollowsALogOfSettings) {
  write("run/b.csv", "t,roll\n0,0\n9,0\n");
  write("run/a.csv", "t,roll\n0,0\n");
  write("run/set.csv",
        "t,kind,what,v\n0,confirmed,gain,1.0\n1,requested,gain,0.5\n2,requested,gain,0.5\n3,confirmed,gain,0."
        "5\n"
        "4,requested,gain,1.0\n5,requested,other,0.0\n6,confirmed,gain,1.0\n7,confirmed,gain,0.0\n");
  ASSERT_TRUE(import(std::string{kFolderMap} + R"(
[[truth_setting]]
path = "set.csv"
time = {column = "t", unit = "s"}
name_column = "what"
name = "gain"
value_column = "v"
healthy = [0.9, 1.1]
confirmed_column = "kind"
confirmed_word = "confirmed"
component = "left elevon"
fault_kind = "loss_of_effectiveness"
magnitude = {scale = -1, offset = 1}
)",
                     "run"));
  const auto found = truth();
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].fault_kind, "loss_of_effectiveness");
  EXPECT_EQ(found[0].onset_us, 1'000'000);
  EXPECT_EQ(found[0].magnitude, 0.5);
  EXPECT_EQ(found[1].component, "left elevon");
  EXPECT_EQ(found[1].fault_kind, "none");
  EXPECT_EQ(found[1].onset_us, -1);
  EXPECT_EQ(found[1].header.time_us, 6'000'000);
  EXPECT_EQ(found[2].onset_us, 7'000'000);
  EXPECT_EQ(found[2].magnitude, 1.0);
}

TEST_F(TableTest, WhatIsWrongWithTheMapIsReportedAtOnce) {
  write("flight.csv", "t,x\n1,2\n");
  EXPECT_EQ(
      error(R"(vehicle = "a name"
[[table]]
delimiter = ",,"
time = {column = "t", unit = "h"}
[[table.message]]
channel = "FAULT_EVENT"
[[table.message]]
channel = "IMU"
fields = [
  {field = "accel", column = "x"},
  {field = "accel_m_s2[3]", column = "x"},
  {field = "accel_m_s2[0]"},
  {field = "accel_m_s2[1]", column = "x", value = 2},
  {field = "gyro_rad_s[0]", column = "x", unit = "rpm"},
  {field = "gyro_rad_s[1]", column = "x", min = 2, max = 1},
]
[[truth]]
fault_kind = "stuck"
[[truth]]
fault_kind = "none"
onset_s = 1.0
)"),
      "map.toml:1:1: vehicle: must be 1 to 16 of A-Z a-z 0-9 _ -\n"
      "map.toml:3:1: table[0].delimiter: must be one character other than a quote\n"
      "map.toml:4:23: table[0].time.unit: must be one of s, ms, us, ns, is \"h\"\n"
      "map.toml:6:1: table[0].message[0].channel: must be one of IMU, ESC_STATUS, ROTOR_COMMAND, ATTITUDE, "
      "ATTITUDE_SETPOINT, FLIGHT_STATE\n"
      "map.toml:10:4: table[0].message[1].fields[0].field: IMU has no such field, or the element is missing "
      "or out of range\n"
      "map.toml:11:4: table[0].message[1].fields[1].field: IMU has no such field, or the element is missing "
      "or out of range\n"
      "map.toml:12:4: table[0].message[1].fields[2].field: needs exactly one of value, column, sum and "
      "norm\n"
      "map.toml:13:4: table[0].message[1].fields[3].field: needs exactly one of value, column, sum and "
      "norm\n"
      "map.toml:14:43: table[0].message[1].fields[4].unit: gyro_rad_s[0] takes one of rad_s, deg_s, mrad_s\n"
      "map.toml:15:43: table[0].message[1].fields[5].min: must not exceed max\n"
      "map.toml:17:1: truth[0].component: a fault needs a component\n"
      "map.toml:21:1: truth[1].onset_s: a healthy flight has no onset");
}

TEST_F(TableTest, SeveralTablesNeedAPathEach) {
  EXPECT_EQ(error(std::string{kMap} + "[[table]]\npath = \"b.csv\"\ntime = {column = \"t\", unit = \"s\"}\n"
                                      "[[table.message]]\nchannel = \"IMU\"\n"
                                      "fields = [{field = \"accel_m_s2[0]\", column = \"x\"}]\n"),
            "map.toml:3:3: table: several tables need a path each, in the folder that is imported");
}

TEST_F(TableTest, AMissingMapIsAnError) {
  const auto map = ImportMap::load("/nonexistent/map.toml");
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().text, "/nonexistent/map.toml: cannot be opened: No such file or directory");
}

TEST_F(TableTest, BadInputIsOneErrorWithFileAndLine) {
  const std::string head = "t,x,y,z\n1,1,1,1\n";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "flight.csv: the file is empty"},
      {"\n", "flight.csv: no column \"t\""},
      {"t,x,y,z\n", "flight.csv: has a header but no rows"},
      {"t,x,y\n1,1,1\n", "flight.csv: no column \"z\""},
      {"t,x,y,t\n1,1,1,1\n", "flight.csv:1: the header names column \"t\" twice"},
      {head + "2,2,2\n", "flight.csv:3: 3 cells where the header has 4: truncated or corrupt"},
      {head + "2,2,2,2,2\n", "flight.csv:3: 5 cells where the header has 4: truncated or corrupt"},
      {head + "\n", "flight.csv:3: 1 cell where the header has 4: truncated or corrupt"},
      {head + "2,2,2,2", "flight.csv:3: the last line is not ended: truncated"},
      {head + "0.5,2,2,2\n", "flight.csv:3: time goes backward by 0.500000 s: rows are out of order"},
      {head + "2,2,2,2x\n", "flight.csv:3: column z: \"2x\" is not a number"},
      {head + "2,2,1,5 5\n", "flight.csv:3: column z: \"5 5\" is not a number"},
      {head + "2,0x10,1,5\n", "flight.csv:3: column x: \"0x10\" is not a number"},
      {head + "2,2,1,1e999\n", "flight.csv:3: column z: \"1e999\" is out of range"},
      {head + "2,inf,2,2\n", "flight.csv:3: column x: \"inf\" is not finite"},
      {head + "2,nan,2,2\n", "flight.csv:3: column x: \"nan\" is not finite"},
      {head + ",2,2,2\n", "flight.csv:3: column t: \"\" is not a number"},
      {head + "-1,2,2,2\n", "flight.csv:3: column t: \"-1\" is before time 0"},
      {head + "1e12,2,2,2\n", "flight.csv:3: column t: \"1e12\" is out of range"},
      {head + "2,\"2,2,2\n", "flight.csv:3: a quoted cell is not closed"},
      {head + "2,\"2\"2,2,2\n", "flight.csv:3: text after a quoted cell"},
      {head + "2,\x01\xff,2,2\n", "flight.csv:3: column x: \"\\x01\\xff\" is not a number"},
      {std::string(2'000'000, 'x'), "flight.csv:1: a line of more than 1048576 bytes: not a table"},
  };
  for (const auto& [content, expected] : cases) {
    write("flight.csv", content);
    EXPECT_EQ(error(kMap), expected);
  }
  EXPECT_EQ(error(kMap, "none.csv"), "none.csv: No such file or directory");
  write("folder/x.csv", head);
  EXPECT_EQ(error(kMap, "folder"), "folder: a folder, not a file");
  EXPECT_EQ(error(kFolderMap, "flight.csv"),
            "flight.csv: not a folder, and the map is for a folder of tables");
}

TEST_F(TableTest, DamageToACompressedFileIsFoundAtEveryByte) {
  std::string text = "t,x,y,z\n";
  for (int i = 0; i < 200; ++i) text += std::to_string(i) + ",1,2," + std::to_string(i * 37 % 101) + "\n";
  const std::string whole = xz(text);
  for (std::size_t size = 1; size < whole.size(); size += 7) {
    write("flight.csv.xz", whole.substr(0, size));
    const std::string found = error(kMap, "flight.csv.xz");
    EXPECT_EQ(found, "flight.csv.xz: byte " + std::to_string(size) + ": truncated xz data");
  }
  for (std::size_t at = 0; at < whole.size(); at += 5) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    write("flight.csv.xz", damaged);
    const std::string found = error(kMap, "flight.csv.xz");
    EXPECT_TRUE(found.starts_with("flight.csv.xz: byte ")) << at << ": " << found;
  }
}

TEST_F(TableTest, QuotedCellsAndCarriageReturnsAndAByteOrderMarkAreRead) {
  write("flight.csv", "\xef\xbb\xbft,x,y,\"z\"\r\n1,\"1\", 2 ,+3,\r\n");
  EXPECT_EQ(error(kMap), "flight.csv:2: 5 cells where the header has 4: truncated or corrupt");
  write("flight.csv", "\xef\xbb\xbft,x,y,\"z\"\r\n1,\"1\", 2 ,+3\r\n");
  ASSERT_TRUE(import(kMap));
  EXPECT_DOUBLE_EQ(imu()[0].accel_m_s2[1], -2 * 9.80665);
}

TEST_F(TableTest, TheShippedMapsLoad) {
  int maps = 0;
  for (const auto& entry : std::filesystem::directory_iterator{AIRWORTHY_SOURCE_DIR "/config/import"}) {
    const auto map = ImportMap::load(entry.path());
    EXPECT_TRUE(map) << map.error().text;
    ++maps;
  }
  EXPECT_EQ(maps, 7);
}

TEST(Units, ConvertToTheFieldsUnit) {
  const auto convert = [](double value, const char* from, const char* to) {
    const auto conversion = find_conversion(from, to);
    return conversion ? value * conversion->factor + conversion->offset : std::nan("");
  };
  EXPECT_DOUBLE_EQ(convert(180.0, "deg", "rad"), std::numbers::pi);
  EXPECT_DOUBLE_EQ(convert(2.0 * std::numbers::pi, "rad_s", "rpm"), 60.0);
  EXPECT_DOUBLE_EQ(convert(20.0, "rev_s", "rpm"), 1200.0);
  EXPECT_DOUBLE_EQ(convert(273.15, "K", "degC"), 0.0);
  EXPECT_DOUBLE_EQ(convert(3.6, "km_h", "m_s"), 1.0);
  EXPECT_DOUBLE_EQ(convert(1.0, "kn", "m_s"), 1852.0 / 3600.0);
  EXPECT_DOUBLE_EQ(convert(7.0, "V", "V"), 7.0);
  EXPECT_TRUE(std::isnan(convert(1.0, "deg", "m")));
}

}  // namespace
}  // namespace airworthy::importer
