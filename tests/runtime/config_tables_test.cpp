// Sub-tables, arrays of tables, and the rules about them.

#include <gtest/gtest.h>

#include "tests/runtime/config_support.h"

namespace airworthy::rt {
namespace {

template <class Read>
std::string errors_after(std::string_view text, Read read) {
  auto file = ConfigFile::parse(text, "t.toml");
  read(file.root());
  return errors_of(file);
}

TEST(ConfigTables, SubTablesInEveryNotation) {
  for (const std::string_view text :
       {"[a.b]\nc = 1\n", "a.b.c = 1\n", "[a]\nb.c = 1\n", "a = { b = { c = 1 } }\n"}) {
    EXPECT_EQ(
        errors_after(text,
                     [](ConfigTable root) { EXPECT_EQ(root.table("a").table("b").required<int>("c"), 1); }),
        "")
        << text;
  }
}

TEST(ConfigTables, MissingKeyIsReportedWhereItsTableIsWritten) {
  const auto read = [](ConfigTable root) { EXPECT_EQ(root.table("a").table("b").required<int>("c"), 0); };
  EXPECT_EQ(errors_after("\n  [a.b]\n", read), "t.toml:2:3: a.b.c: missing mandatory key");
  EXPECT_EQ(errors_after("\n\na = { b = { } }\n", read), "t.toml:3:11: a.b.c: missing mandatory key");
  EXPECT_EQ(errors_after("\n\n[a]\n", read), "t.toml:3:1: a.b.c: missing mandatory key");
  EXPECT_EQ(errors_after("", read), "t.toml:1:1: a.b.c: missing mandatory key");
}

TEST(ConfigTables, MissingMandatoryTable) {
  EXPECT_EQ(errors_after("x = 1\n",
                         [](ConfigTable root) {
                           EXPECT_EQ(root.required<int>("x"), 1);
                           ConfigTable link = root.required_table("link");
                           EXPECT_EQ(link.optional<int>("baud", 115200), 115200);
                           EXPECT_EQ(link.required<std::string>("device"), "");
                         }),
            "t.toml:1:1: link: missing mandatory table\n"
            "t.toml:1:1: link.device: missing mandatory key");
}

TEST(ConfigTables, OptionalTable) {
  const auto read = [](ConfigTable root) {
    if (auto security = root.optional_table("security")) (void)security->required<std::string>("key");
  };
  EXPECT_EQ(errors_after("", read), "");
  EXPECT_EQ(errors_after("[security]\n", read), "t.toml:1:1: security.key: missing mandatory key");
}

TEST(ConfigTables, ATableThatIsNoneIsReportedOnce) {
  EXPECT_EQ(errors_after("policy = 3\nlinks = [1]\n",
                         [](ConfigTable root) {
                           ConfigTable policy = root.required_table("policy");
                           EXPECT_EQ(policy.required<int>("order"), 0);
                           EXPECT_EQ(policy.table("inner").optional<int>("x", 5), 5);
                           EXPECT_TRUE(policy.tables("channel", {.count = Count::at_least(1)}).empty());
                           policy.fail("order", "is wrong");
                           EXPECT_TRUE(root.optional_table("links").has_value());
                         }),
            "t.toml:1:1: policy: expected a table, found the integer 3\n"
            "t.toml:2:1: links: expected a table, found an array");
}

TEST(ConfigTables, UnknownTableIsReportedOnceWithoutItsContent) {
  EXPECT_EQ(errors_after("[polcy]\na = 1\nb = 2\n[other]\n[other.deep]\nz = 1\n",
                         [](ConfigTable root) { EXPECT_EQ(root.table("policy").optional<int>("a", 4), 4); }),
            "t.toml:1:2: polcy: unknown key, did you mean policy?\n"
            "t.toml:4:2: other: unknown key");
}

TEST(ConfigTables, UnknownKeysAreFoundAtAnyDepth) {
  EXPECT_EQ(errors_after("[a.b]\nx = 1\n[[c]]\ny = 1\n[[c]]\nd = [{ z = 1 }]\n",
                         [](ConfigTable root) {
                           (void)root.table("a").table("b");
                           for (ConfigTable c : root.tables("c")) (void)c.tables("d");
                         }),
            "t.toml:2:1: a.b.x: unknown key\n"
            "t.toml:4:1: c[0].y: unknown key\n"
            "t.toml:6:8: c[1].d[0].z: unknown key");
}

TEST(ConfigTables, ArrayOfTablesInEveryNotation) {
  for (const std::string_view text : {"[[channel]]\nname = \"a\"\n[[channel]]\nname = \"b\"\n",
                                      "channel = [{ name = \"a\" }, { name = \"b\" }]\n"}) {
    EXPECT_EQ(errors_after(text,
                           [](ConfigTable root) {
                             std::string names;
                             for (ConfigTable channel : root.tables("channel", {.unique_key = "name"})) {
                               names += channel.required<std::string>("name");
                             }
                             EXPECT_EQ(names, "ab");
                           }),
              "")
        << text;
  }
}

TEST(ConfigTables, KeysOfArrayElementsCarryTheirIndex) {
  EXPECT_EQ(errors_after("[[channel]]\nname = \"a\"\nrate_Hz = 0\n[[channel]]\n\n[[channel]]\nname = 7\n",
                         [](ConfigTable root) {
                           for (ConfigTable channel : root.tables("channel")) {
                             (void)channel.required<std::string>("name");
                             (void)channel.optional<double>("rate_Hz", 1.0, Range::above(0.0));
                           }
                         }),
            "t.toml:3:1: channel[0].rate_Hz: must be greater than 0, is 0\n"
            "t.toml:4:1: channel[1].name: missing mandatory key\n"
            "t.toml:7:1: channel[2].name: expected a string, found the integer 7");
}

TEST(ConfigTables, NestedArraysOfTables) {
  EXPECT_EQ(errors_after("[[link]]\n[[link.rotor]]\nindex = 0\n[[link]]\n[[link.rotor]]\nindex = 1\n"
                         "[[link.rotor]]\nindex = -2\n",
                         [](ConfigTable root) {
                           for (ConfigTable link : root.tables("link")) {
                             for (ConfigTable rotor : link.tables("rotor")) {
                               (void)rotor.required<int>("index", Range{0, 7});
                             }
                           }
                         }),
            "t.toml:8:1: link[1].rotor[1].index: must lie in [0, 7], is -2");
}

TEST(ConfigTables, NotAnArrayOfTables) {
  EXPECT_EQ(errors_after("[channel]\n[mixed]\nlist = [{ a = 1 }, 2, \"x\"]\n",
                         [](ConfigTable root) {
                           EXPECT_TRUE(root.tables("channel").empty());
                           std::vector<ConfigTable> list = root.table("mixed").tables("list");
                           ASSERT_EQ(list.size(), 1U);
                           EXPECT_EQ(list[0].required<int>("a"), 1);
                         }),
            "t.toml:1:2: channel: expected an array of tables, found a table\n"
            "t.toml:3:20: mixed.list[1]: expected a table, found the integer 2\n"
            "t.toml:3:23: mixed.list[2]: expected a table, found the string \"x\"");
}

TEST(ConfigTables, CountOfTables) {
  const auto read = [](ConfigTable root) {
    for (ConfigTable rotor : root.tables("rotor", {.count = Count{3, 4}})) (void)rotor.required<int>("index");
  };
  EXPECT_EQ(errors_after("", read), "t.toml:1:1: rotor: missing mandatory tables, must have 3 to 4 elements");
  EXPECT_EQ(errors_after("[[rotor]]\nindex = 1\n", read),
            "t.toml:1:3: rotor: must have 3 to 4 elements, has 1");
}

TEST(ConfigTables, DuplicateNames) {
  EXPECT_EQ(
      errors_after("[[channel]]\nname = \"imu\"\n[[channel]]\nname = \"esc\"\n[[channel]]\nname = \"imu\"\n"
                   "[[channel]]\nname = \"imu\"\n[[channel]]\n",
                   [](ConfigTable root) {
                     for (ConfigTable channel : root.tables("channel", {.unique_key = "name"})) {
                       (void)channel.required<std::string>("name");
                     }
                   }),
      "t.toml:6:1: channel[2].name: \"imu\" is already used by channel[0]\n"
      "t.toml:8:1: channel[3].name: \"imu\" is already used by channel[0]\n"
      "t.toml:9:1: channel[4].name: missing mandatory key");
}

TEST(ConfigTables, DuplicateNumbers) {
  EXPECT_EQ(errors_after("rotor = [{ index = 1 }, { index = 2 },\n { index = 1 }]\n",
                         [](ConfigTable root) {
                           for (ConfigTable rotor : root.tables("rotor", {.unique_key = "index"})) {
                             (void)rotor.required<int>("index");
                           }
                         }),
            "t.toml:2:4: rotor[2].index: 1 is already used by rotor[0]");
}

TEST(ConfigTables, ViolationInAnArrayElement) {
  EXPECT_EQ(errors_after("[[channel]]\nname = \"a\"\n[[channel]]\nname = \"b\"\n",
                         [](ConfigTable root) {
                           for (ConfigTable channel : root.tables("channel")) {
                             if (channel.required<std::string>("name") == "b")
                               channel.fail("name", "is not wanted");
                           }
                           root.fail("channel[0].name", "comes first");
                           root.fail("channel[7].name", "is nowhere");
                         }),
            "t.toml:1:3: channel[7].name: is nowhere\n"
            "t.toml:2:1: channel[0].name: comes first\n"
            "t.toml:4:1: channel[1].name: is not wanted");
}

}  // namespace
}  // namespace airworthy::rt
