#include <gtest/gtest.h>

#include "tests/runtime/config_support.h"

namespace airworthy::rt {
namespace {

std::string hash_of(std::string_view text, const std::vector<std::string>& overrides = {}) {
  auto file = ConfigFile::parse(text, "t.toml", overrides);
  ConfigTable root = file.root();
  (void)root.optional<std::string>("name", "quad1");
  (void)root.optional<double>("period_s", 0.5);
  (void)root.table("policy").optional<int>("order", 2);
  (void)root.optional<std::vector<bool>>("mask", {true, false});
  for (ConfigTable channel : root.tables("channel")) (void)channel.required<std::string>("name");
  EXPECT_EQ(errors_of(file), "");
  return file.hash();
}

TEST(ConfigHash, IsFnv1aOfTheSortedEffectiveKeys) {
  auto nothing = ConfigFile::parse("", "t.toml");
  EXPECT_EQ(nothing.hash(), "cbf29ce484222325");  // the offset basis
  auto file = ConfigFile::parse("b = 1\n", "t.toml");
  EXPECT_EQ(file.root().required<int>("b"), 1);
  EXPECT_EQ(file.root().optional<double>("a", 0.5), 0.5);
  // FNV-1a 64 of "a=0.5\nb=1\n", computed independently.
  EXPECT_EQ(file.hash(), "3e14809ebcffa67c");
}

TEST(ConfigHash, IgnoresHowItIsWritten) {
  const std::string base = hash_of("");
  EXPECT_EQ(hash_of("# a comment\n\nperiod_s = 0.50\nname = 'quad1'\n"), base);
  EXPECT_EQ(hash_of("policy = { order = 2 }\n"), base);
  EXPECT_EQ(hash_of("[policy]\n"), base);
  EXPECT_EQ(hash_of("mask = [true,\n false]\n"), base);
  EXPECT_EQ(hash_of("", {"name=quad1"}), base);
  EXPECT_EQ(hash_of("period_s = 3\n"), hash_of("period_s = 3.0\n"));
}

TEST(ConfigHash, ChangesWithEveryEffectiveValue) {
  const std::string base = hash_of("");
  EXPECT_NE(hash_of("name = \"quad2\"\n"), base);
  EXPECT_NE(hash_of("period_s = 0.51\n"), base);
  EXPECT_NE(hash_of("policy.order = 3\n"), base);
  EXPECT_NE(hash_of("mask = [true]\n"), base);
  EXPECT_NE(hash_of("", {"policy.order=3"}), base);
  EXPECT_EQ(hash_of("", {"policy.order=3"}), hash_of("policy.order = 3\n"));
  EXPECT_NE(hash_of("[[channel]]\nname = \"a\"\n"), base);
  EXPECT_NE(hash_of("[[channel]]\nname = \"a\"\n[[channel]]\nname = \"b\"\n"),
            hash_of("[[channel]]\nname = \"b\"\n[[channel]]\nname = \"a\"\n"));
}

TEST(ConfigHash, TextCannotPassForAnotherKey) {
  EXPECT_NE(hash_of("name = \"x\\nperiod_s=0.5\"\n"), hash_of("name = \"x\"\n"));
}

}  // namespace
}  // namespace airworthy::rt
