#include "gateway/event_memory.h"

#include <gtest/gtest.h>

namespace airworthy::gateway {
namespace {

health::FaultReport event(std::int64_t number) {
  health::FaultReport event;
  event.origin.producer = "p";
  event.origin.session = 1;
  event.number = number;
  return event;
}

TEST(EventMemory, EachPartOfTheIdentityCounts) {
  EventMemory memory;
  EXPECT_TRUE(memory.insert(event(1)));
  EXPECT_FALSE(memory.insert(event(1)));
  EXPECT_TRUE(memory.insert(event(2)));
  health::FaultReport other = event(1);
  other.origin.producer = "q";
  EXPECT_TRUE(memory.insert(other));
  other = event(1);
  other.origin.session = 2;
  EXPECT_TRUE(memory.insert(other));
  other = event(1);
  other.origin.seq = 1;
  EXPECT_TRUE(memory.insert(other));
  other = event(1);
  other.phase = health::FaultPhase::kClear;
  EXPECT_TRUE(memory.insert(other));
  EXPECT_FALSE(memory.insert(other));
}

TEST(EventMemory, ForgetsTheOldestBeyondItsCapacity) {
  EventMemory memory;
  const auto capacity = static_cast<std::int64_t>(EventMemory::kCapacity);
  for (std::int64_t i = 0; i < capacity; ++i) ASSERT_TRUE(memory.insert(event(i)));
  EXPECT_FALSE(memory.insert(event(0)));
  EXPECT_TRUE(memory.insert(event(capacity)));
  EXPECT_TRUE(memory.insert(event(0)));
  EXPECT_FALSE(memory.insert(event(2)));
}

}  // namespace
}  // namespace airworthy::gateway
