#include "core/time/stamp_gate.h"

#include <gtest/gtest.h>

#include <array>

namespace airworthy {
namespace {

using Stamp = StampGate::Stamp;

TimePoint at(double s) { return from_us(1'000'000'000) + from_seconds(s); }

/// A gate that has seen 100 samples a second up to second 10.
StampGate flown() {
  StampGate gate;
  for (int i = 0; i <= 1000; ++i) EXPECT_EQ(gate.judge(at(0.01 * i)), Stamp::kNewer);
  return gate;
}

TEST(StampGate, TakesWhatIsNewerHoweverFarAhead) {
  StampGate gate;
  EXPECT_FALSE(gate.newest());
  EXPECT_EQ(gate.judge(at(0)), Stamp::kNewer);
  EXPECT_EQ(gate.judge(at(1e-6)), Stamp::kNewer);
  EXPECT_EQ(gate.judge(at(3600)), Stamp::kNewer);
  EXPECT_EQ(gate.newest(), at(3600));
}

TEST(StampGate, RefusesDuplicatesAndReorderedSamplesForEver) {
  StampGate gate = flown();
  for (int i = 1; i < 1000; ++i) {
    const double s = 10.0 + 0.02 * i;
    EXPECT_EQ(gate.judge(at(s + 0.01)), Stamp::kNewer);
    EXPECT_EQ(gate.judge(at(s)), Stamp::kOlder);
    EXPECT_EQ(gate.judge(at(s + 0.01)), Stamp::kSame);
    EXPECT_EQ(gate.judge(at(s - 2.0)), Stamp::kOlder);  // in order among themselves, but not in a row
  }
  EXPECT_EQ(gate.restarts(), 0);
}

TEST(StampGate, RefusesALateRunThatIsNotFarBehind) {
  StampGate gate = flown();
  for (int i = 0; i < 49; ++i) EXPECT_EQ(gate.judge(at(9.51 + 0.01 * i)), Stamp::kOlder);
  EXPECT_EQ(gate.judge(at(10.0)), Stamp::kSame);
  EXPECT_EQ(gate.judge(at(10.01)), Stamp::kNewer);
}

TEST(StampGate, TakesUpAgainFromTheTenthSampleBeforeAStampOfTheFuture) {
  for (const double ahead_s : {0.7, 3600.0, 1e9}) {
    StampGate gate = flown();
    ASSERT_EQ(gate.judge(at(10.0 + ahead_s)), Stamp::kNewer);
    for (int i = 1; i < StampGate::kRun; ++i) EXPECT_EQ(gate.judge(at(10.0 + 0.01 * i)), Stamp::kOlder) << i;
    EXPECT_EQ(gate.judge(at(10.1)), Stamp::kRestart);
    EXPECT_EQ(gate.newest(), at(10.1));
    EXPECT_EQ(gate.restarts(), 1);
    EXPECT_EQ(gate.judge(at(10.11)), Stamp::kNewer);
    EXPECT_EQ(gate.judge(at(10.10)), Stamp::kOlder);
  }
}

TEST(StampGate, OfSeveralStampsOfTheFutureEachIsForgotten) {
  StampGate gate = flown();
  (void)gate.judge(at(7200));
  (void)gate.judge(at(3600));
  int refused = 0;
  while (gate.judge(at(10.01 + 0.01 * refused)) == Stamp::kOlder) ++refused;
  EXPECT_EQ(refused, StampGate::kRun - 1);
}

TEST(StampGate, DuplicatesAndReorderingWithinTheRunNeitherCountNorBreakIt) {
  StampGate gate = flown();
  (void)gate.judge(at(3600));
  constexpr std::array kOrder{1, 1, 3, 2, 4, 4, 6, 5, 8, 7, 9, 10, 10, 11, 12};  // nine of them newer
  int taken = 0;
  for (const int i : kOrder) taken += gate.judge(at(10.0 + 0.01 * i)) == Stamp::kRestart ? i : 0;
  EXPECT_EQ(taken, 0);
  EXPECT_EQ(gate.judge(at(10.13)), Stamp::kRestart);
}

TEST(StampGate, AShiftOfTimeChangesNothing) {
  StampGate early;
  StampGate late;
  const Duration shift = std::chrono::hours{24 * 365};
  for (int i = 0; i < 500; ++i) {
    const TimePoint time = at(0.01 * (i % 37 == 0 ? 1000 * i : i));
    EXPECT_EQ(early.judge(time), late.judge(time + shift));
  }
}

}  // namespace
}  // namespace airworthy
