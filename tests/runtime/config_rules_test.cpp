// Every rule about a single key, broken once.

#include <gtest/gtest.h>

#include "tests/runtime/config_support.h"

namespace airworthy::rt {
namespace {

enum class Side { kLow, kHigh };

/// What finish() says after `read` has read the text.
template <class Read>
std::string errors_after(std::string_view text, Read read) {
  auto file = ConfigFile::parse(text, "conf/t.toml");
  read(file.root());
  return errors_of(file);
}

TEST(ConfigRules, MissingMandatoryKey) {
  EXPECT_EQ(errors_after("# nothing\n",
                         [](ConfigTable root) { EXPECT_EQ(root.required<std::string>("name"), ""); }),
            "conf/t.toml:1:1: name: missing mandatory key");
  EXPECT_EQ(errors_after("",
                         [](ConfigTable root) {
                           EXPECT_EQ(root.required<std::vector<int>>("ids"), std::vector<int>{});
                         }),
            "conf/t.toml:1:1: ids: missing mandatory key");
  EXPECT_EQ(errors_after("", [](ConfigTable root) { EXPECT_EQ(root.required_path("vehicle"), ""); }),
            "conf/t.toml:1:1: vehicle: missing mandatory key");
  EXPECT_EQ(
      errors_after(
          "",
          [](ConfigTable root) {
            EXPECT_EQ(root.choice<Side>("side", {{"low", Side::kLow}, {"high", Side::kHigh}}), Side::kLow);
          }),
      "conf/t.toml:1:1: side: missing mandatory key, one of low, high");
}

TEST(ConfigRules, UnknownKey) {
  EXPECT_EQ(errors_after("a = 1\n  b = 2\n", [](ConfigTable root) { EXPECT_EQ(root.required<int>("a"), 1); }),
            "conf/t.toml:2:3: b: unknown key");
}

TEST(ConfigRules, UnknownKeyThatIsNearlyAKnownOne) {
  EXPECT_EQ(errors_after("perid_s = 1\n",
                         [](ConfigTable root) { EXPECT_EQ(root.optional<double>("period_s", 0.2), 0.2); }),
            "conf/t.toml:1:1: perid_s: unknown key, did you mean period_s?");
  // A key that is written is not what was meant.
  EXPECT_EQ(errors_after("rate = 1\nrates = 2\n",
                         [](ConfigTable root) { EXPECT_EQ(root.required<int>("rate"), 1); }),
            "conf/t.toml:2:1: rates: unknown key");
}

TEST(ConfigRules, UnknownKeyThatMustBeQuotedStaysOnOneLine) {
  EXPECT_EQ(errors_after("\"a.b\\nc\" = 1\n", [](ConfigTable) {}),
            R"(conf/t.toml:1:1: "a.b\x0ac": unknown key)");
}

TEST(ConfigRules, WrongType) {
  const std::string_view text =
      "a = \"abc\"\nb = 1.5\nc = 1\nd = 1\ne = 1979-05-27\nf = [1]\ng = { x = 1 }\nh = true\n";
  EXPECT_EQ(errors_after(text,
                         [](ConfigTable root) {
                           EXPECT_EQ(root.required<double>("a"), 0.0);
                           EXPECT_EQ(root.optional<int>("b", 4), 4);
                           EXPECT_EQ(root.required<bool>("c"), false);
                           EXPECT_EQ(root.optional<std::string>("d", "x"), "x");
                           EXPECT_EQ(root.if_present<std::string>("e"), std::nullopt);
                           EXPECT_EQ(root.required<double>("f"), 0.0);
                           EXPECT_EQ(root.required<int>("g"), 0);
                           EXPECT_EQ(root.choice<Side>("h", {{"low", Side::kLow}, {"high", Side::kHigh}},
                                                       Side::kHigh),
                                     Side::kHigh);
                         }),
            "conf/t.toml:1:1: a: expected a number, found the string \"abc\"\n"
            "conf/t.toml:2:1: b: expected an integer, found the number 1.5\n"
            "conf/t.toml:3:1: c: expected a boolean, found the integer 1\n"
            "conf/t.toml:4:1: d: expected a string, found the integer 1\n"
            "conf/t.toml:5:1: e: expected a string, found the date 1979-05-27\n"
            "conf/t.toml:6:1: f: expected a number, found an array\n"
            "conf/t.toml:7:1: g: expected an integer, found a table\n"
            "conf/t.toml:8:1: h: expected one of low, high, found the boolean true");
}

TEST(ConfigRules, LongTextIsCutInTheMessage) {
  const std::string text = "a = \"" + std::string(59, 'x') + "äöü\"\n";
  EXPECT_EQ(errors_after(text, [](ConfigTable root) { EXPECT_EQ(root.required<int>("a"), 0); }),
            "conf/t.toml:1:1: a: expected an integer, found the string \"" + std::string(59, 'x') + "\"...");
}

TEST(ConfigRules, WrongTypeOfAnArray) {
  EXPECT_EQ(errors_after("gains = 1\nids = [1, \"two\", 3.5]\n",
                         [](ConfigTable root) {
                           EXPECT_EQ(root.optional<std::vector<double>>("gains", {9.0}),
                                     std::vector<double>{9.0});
                           EXPECT_EQ(root.required<std::vector<int>>("ids"), std::vector<int>{});
                         }),
            "conf/t.toml:1:1: gains: expected an array, found the integer 1\n"
            "conf/t.toml:2:11: ids[1]: expected an integer, found the string \"two\"\n"
            "conf/t.toml:2:18: ids[2]: expected an integer, found the number 3.5");
}

TEST(ConfigRules, WrongTypeInANestedArray) {
  EXPECT_EQ(errors_after("m = [[1, 2],\n     [3, true], 7]\n",
                         [](ConfigTable root) {
                           EXPECT_TRUE(root.required<std::vector<std::vector<double>>>("m").empty());
                         }),
            "conf/t.toml:2:10: m[1][1]: expected a number, found the boolean true\n"
            "conf/t.toml:2:17: m[2]: expected an array, found the integer 7");
}

TEST(ConfigRules, OutOfRange) {
  const std::string_view text =
      "a = 0.001\nb = 11\nc = 0\nd = -0.5\ne = 2.0\nf = 1.0\ng = 3\nh = 0.0\ni = 1\n";
  EXPECT_EQ(errors_after(text,
                         [](ConfigTable root) {
                           EXPECT_EQ(root.optional<double>("a", 0.2, Range{0.01, 10.0}), 0.2);
                           EXPECT_EQ(root.required<int>("b", Range{1, 10}), 0);
                           EXPECT_EQ(root.required<double>("c", Range::above(0.0)), 0.0);
                           EXPECT_EQ(root.required<double>("d", Range::at_least(0.0)), 0.0);
                           EXPECT_EQ(root.required<double>("e", Range::at_most(1.5)), 0.0);
                           EXPECT_EQ(root.required<double>("f", Range::between(0.0, 1.0)), 0.0);
                           EXPECT_EQ(root.required<int>("g", Range::below(3)), 0);
                           EXPECT_EQ(root.required<double>("h", Range{0.0, 1.0}.without_min()), 0.0);
                           EXPECT_EQ(root.required<double>("i", Range{0.0, 1.0}.without_max()), 0.0);
                         }),
            "conf/t.toml:1:1: a: must lie in [0.01, 10], is 0.001\n"
            "conf/t.toml:2:1: b: must lie in [1, 10], is 11\n"
            "conf/t.toml:3:1: c: must be greater than 0, is 0\n"
            "conf/t.toml:4:1: d: must be at least 0, is -0.5\n"
            "conf/t.toml:5:1: e: must be at most 1.5, is 2\n"
            "conf/t.toml:6:1: f: must lie in (0, 1), is 1\n"
            "conf/t.toml:7:1: g: must be less than 3, is 3\n"
            "conf/t.toml:8:1: h: must lie in (0, 1], is 0\n"
            "conf/t.toml:9:1: i: must lie in [0, 1), is 1");
}

TEST(ConfigRules, OutOfTheRangeOfTheIntegerType) {
  EXPECT_EQ(errors_after("a = 256\nb = -1\nc = 2147483648\nd = -1\ne = 300\n",
                         [](ConfigTable root) {
                           EXPECT_EQ(root.required<std::uint8_t>("a"), 0);
                           EXPECT_EQ(root.required<std::uint16_t>("b"), 0);
                           EXPECT_EQ(root.required<std::int32_t>("c"), 0);
                           EXPECT_EQ(root.required<std::uint64_t>("d"), 0U);
                           EXPECT_EQ(root.required<std::uint8_t>("e", Range{8, 1000}), 0);
                         }),
            "conf/t.toml:1:1: a: must lie in [0, 255], is 256\n"
            "conf/t.toml:2:1: b: must lie in [0, 65535], is -1\n"
            "conf/t.toml:3:1: c: must lie in [-2147483648, 2147483647], is 2147483648\n"
            "conf/t.toml:4:1: d: must be at least 0, is -1\n"
            "conf/t.toml:5:1: e: must lie in [8, 255], is 300");
}

TEST(ConfigRules, NotFinite) {
  EXPECT_EQ(errors_after("a = nan\nb = -inf\nc = [1.0, inf]\n",
                         [](ConfigTable root) {
                           EXPECT_EQ(root.required<double>("a"), 0.0);
                           EXPECT_EQ(root.optional<double>("b", 0.2, Range{0.01, 10.0}), 0.2);
                           EXPECT_EQ(root.required<std::vector<double>>("c"), std::vector<double>{});
                         }),
            "conf/t.toml:1:1: a: must be finite, is nan\n"
            "conf/t.toml:2:1: b: must be finite, is -inf\n"
            "conf/t.toml:3:11: c[1]: must be finite, is inf");
}

TEST(ConfigRules, InfinityIsOutOfRangeEvenWhereTheRangeHasNoBound) {
  EXPECT_EQ(
      errors_after("a = inf\n",
                   [](ConfigTable root) { EXPECT_EQ(root.required<double>("a", Range::above(0.0)), 0.0); }),
      "conf/t.toml:1:1: a: must be finite, is inf");
}

TEST(ConfigRules, RangeOfArrayElements) {
  EXPECT_EQ(errors_after("a = [1, 5, 0]\n",
                         [](ConfigTable root) {
                           EXPECT_TRUE(root.required<std::vector<int>>("a", Range{1, 4}).empty());
                         }),
            "conf/t.toml:1:9: a[1]: must lie in [1, 4], is 5\n"
            "conf/t.toml:1:12: a[2]: must lie in [1, 4], is 0");
}

TEST(ConfigRules, CountOfArrayElements) {
  EXPECT_EQ(errors_after("a = [1, 2]\nb = []\nc = [1, 2, 3]\nd = [1]\ne = [1]\n",
                         [](ConfigTable root) {
                           EXPECT_EQ((root.required<std::array<double, 3>>("a")), (std::array<double, 3>{}));
                           EXPECT_TRUE(root.required<std::vector<int>>("b", {}, Count::at_least(1)).empty());
                           EXPECT_TRUE(root.required<std::vector<int>>("c", {}, Count::at_most(2)).empty());
                           EXPECT_TRUE(root.required<std::vector<int>>("d", {}, Count{3, 8}).empty());
                           EXPECT_EQ((root.optional<std::array<double, 2>>("e", {7.0, 8.0})),
                                     (std::array<double, 2>{7.0, 8.0}));
                         }),
            "conf/t.toml:1:1: a: must have 3 elements, has 2\n"
            "conf/t.toml:2:1: b: must have at least 1 element, has 0\n"
            "conf/t.toml:3:1: c: must have at most 2 elements, has 3\n"
            "conf/t.toml:4:1: d: must have 3 to 8 elements, has 1\n"
            "conf/t.toml:5:1: e: must have 2 elements, has 1");
}

TEST(ConfigRules, NotOneOfTheWords) {
  EXPECT_EQ(
      errors_after(
          "side = \"midd\\\"le\"\n",
          [](ConfigTable root) {
            EXPECT_EQ(root.choice<Side>("side", {{"low", Side::kLow}, {"high", Side::kHigh}}), Side::kLow);
          }),
      R"(conf/t.toml:1:1: side: must be one of low, high, is "midd\"le")");
}

TEST(ConfigRules, PathThatIsNone) {
  EXPECT_EQ(errors_after("a = \"\"\nb = \"x\\u0000y\"\nc = 3\n",
                         [](ConfigTable root) {
                           EXPECT_EQ(root.required_path("a"), "");
                           EXPECT_EQ(root.required_path("b"), "");
                           EXPECT_EQ(root.optional_path("c", "d"), "conf/d");
                         }),
            "conf/t.toml:1:1: a: must not be empty\n"
            "conf/t.toml:2:1: b: must not hold a NUL character\n"
            "conf/t.toml:3:1: c: expected a string, found the integer 3");
}

TEST(ConfigRules, EveryErrorAtOnceInOrderOfPosition) {
  EXPECT_EQ(errors_after("z = 1\nrate_Hz = -1\n[policy]\norder = \"x\"\nextra = 1\n",
                         [](ConfigTable root) {
                           ConfigTable policy = root.table("policy");
                           EXPECT_EQ(policy.required<double>("raise_sigma"), 0.0);
                           EXPECT_EQ(policy.required<int>("order"), 0);
                           EXPECT_EQ(root.required<double>("rate_Hz", Range::above(0)), 0.0);
                           EXPECT_EQ(root.required<std::string>("name"), "");
                         }),
            "conf/t.toml:1:1: name: missing mandatory key\n"
            "conf/t.toml:1:1: z: unknown key\n"
            "conf/t.toml:2:1: rate_Hz: must be greater than 0, is -1\n"
            "conf/t.toml:3:1: policy.raise_sigma: missing mandatory key\n"
            "conf/t.toml:4:1: policy.order: expected an integer, found the string \"x\"\n"
            "conf/t.toml:5:1: policy.extra: unknown key");
}

TEST(ConfigRules, CrossFieldViolation) {
  const auto read = [](ConfigTable root) {
    ConfigTable policy = root.table("policy");
    const auto raise = policy.optional<double>("raise_sigma", 2.0);
    const auto clear = policy.optional<double>("clear_sigma", 2.5);
    if (raise <= clear) {
      root.fail("policy.raise_sigma", "2.0 must exceed policy.clear_sigma (2.5)", {"policy.clear_sigma"});
    }
  };
  EXPECT_EQ(errors_after("[policy]\n\n  raise_sigma = 2.0\nclear_sigma = 2.5\n", read),
            "conf/t.toml:3:3: policy.raise_sigma: 2.0 must exceed policy.clear_sigma (2.5)");
  // The key is not written: its table is the place.
  EXPECT_EQ(errors_after("a.b = 0\n[policy]\nclear_sigma = 2.5\n",
                         [&](ConfigTable root) {
                           EXPECT_EQ(root.table("a").required<int>("b"), 0);
                           read(root);
                         }),
            "conf/t.toml:2:1: policy.raise_sigma: 2.0 must exceed policy.clear_sigma (2.5)");
  EXPECT_EQ(errors_after("", read),
            "conf/t.toml:1:1: policy.raise_sigma: 2.0 must exceed policy.clear_sigma (2.5)");
}

TEST(ConfigRules, CrossFieldViolationWithASubstituteIsNoNews) {
  const auto read = [](ConfigTable root) {
    EXPECT_EQ(root.required<double>("raise"), 0.0);
    EXPECT_EQ(root.optional<double>("clear", 2.5), 2.5);
    root.fail("raise", "must exceed clear");
    root.fail("clear", "must be less than raise", {"raise"});
  };
  EXPECT_EQ(errors_after("raise = \"x\"\n", read),
            "conf/t.toml:1:1: raise: expected a number, found the string \"x\"");
}

TEST(ConfigRules, CrossFieldViolationWithASubstituteArrayIsNoNews) {
  EXPECT_EQ(errors_after("ids = [1, true]\n",
                         [](ConfigTable root) {
                           EXPECT_TRUE(root.required<std::vector<int>>("ids").empty());
                           root.fail("ids", "must not be empty");
                         }),
            "conf/t.toml:1:11: ids[1]: expected an integer, found the boolean true");
}

}  // namespace
}  // namespace airworthy::rt
