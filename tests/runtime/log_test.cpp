#include "runtime/log/log.h"

#include <gmock/gmock.h>
#include <spdlog/sinks/ostream_sink.h>

#include <limits>
#include <optional>
#include <sstream>
#include <vector>

namespace airworthy::rt {
namespace {

using testing::ElementsAre;
using testing::MatchesRegex;
using namespace std::chrono_literals;

/// A log on a clock of its own, written to memory.
class LogTest : public testing::Test {
 protected:
  void open(LogLevel level = LogLevel::kDebug) {
    log_.emplace("airworthy-x", level, std::make_shared<spdlog::sinks::ostream_sink_st>(out_),
                 [this] { return now_; });
  }

  /// The lines so far, without their time, which is that of the computer.
  std::vector<std::string> lines() {
    std::vector<std::string> result;
    std::istringstream in{out_.str()};
    for (std::string line; std::getline(in, line);) {
      EXPECT_THAT(line.substr(0, line.find(' ')),
                  MatchesRegex("[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}\\.[0-9]{3}Z"));
      result.push_back(line.substr(line.find(' ') + 1));
    }
    out_.str("");
    return result;
  }

  std::ostringstream out_;
  std::chrono::steady_clock::time_point now_{1h};
  std::optional<Log> log_;
};

TEST_F(LogTest, OneLinePerEvent) {
  open();
  log_->info("link_open", {{"path", "/dev/ttyUSB0"}, {"baud", 57600}});
  log_->debug("idle");
  log_->warning("link_lost", {{"after_s", 0.25}});
  log_->error("bus_gone", {{"ok", false}});
  EXPECT_THAT(lines(), ElementsAre("info airworthy-x link_open path=/dev/ttyUSB0 baud=57600",
                                   "debug airworthy-x idle", "warning airworthy-x link_lost after_s=0.25",
                                   "error airworthy-x bus_gone ok=false"));
}

TEST_F(LogTest, ValuesOfEveryType) {
  open();
  const std::string text = "plain";
  log_->info("values", {{"string", text},
                        {"view", std::string_view{"v"}},
                        {"least", std::numeric_limits<std::int64_t>::min()},
                        {"most", std::numeric_limits<std::uint64_t>::max()},
                        {"byte", std::uint8_t{65}},
                        {"nan", std::numeric_limits<double>::quiet_NaN()},
                        {"float", 0.5F},
                        {"yes", true}});
  EXPECT_THAT(lines(), ElementsAre("info airworthy-x values string=plain view=v least=-9223372036854775808 "
                                   "most=18446744073709551615 byte=65 nan=nan float=0.5 yes=true"));
}

TEST_F(LogTest, TextIsQuotedWhereItMustBe) {
  open();
  log_->info("text", {{"words", "two words"},
                      {"empty", ""},
                      {"equals", "a=b"},
                      {"quote", "say \"hi\" \\"},
                      {"lines", "one\ntwo\r\x1b[31m"},
                      {"braces", "{} {:d}"}});
  EXPECT_THAT(lines(), ElementsAre(R"(info airworthy-x text words="two words" empty="" equals="a=b" )"
                                   R"(quote="say \"hi\" \\" lines="one\ntwo\x0d\x1b[31m" braces="{} {:d}")"));
}

TEST_F(LogTest, LevelsBelowTheThresholdAreSilent) {
  open(LogLevel::kWarning);
  log_->debug("a");
  log_->info("b");
  log_->warning("c");
  log_->error("d");
  EXPECT_THAT(lines(), ElementsAre("warning airworthy-x c", "error airworthy-x d"));
}

TEST_F(LogTest, ABurstIsCutAndCounted) {
  open();
  for (int i = 0; i < 25; ++i) log_->info("noise", {{"i", i}});
  EXPECT_EQ(lines().size(), static_cast<std::size_t>(Log::kBurst));
  now_ += Log::kWindow - 1ms;
  log_->info("noise", {{"i", 25}});
  EXPECT_TRUE(lines().empty());
  now_ += 1ms;
  log_->info("noise", {{"i", 26}});
  log_->info("noise", {{"i", 27}});
  EXPECT_THAT(lines(),
              ElementsAre("info airworthy-x noise i=26 suppressed=16", "info airworthy-x noise i=27"));
}

TEST_F(LogTest, OneEventDoesNotSilenceAnother) {
  open();
  for (int i = 0; i < 100; ++i) log_->info("noise");
  (void)lines();
  log_->error("bus_gone");
  EXPECT_THAT(lines(), ElementsAre("error airworthy-x bus_gone"));
}

TEST_F(LogTest, WhatWasSuppressedIsSaidAtTheEnd) {
  open();
  for (int i = 0; i < 12; ++i) log_->warning("noise");
  (void)lines();
  log_.reset();
  EXPECT_THAT(lines(), ElementsAre("warning airworthy-x noise suppressed=2"));
}

TEST_F(LogTest, SilentLevelsAreNotCountedAsSuppressed) {
  open(LogLevel::kInfo);
  for (int i = 0; i < 100; ++i) log_->debug("noise");
  log_.reset();
  EXPECT_TRUE(lines().empty());
}

TEST_F(LogTest, GoesToStderr) {
  testing::internal::CaptureStderr();
  { Log{"airworthy-x", LogLevel::kInfo}.info("started", {{"version", "0.1"}}); }
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              testing::EndsWith("Z info airworthy-x started version=0.1\n"));
}

}  // namespace
}  // namespace airworthy::rt
