#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/runtime/config_support.h"

namespace airworthy::rt {
namespace {

enum class Side { kLow, kHigh };

TEST(ConfigValues, EveryTypeIsRead) {
  auto file = ConfigFile::parse(R"(
flag = true
count = 7
byte = 255
port = 65535
big = 4294967295
huge = 9223372036854775807
least = -9223372036854775808
period_s = 0.25
whole_s = 3
endpoint = "tcp://*:5570"
side = "high"
flags = [true, false]
counts = [1, 2, 3]
gains = [1, 2.5]
names = ["a", "b"]
matrix = [[1, 0], [0, 1.5]]
position_m = [0.1, 0.2, -0.3]
)",
                                "t.toml");
  ConfigTable root = file.root();
  EXPECT_EQ(root.required<bool>("flag"), true);
  EXPECT_EQ(root.required<int>("count"), 7);
  EXPECT_EQ(root.required<std::uint8_t>("byte"), 255);
  EXPECT_EQ(root.required<std::uint16_t>("port"), 65535);
  EXPECT_EQ(root.required<std::uint32_t>("big"), 4294967295U);
  EXPECT_EQ(root.required<std::uint64_t>("huge"), 9223372036854775807U);
  EXPECT_EQ(root.required<std::int64_t>("least"), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(root.required<double>("period_s"), 0.25);
  EXPECT_EQ(root.required<double>("whole_s"), 3.0);
  EXPECT_EQ(root.required<std::string>("endpoint"), "tcp://*:5570");
  EXPECT_EQ(root.choice<Side>("side", {{"low", Side::kLow}, {"high", Side::kHigh}}), Side::kHigh);
  EXPECT_EQ(root.required<std::vector<bool>>("flags"), (std::vector<bool>{true, false}));
  EXPECT_EQ(root.required<std::vector<int>>("counts"), (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(root.required<std::vector<double>>("gains"), (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(root.required<std::vector<std::string>>("names"), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(root.required<std::vector<std::vector<double>>>("matrix"),
            (std::vector<std::vector<double>>{{1.0, 0.0}, {0.0, 1.5}}));
  EXPECT_EQ((root.required<std::array<double, 3>>("position_m")), (std::array<double, 3>{0.1, 0.2, -0.3}));
  EXPECT_EQ(errors_of(file), "");
}

TEST(ConfigValues, DefaultsStandInForWhatIsAbsent) {
  auto file = ConfigFile::parse("", "t.toml");
  ConfigTable root = file.root();
  EXPECT_EQ(root.optional<double>("period_s", 0.2, Range{0.01, 10.0}), 0.2);
  EXPECT_EQ(root.optional<std::string>("endpoint", "here"), "here");
  EXPECT_EQ(root.optional<std::vector<int>>("counts", {4, 5}), (std::vector<int>{4, 5}));
  EXPECT_EQ((root.optional<std::array<double, 2>>("pair", {1.0, 2.0})), (std::array<double, 2>{1.0, 2.0}));
  EXPECT_EQ(root.choice<Side>("side", {{"low", Side::kLow}, {"high", Side::kHigh}}, Side::kHigh),
            Side::kHigh);
  EXPECT_EQ(root.if_present<int>("limit"), std::nullopt);
  EXPECT_FALSE(root.has("limit"));
  EXPECT_FALSE(root.optional_table("extra").has_value());
  EXPECT_EQ(root.table("policy").optional<int>("order", 3), 3);
  EXPECT_TRUE(root.tables("channel").empty());
  EXPECT_EQ(errors_of(file), "");
}

TEST(ConfigValues, AWrittenValueBeatsTheDefault) {
  auto file = ConfigFile::parse("period_s = 0.5\nside = \"low\"\nlimit = 9\npair = [3, 4]\n", "t.toml");
  ConfigTable root = file.root();
  EXPECT_EQ(root.optional<double>("period_s", 0.2), 0.5);
  EXPECT_EQ(root.choice<Side>("side", {{"low", Side::kLow}, {"high", Side::kHigh}}, Side::kHigh), Side::kLow);
  EXPECT_EQ(root.if_present<int>("limit"), 9);
  EXPECT_EQ((root.optional<std::array<double, 2>>("pair", {1.0, 2.0})), (std::array<double, 2>{3.0, 4.0}));
  EXPECT_EQ(errors_of(file), "");
}

TEST(ConfigValues, BoundsBelongToTheRange) {
  auto file = ConfigFile::parse("low = 0.01\nhigh = 10\n", "t.toml");
  ConfigTable root = file.root();
  EXPECT_EQ(root.required<double>("low", Range{0.01, 10.0}), 0.01);
  EXPECT_EQ(root.required<int>("high", Range{1, 10}), 10);
  EXPECT_EQ(errors_of(file), "");
}

TEST(ConfigValues, NotFiniteIsReadWhereItIsAllowed) {
  auto file = ConfigFile::parse("unknown = nan\nfar = inf\nnear = -inf\n", "t.toml");
  ConfigTable root = file.root();
  EXPECT_TRUE(std::isnan(root.required<double>("unknown", Range{0.0, 1.0}.or_not_finite())));
  EXPECT_EQ(root.required<double>("far", Range{}.or_not_finite()), std::numeric_limits<double>::infinity());
  EXPECT_EQ(root.required<double>("near", Range{}.or_not_finite()), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(errors_of(file), "");
}

TEST(ConfigValues, PathsAreRelativeToTheFileThatHoldsThem) {
  auto file = ConfigFile::parse("a = \"vehicle.toml\"\nb = \"/etc/x\"\nc = \"../y/./z\"\n", "conf/sub/t.toml",
                                {"d=there/w"});
  ConfigTable root = file.root();
  EXPECT_EQ(root.required_path("a"), "conf/sub/vehicle.toml");
  EXPECT_EQ(root.required_path("b"), "/etc/x");
  EXPECT_EQ(root.required_path("c"), "conf/y/z");
  EXPECT_EQ(root.required_path("d"), "there/w");
  EXPECT_EQ(root.optional_path("e", "journal.db"), "conf/sub/journal.db");
  EXPECT_EQ(errors_of(file), "");
}

TEST(ConfigValues, FinishReturnsTheConfiguration) {
  auto file = ConfigFile::parse("name = \"x\"\n", "t.toml");
  const auto result = file.finish(file.root().required<std::string>("name"));
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(*result, "x");
}

}  // namespace
}  // namespace airworthy::rt
