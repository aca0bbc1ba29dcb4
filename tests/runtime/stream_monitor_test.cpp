#include "runtime/bus/stream_monitor.h"

#include <gtest/gtest.h>

namespace airworthy::rt {
namespace {

constexpr std::int64_t kPeriod_us = 10'000;

StreamMonitor::Header header(std::int64_t seq, std::int64_t session = 1) {
  const TimePoint time = from_us(1'000'000'000 + seq * kPeriod_us);
  return {time, time + Duration{500}, seq, session};
}

StreamMonitor after_messages(int count) {
  StreamMonitor monitor;
  for (int seq = 0; seq < count; ++seq) EXPECT_EQ(monitor.judge(header(seq)), Arrival::kAccepted);
  return monitor;
}

TEST(StreamMonitor, CountsWhatIsMissing) {
  StreamMonitor monitor = after_messages(3);
  EXPECT_EQ(monitor.judge(header(7)), Arrival::kAccepted);
  EXPECT_EQ(monitor.lost(), 4);
}

TEST(StreamMonitor, JoiningLateIsNotLoss) {
  StreamMonitor monitor;
  EXPECT_EQ(monitor.judge(header(5000)), Arrival::kAccepted);
  EXPECT_EQ(monitor.lost(), 0);
}

TEST(StreamMonitor, RefusesADuplicate) {
  StreamMonitor monitor = after_messages(3);
  EXPECT_EQ(monitor.judge(header(2)), Arrival::kDuplicate);
  EXPECT_EQ(monitor.judge(header(3)), Arrival::kAccepted);
  EXPECT_EQ(monitor.lost(), 0);
}

TEST(StreamMonitor, RefusesAnOlderMessage) {
  StreamMonitor monitor = after_messages(5);
  EXPECT_EQ(monitor.judge(header(2)), Arrival::kOutOfOrder);
  EXPECT_EQ(monitor.judge(header(5)), Arrival::kAccepted);
}

TEST(StreamMonitor, RefusesANewMessageWithAnOlderMeasurement) {
  StreamMonitor monitor = after_messages(5);
  StreamMonitor::Header late = header(5);
  late.time -= Duration{3 * kPeriod_us};
  EXPECT_EQ(monitor.judge(late), Arrival::kTimeBackward);
  EXPECT_EQ(monitor.judge(header(6)), Arrival::kAccepted);
  EXPECT_EQ(monitor.lost(), 0) << "it arrived: refused, not lost";
}

TEST(StreamMonitor, RefusesATimeAheadOfItsStream) {
  StreamMonitor monitor = after_messages(5);
  StreamMonitor::Header ahead = header(5);
  ahead.time += Duration{60'000'000};
  EXPECT_EQ(monitor.judge(ahead), Arrival::kAheadOfStream);
  EXPECT_EQ(monitor.judge(header(6)), Arrival::kAccepted);
}

TEST(StreamMonitor, ASilenceIsNotALeap) {
  StreamMonitor monitor = after_messages(5);
  StreamMonitor::Header later = header(5);
  later.time += Duration{60'000'000};
  later.sent += Duration{60'000'000};
  EXPECT_EQ(monitor.judge(later), Arrival::kAccepted);
}

TEST(StreamMonitor, BelievesAClockThatStaysAhead) {
  StreamMonitor monitor = after_messages(5);
  for (int i = 0; i < 2 * StreamMonitor::kResynchronise; ++i) {
    StreamMonitor::Header ahead = header(5 + i);
    ahead.time += Duration{60'000'000};
    EXPECT_EQ(monitor.judge(ahead),
              i + 1 < StreamMonitor::kResynchronise ? Arrival::kAheadOfStream : Arrival::kAccepted);
  }
  EXPECT_EQ(monitor.resynchronised(), 1);
  EXPECT_EQ(monitor.lost(), 0);
}

TEST(StreamMonitor, ARestartIsNotLoss) {
  StreamMonitor monitor = after_messages(50);
  StreamMonitor::Header restarted = header(0, 2);
  restarted.time += Duration{10'000'000};
  restarted.sent += Duration{10'000'000};
  EXPECT_EQ(monitor.judge(restarted), Arrival::kAccepted);
  EXPECT_EQ(monitor.restarts(), 1);
  EXPECT_EQ(monitor.lost(), 0);
}

TEST(StreamMonitor, AStragglerOfTheOldSessionIsRefused) {
  StreamMonitor monitor = after_messages(50);
  StreamMonitor::Header restarted = header(0, 2);
  restarted.time += Duration{10'000'000};
  restarted.sent += Duration{10'000'000};
  ASSERT_EQ(monitor.judge(restarted), Arrival::kAccepted);
  EXPECT_EQ(monitor.judge(header(50, 1)), Arrival::kOutOfOrder);
}

TEST(StreamMonitor, RefusesNegativeNumbersAndTimes) {
  StreamMonitor monitor = after_messages(1);
  EXPECT_EQ(monitor.judge({from_us(-1), from_us(1), 1, 1}), Arrival::kBadHeader);
  EXPECT_EQ(monitor.judge({from_us(1), from_us(-1), 1, 1}), Arrival::kBadHeader);
  EXPECT_EQ(monitor.judge({from_us(1), from_us(1), -1, 1}), Arrival::kBadHeader);
  EXPECT_EQ(monitor.judge({from_us(1), from_us(1), 1, -1}), Arrival::kBadHeader);
}

}  // namespace
}  // namespace airworthy::rt
