#include "runtime/bus/log_writer.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "airworthy/tick_t.hpp"
#include "runtime/bus/log_bus.h"
#include "tests/runtime/temporary_folder.h"

namespace airworthy::rt {
namespace {

std::vector<std::uint8_t> tick(std::int64_t time_us, std::int64_t seq) {
  tick_t message;
  message.header.time_us = time_us - 7;
  message.header.sent_us = time_us;
  message.header.seq = seq;
  message.header.producer = "test";
  message.header.session = 1;
  std::vector<std::uint8_t> payload(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(payload.data(), 0, static_cast<int>(payload.size()));
  return payload;
}

class LogWriterTest : public ::testing::Test {
 protected:
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator{folder_.path()}) {
      names.push_back(entry.path().filename());
    }
    return names;
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.path() / "flight.lcm";
};

TEST_F(LogWriterTest, WritesEventsOnTheTimeTheirHeadersWereSent) {
  auto writer = LogWriter::create(path_);
  ASSERT_TRUE(writer) << writer.error().text;
  const auto first = tick(1'000'000, 0);
  ASSERT_TRUE((*writer)->publish("v1/TICK", first));
  ASSERT_TRUE((*writer)->publish("v1/OTHER", tick(1'500'000, 1)));
  ASSERT_TRUE((*writer)->commit());
  EXPECT_EQ((*writer)->messages(), (std::map<std::string, std::int64_t>{{"v1/OTHER", 1}, {"v1/TICK", 1}}));

  lcm_eventlog_t* log = lcm_eventlog_create(path_.c_str(), "r");
  ASSERT_NE(log, nullptr);
  lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->eventnum, 0);
  EXPECT_EQ(event->timestamp, 1'000'000);
  EXPECT_EQ(std::string(event->channel, static_cast<std::size_t>(event->channellen)), "v1/TICK");
  const auto* data = static_cast<const std::uint8_t*>(event->data);
  EXPECT_EQ(std::vector<std::uint8_t>(data, data + event->datalen), first);
  lcm_eventlog_free_event(event);
  event = lcm_eventlog_read_next_event(log);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->eventnum, 1);
  EXPECT_EQ(event->timestamp, 1'500'000);
  lcm_eventlog_free_event(event);
  EXPECT_EQ(lcm_eventlog_read_next_event(log), nullptr);
  lcm_eventlog_destroy(log);
}

TEST_F(LogWriterTest, ThereIsNoLogBeforeTheCommit) {
  {
    auto writer = LogWriter::create(path_);
    ASSERT_TRUE(writer);
    ASSERT_TRUE((*writer)->publish("v1/TICK", tick(1'000'000, 0)));
    EXPECT_EQ(files(), std::vector<std::string>{"flight.lcm.partial"});
  }
  EXPECT_TRUE(files().empty());
}

TEST_F(LogWriterTest, AnAbandonedLogLeavesTheOlderOneAsItWas) {
  folder_.write("flight.lcm", "older");
  {
    auto writer = LogWriter::create(path_);
    ASSERT_TRUE(writer);
    ASSERT_TRUE((*writer)->publish("v1/TICK", tick(1'000'000, 0)));
  }
  std::string content;
  std::getline(std::ifstream{path_}, content);
  EXPECT_EQ(content, "older");
  EXPECT_EQ(files(), std::vector<std::string>{"flight.lcm"});
}

TEST_F(LogWriterTest, ACommitReplacesTheOlderLog) {
  folder_.write("flight.lcm", "older");
  auto writer = LogWriter::create(path_);
  ASSERT_TRUE(writer);
  ASSERT_TRUE((*writer)->commit());
  EXPECT_EQ(std::filesystem::file_size(path_), 0U);
  EXPECT_EQ(files(), std::vector<std::string>{"flight.lcm"});
}

TEST_F(LogWriterTest, AMessageWithoutATimeFailsTheLog) {
  auto writer = LogWriter::create(path_);
  ASSERT_TRUE(writer);
  const std::vector<std::uint8_t> stump(20);
  const auto published = (*writer)->publish("v1/TICK", stump);
  ASSERT_FALSE(published);
  EXPECT_EQ(published.error().text, path_ + ": a message on v1/TICK without a vehicle time");
  ASSERT_TRUE((*writer)->publish("v1/TICK", tick(1'000'000, 0)));
  const auto committed = (*writer)->commit();
  ASSERT_FALSE(committed);
  EXPECT_EQ(committed.error().text, published.error().text);
  writer->reset();
  EXPECT_TRUE(files().empty());
}

TEST_F(LogWriterTest, AFullDiskIsAnError) {
  std::filesystem::create_symlink("/dev/full", path_ + ".partial");
  auto writer = LogWriter::create(path_);
  ASSERT_TRUE(writer) << writer.error().text;
  for (int i = 0; i < 1000; ++i) {
    if (!(*writer)->publish("v1/TICK", tick(1'000'000 + i, i))) break;
  }
  const auto committed = (*writer)->commit();
  ASSERT_FALSE(committed);
  EXPECT_EQ(committed.error().text, path_ + ": No space left on device");
  writer->reset();
  EXPECT_TRUE(files().empty());
}

TEST_F(LogWriterTest, NothingButAFileIsReplaced) {
  ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);
  EXPECT_EQ(LogWriter::create(path_).error().text, path_ + ": exists and is not a regular file");
  EXPECT_TRUE(std::filesystem::is_fifo(path_));
  const std::string link = folder_.path() / "link.lcm";
  std::filesystem::create_symlink(folder_.write("older.lcm", "older"), link);
  EXPECT_EQ(LogWriter::create(link).error().text, link + ": exists and is not a regular file");
  const std::string folder = folder_.path().string();
  EXPECT_EQ(LogWriter::create(folder).error().text, folder + ": exists and is not a regular file");
}

TEST_F(LogWriterTest, AFolderThatDoesNotExistIsAnError) {
  const auto writer = LogWriter::create("/nonexistent/flight.lcm");
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().text, "/nonexistent/flight.lcm.partial: No such file or directory");
}

TEST_F(LogWriterTest, NobodyCanListen) {
  auto writer = LogWriter::create(path_);
  ASSERT_TRUE(writer);
  const auto subscribed = (*writer)->subscribe("v1/TICK", [](std::span<const std::uint8_t>) {});
  ASSERT_FALSE(subscribed);
  EXPECT_EQ(subscribed.error().text, path_ + ": cannot listen to v1/TICK on a log that is being written");
}

}  // namespace
}  // namespace airworthy::rt
