// --set: what it replaces, what it creates, and what it says when it is wrong.

#include <gtest/gtest.h>

#include "tests/runtime/config_support.h"

namespace airworthy::rt {
namespace {

constexpr std::string_view kText = R"(
name = "quad1"
period_s = 0.2
[policy]
raise_sigma = 3.0
[[channel]]
name = "a"
[[channel]]
name = "b"
)";

struct Values {
  std::string name;
  double period_s = 0.0;
  double raise_sigma = 0.0;
  std::vector<std::string> channels;
};

/// Reads kText with the overrides on top.
Expected<Values> read(const std::vector<std::string>& overrides) {
  auto file = ConfigFile::parse(kText, "t.toml", overrides);
  ConfigTable root = file.root();
  Values values;
  values.name = root.required<std::string>("name");
  values.period_s = root.required<double>("period_s", Range{0.01, 10.0});
  values.raise_sigma = root.table("policy").required<double>("raise_sigma");
  for (ConfigTable channel : root.tables("channel", {.unique_key = "name"})) {
    values.channels.push_back(channel.required<std::string>("name"));
  }
  return file.finish(std::move(values));
}

std::string errors_with(const std::vector<std::string>& overrides) {
  const auto values = read(overrides);
  return values ? "" : values.error().text;
}

TEST(ConfigOverrides, ReplaceValuesAtAnyDepth) {
  const auto values = read({"name=quad2", "period_s=1", "policy.raise_sigma=4.5", "channel[1].name=\"c\""});
  ASSERT_TRUE(values.has_value()) << values.error().text;
  EXPECT_EQ(values->name, "quad2");
  EXPECT_EQ(values->period_s, 1.0);
  EXPECT_EQ(values->raise_sigma, 4.5);
  EXPECT_EQ(values->channels, (std::vector<std::string>{"a", "c"}));
}

TEST(ConfigOverrides, TheLastOneWins) {
  const auto values = read({"period_s=1", "period_s=2"});
  ASSERT_TRUE(values.has_value());
  EXPECT_EQ(values->period_s, 2.0);
}

TEST(ConfigOverrides, ReplaceWholeTablesAndArrays) {
  const auto values = read({"policy={ raise_sigma = 7 }", "channel=[{ name = \"x\" }]"});
  ASSERT_TRUE(values.has_value()) << values.error().text;
  EXPECT_EQ(values->raise_sigma, 7.0);
  EXPECT_EQ(values->channels, (std::vector<std::string>{"x"}));
}

TEST(ConfigOverrides, WhatIsNotTomlIsAString) {
  for (const std::string text :
       {"quad two", "", "a=b", "1.2.3", "\"open", "1\nperiod_s = 9", "0x", "[1, 2"}) {
    const auto values = read({"name=" + text});
    ASSERT_TRUE(values.has_value()) << text << values.error().text;
    EXPECT_EQ(values->name, text);
    EXPECT_EQ(values->period_s, 0.2);
  }
}

TEST(ConfigOverrides, CreateKeysAndTables) {
  auto file = ConfigFile::parse("", "t.toml", {"a.b.c=1", "a.b.d=true"});
  ConfigTable b = file.root().table("a").table("b");
  EXPECT_EQ(b.required<int>("c"), 1);
  EXPECT_EQ(b.required<bool>("d"), true);
  EXPECT_EQ(errors_of(file), "");
}

TEST(ConfigOverrides, ABadValueIsBlamedOnTheOverride) {
  EXPECT_EQ(errors_with({"period_s=abc"}), "--set period_s: expected a number, found the string \"abc\"");
  EXPECT_EQ(errors_with({"period_s=20"}), "--set period_s: must lie in [0.01, 10], is 20");
  EXPECT_EQ(errors_with({"period_s=nan"}), "--set period_s: must be finite, is nan");
  EXPECT_EQ(errors_with({"policy=3"}), "--set policy: expected a table, found the integer 3");
  EXPECT_EQ(errors_with({"policy={ raise_sigma = true }"}),
            "--set policy.raise_sigma: expected a number, found the boolean true");
  EXPECT_EQ(errors_with({"policy={}"}), "--set policy.raise_sigma: missing mandatory key");
  EXPECT_EQ(errors_with({"channel[0].name=3"}),
            "--set channel[0].name: expected a string, found the integer 3");
  EXPECT_EQ(errors_with({"channel[1].name=a"}), "--set channel[1].name: \"a\" is already used by channel[0]");
}

TEST(ConfigOverrides, AnUnknownKeyIsBlamedOnTheOverride) {
  EXPECT_EQ(errors_with({"colour=red"}), "--set colour: unknown key");
  EXPECT_EQ(errors_with({"policy.order=2"}), "--set policy.order: unknown key");
  EXPECT_EQ(errors_with({"a.b.c=2"}), "--set a: unknown key");
  EXPECT_EQ(errors_with({"policy={ raise_sigma = 1, order = 2 }"}), "--set policy.order: unknown key");
}

TEST(ConfigOverrides, Malformed) {
  EXPECT_EQ(errors_with({"period_s"}), "--set \"period_s\": must be of the form key.path=value");
  EXPECT_EQ(errors_with({"=1"}), "--set \"=1\": must be of the form key.path=value");
  EXPECT_EQ(errors_with({""}), "--set \"\": must be of the form key.path=value");
  EXPECT_EQ(errors_with({"a..b=1"}), "--set \"a..b=1\": must be of the form key.path=value");
  EXPECT_EQ(errors_with({"a.=1"}), "--set \"a.=1\": must be of the form key.path=value");
  EXPECT_EQ(errors_with({"a b=1"}), "--set \"a b=1\": must be of the form key.path=value");
  EXPECT_EQ(errors_with({"channel[x].name=1"}),
            "--set \"channel[x].name=1\": must be of the form key.path=value");
  EXPECT_EQ(errors_with({"channel[-1].name=1"}),
            "--set \"channel[-1].name=1\": must be of the form key.path=value");
  EXPECT_EQ(errors_with({"channel[0=1"}), "--set \"channel[0=1\": must be of the form key.path=value");
  EXPECT_EQ(errors_with({"[0]=1"}), "--set \"[0]=1\": must be of the form key.path=value");
}

TEST(ConfigOverrides, ThroughSomethingElse) {
  EXPECT_EQ(errors_with({"channel[2].name=c"}), "--set channel[2].name: channel has 2 elements");
  EXPECT_EQ(errors_with({"name[0]=c"}), "--set name[0]: name is not an array but a string");
  EXPECT_EQ(errors_with({"period_s.x=1"}), "--set period_s.x: period_s is not a table but a number");
  EXPECT_EQ(errors_with({"channel.name=1"}), "--set channel.name: channel is not a table but an array");
}

TEST(ConfigOverrides, ErrorsOfTheFileComeFirst) {
  auto file = ConfigFile::parse("z = 1\n", "t.toml", {"b=x", "broken"});
  EXPECT_EQ(file.root().required<int>("b"), 0);
  EXPECT_EQ(file.root().required<int>("a"), 0);
  EXPECT_EQ(errors_of(file),
            "t.toml:1:1: a: missing mandatory key\n"
            "t.toml:1:1: z: unknown key\n"
            "--set \"broken\": must be of the form key.path=value\n"
            "--set b: expected an integer, found the string \"x\"");
}

TEST(ConfigOverrides, AMissingKeyOfATableOnlyAnOverrideCreatedIsTheFilesFault) {
  auto file = ConfigFile::parse("\n[outer]\n", "t.toml", {"outer.link.baud=9600"});
  ConfigTable link = file.root().table("outer").table("link");
  EXPECT_EQ(link.required<int>("baud"), 9600);
  EXPECT_EQ(link.required<std::string>("device"), "");
  EXPECT_EQ(errors_of(file), "t.toml:2:1: outer.link.device: missing mandatory key");
}

TEST(ConfigOverrides, AViolationOfAnOverriddenKey) {
  auto file = ConfigFile::parse(kText, "t.toml", {"policy.raise_sigma=1"});
  ConfigTable root = file.root();
  (void)root.required<std::string>("name");
  (void)root.required<double>("period_s");
  (void)root.table("policy").required<double>("raise_sigma");
  for (ConfigTable channel : root.tables("channel")) (void)channel.required<std::string>("name");
  root.fail("policy.raise_sigma", "1 must exceed policy.clear_sigma (2.5)");
  EXPECT_EQ(errors_of(file), "--set policy.raise_sigma: 1 must exceed policy.clear_sigma (2.5)");
}

}  // namespace
}  // namespace airworthy::rt
