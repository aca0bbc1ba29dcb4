#include "cli/dispatch/commands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace airworthy::cli {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class CommandsTest : public ::testing::Test {
 protected:
  CommandsTest() {
    std::string pattern = (fs::temp_directory_path() / "commands_test.XXXXXX").string();
    root_ = mkdtemp(pattern.data());
    fs::create_directories(root_ / "a");
    fs::create_directories(root_ / "b");
  }
  ~CommandsTest() override { fs::remove_all(root_); }

  void add(const std::string& path, bool executable = true) {
    std::ofstream{root_ / path} << "x";
    if (executable) fs::permissions(root_ / path, fs::perms::owner_all);
  }

  fs::path root_;
};

TEST_F(CommandsTest, FindsTheFirst) {
  add("a/airworthy-watch");
  add("b/airworthy-watch");
  add("b/airworthy-doctor");
  const Commands commands{{(root_ / "missing").string(), (root_ / "a").string(), (root_ / "b").string()}};
  EXPECT_EQ(commands.find("watch"), (root_ / "a/airworthy-watch").string());
  EXPECT_EQ(commands.find("doctor"), (root_ / "b/airworthy-doctor").string());
  EXPECT_EQ(commands.find("nonsense"), std::nullopt);
  EXPECT_THAT(commands.list(), ElementsAre("doctor", "watch"));
}

TEST_F(CommandsTest, OnlyProgramsCount) {
  add("a/airworthy-text", false);
  fs::create_directories(root_ / "a/airworthy-folder");
  add("a/airworthy-Bad");
  add("a/other");
  const Commands commands{{(root_ / "a").string()}};
  EXPECT_EQ(commands.find("text"), std::nullopt);
  EXPECT_EQ(commands.find("folder"), std::nullopt);
  EXPECT_THAT(commands.list(), IsEmpty());
}

TEST_F(CommandsTest, ANameIsNoPathAndNoOption) {
  for (const char* name : {"", "-h", "--help", "../watch", "a/b", "Watch", "1", "watch ", "w.x"}) {
    EXPECT_FALSE(is_command_name(name)) << name;
  }
  EXPECT_TRUE(is_command_name("esc-serial"));
  EXPECT_TRUE(is_command_name("can2"));
  add("a/airworthy-watch");
  EXPECT_EQ(Commands{{(root_ / "a").string()}}.find("../a/airworthy-watch"), std::nullopt);
}

TEST_F(CommandsTest, HelpTellsToolsFromProcesses) {
  const std::string help = help_text({"gateway", "watch"});
  const std::size_t others = help.find("Processes of the vehicle");
  ASSERT_NE(others, std::string::npos);
  EXPECT_THAT(help.substr(0, others), AllOf(HasSubstr("watch"), HasSubstr("version")));
  EXPECT_THAT(help.substr(others), HasSubstr("gateway"));
  EXPECT_EQ(help_text({"watch"}).find("Processes of the vehicle"), std::string::npos);
}

}  // namespace
}  // namespace airworthy::cli
