#include "cli/calibrate/median.h"

#include <gtest/gtest.h>

namespace airworthy::calibrate {
namespace {

TEST(Median, IsTheMiddleOrTheMeanOfTheMiddleTwo) {
  EXPECT_EQ(median({3.0}), 3.0);
  EXPECT_EQ(median({5.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(median({4.0, 1.0}), 2.5);
  EXPECT_EQ(median({9.0, 1.0, 4.0, 2.0}), 3.0);
}

}  // namespace
}  // namespace airworthy::calibrate
