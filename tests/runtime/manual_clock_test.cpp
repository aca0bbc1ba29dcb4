#include "runtime/clock/manual_clock.h"

#include <gtest/gtest.h>

#include <vector>

namespace airworthy::rt {
namespace {

TEST(ManualClock, FiresEveryTimerInOrderOfTime) {
  ManualClock clock{from_us(1'000'000)};
  std::vector<std::pair<char, std::int64_t>> fired;
  clock.every(Duration{200'000}, [&](TimePoint t) { fired.emplace_back('a', to_us(t)); });
  clock.every(Duration{300'000}, [&](TimePoint t) { fired.emplace_back('b', to_us(t)); });
  clock.advance_to(from_us(1'650'000));
  const std::vector<std::pair<char, std::int64_t>> expected{
      {'a', 1'200'000}, {'b', 1'300'000}, {'a', 1'400'000}, {'a', 1'600'000}, {'b', 1'600'000}};
  EXPECT_EQ(fired, expected);
  EXPECT_EQ(to_us(clock.now()), 1'650'000);
}

TEST(ManualClock, IgnoresAStepBack) {
  ManualClock clock{from_us(1'000'000)};
  clock.advance_to(from_us(500'000));
  EXPECT_EQ(to_us(clock.now()), 1'000'000);
}

TEST(ManualClock, FirstMoveFromZeroFiresNothing) {
  ManualClock clock;
  int fired = 0;
  clock.every(Duration{100'000}, [&](TimePoint) { ++fired; });
  clock.advance_to(from_us(5'000'000'000));
  EXPECT_EQ(fired, 0);
  clock.advance_to(from_us(5'000'100'000));
  EXPECT_EQ(fired, 1);
}

TEST(ManualClock, ACallbackMayAddATimer) {
  ManualClock clock{from_us(1)};
  int added_fired = 0;
  bool added = false;
  clock.every(Duration{10}, [&](TimePoint) {
    if (!added) clock.every(Duration{5}, [&](TimePoint) { ++added_fired; });
    added = true;
  });
  clock.advance_to(from_us(21));
  EXPECT_EQ(added_fired, 2);
}

}  // namespace
}  // namespace airworthy::rt
