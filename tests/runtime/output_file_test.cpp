#include "runtime/file/output_file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <fstream>
#include <iterator>

#include "tests/runtime/temporary_folder.h"

namespace airworthy::rt {
namespace {

namespace fs = std::filesystem;

class OutputFileTest : public ::testing::Test {
 protected:
  static std::string read(const fs::path& path) {
    std::ifstream file{path, std::ios::binary};
    return {std::istreambuf_iterator<char>{file}, {}};
  }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator{folder_.path()}, {}));
  }
  static std::string error_of(const fs::path& path, const std::string& text = "new") {
    const auto written = write_file(path, text);
    return written ? "" : written.error().text;
  }

  TemporaryFolder folder_;
};

TEST_F(OutputFileTest, WritesANewFileAndReplacesAnOldOne) {
  const fs::path path = folder_.path() / "out.toml";
  EXPECT_EQ(error_of(path, "first"), "");
  EXPECT_EQ(error_of(path, "second"), "");
  EXPECT_EQ(read(path), "second");
  EXPECT_EQ(files(), 1U);
}

TEST_F(OutputFileTest, WhatIsNoRegularFileStaysAsItIs) {
  const fs::path target = folder_.write("target.toml", "old");
  const fs::path link = folder_.path() / "link";
  const fs::path dangling = folder_.path() / "dangling";
  const fs::path pipe = folder_.path() / "pipe";
  const fs::path inner = folder_.path() / "folder";
  fs::create_symlink(target, link);
  fs::create_symlink(folder_.path() / "nowhere", dangling);
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  fs::create_directory(inner);
  for (const fs::path& path : {link, dangling, pipe, inner}) {
    EXPECT_EQ(error_of(path), path.string() + ": exists and is not a regular file");
  }
  EXPECT_TRUE(fs::is_symlink(link) && fs::is_symlink(dangling) && fs::is_fifo(pipe));
  EXPECT_EQ(read(target), "old");
  EXPECT_EQ(files(), 5U);
}

TEST_F(OutputFileTest, ADeviceIsRefusedBeforeItIsTouched) {
  const auto checked = check_output_path("/dev/null");
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().text, "/dev/null: exists and is not a regular file");
}

TEST_F(OutputFileTest, SaysWhyItCannotWrite) {
  const fs::path nowhere = folder_.path() / "missing" / "out.toml";
  EXPECT_EQ(error_of(nowhere), nowhere.string() + ": cannot be written: No such file or directory");
}

TEST_F(OutputFileTest, AFullDiskLeavesTheOldFileAndNothingElse) {
  const fs::path path = folder_.write("out.toml", "old");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 100;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string error = error_of(path, std::string(1000, 'x'));
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  signal(SIGXFSZ, old_handler);
  EXPECT_EQ(error, path.string() + ": cannot be written: File too large");
  EXPECT_EQ(read(path), "old");
  EXPECT_EQ(files(), 1U);
}

}  // namespace
}  // namespace airworthy::rt
