#include "core/detectors/fault_life_cycle.h"

#include <gtest/gtest.h>

#include <cmath>

namespace airworthy {
namespace {

using Transition = FaultLifeCycle::Transition;

TimePoint at(double seconds) { return from_us(1'000'000'000) + from_seconds(seconds); }

TEST(FaultLifeCycle, RaisesOnceAndClearsWithHysteresisInValueAndTime) {
  FaultLifeCycle life{{.clear_ratio = 0.1,
                       .clear_after = from_seconds(5),
                       .update_period = from_seconds(1000),
                       .latched = false}};
  EXPECT_EQ(life.step(0.99, at(0)), Transition::kNone);
  EXPECT_EQ(life.step(1.0, at(1)), Transition::kRaise);
  EXPECT_EQ(life.step(1.5, at(2)), Transition::kNone);
  EXPECT_EQ(life.step(0.5, at(3)), Transition::kNone);
  EXPECT_EQ(life.step(0.5, at(60)), Transition::kNone) << "between the two levels nothing changes";
  EXPECT_EQ(life.step(0.05, at(61)), Transition::kNone);
  EXPECT_EQ(life.step(0.2, at(65)), Transition::kNone) << "back above: the time starts again";
  EXPECT_EQ(life.step(0.05, at(66)), Transition::kNone);
  EXPECT_EQ(life.step(0.05, at(70.9)), Transition::kNone);
  EXPECT_EQ(life.step(0.05, at(71)), Transition::kClear);
  EXPECT_FALSE(life.active());
  EXPECT_EQ(life.step(1.0, at(72)), Transition::kRaise);
}

TEST(FaultLifeCycle, ALatchedFaultNeverClears) {
  FaultLifeCycle life{{.clear_ratio = 0.1,
                       .clear_after = from_seconds(5),
                       .update_period = from_seconds(1000),
                       .latched = true}};
  EXPECT_EQ(life.step(1.0, at(0)), Transition::kRaise);
  for (int i = 1; i < 900; ++i) EXPECT_EQ(life.step(0.0, at(i)), Transition::kNone);
  EXPECT_TRUE(life.active());
}

TEST(FaultLifeCycle, UpdatesAtItsPeriod) {
  FaultLifeCycle life{{.clear_ratio = 0.1,
                       .clear_after = from_seconds(5),
                       .update_period = from_seconds(1),
                       .latched = false}};
  EXPECT_EQ(life.step(1.0, at(0)), Transition::kRaise);
  EXPECT_EQ(life.step(1.0, at(0.5)), Transition::kNone);
  EXPECT_EQ(life.step(1.0, at(1.0)), Transition::kUpdate);
  EXPECT_EQ(life.step(1.0, at(1.5)), Transition::kNone);
}

TEST(FaultLifeCycle, AStampOfTheFutureDelaysNeitherUpdateNorClearing) {
  FaultLifeCycle life{{.clear_ratio = 0.1, .clear_after = from_seconds(5), .update_period = from_seconds(1)}};
  EXPECT_EQ(life.step(1.0, at(0)), Transition::kRaise);
  EXPECT_EQ(life.step(1.0, at(3600)), Transition::kUpdate);
  EXPECT_EQ(life.step(1.0, at(1)), Transition::kNone);
  EXPECT_EQ(life.step(1.0, at(2)), Transition::kUpdate);
  EXPECT_EQ(life.step(0.0, at(3600)), Transition::kUpdate);
  EXPECT_EQ(life.step(0.0, at(3)), Transition::kNone);
  EXPECT_EQ(life.step(0.0, at(8)), Transition::kClear);
}

TEST(FaultLifeCycle, NotANumberNeitherRaisesNorClears) {
  FaultLifeCycle life{{.clear_ratio = 0.1, .clear_after = from_seconds(1)}};
  EXPECT_EQ(life.step(std::nan(""), at(0)), Transition::kNone);
  EXPECT_FALSE(life.active());
  EXPECT_EQ(life.step(1.0, at(1)), Transition::kRaise);
  for (int i = 2; i < 10; ++i) EXPECT_NE(life.step(std::nan(""), at(i)), Transition::kClear);
  EXPECT_TRUE(life.active());
}

}  // namespace
}  // namespace airworthy
