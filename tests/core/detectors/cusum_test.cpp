#include "core/detectors/cusum.h"

#include <gtest/gtest.h>

namespace airworthy {
namespace {

constexpr CusumParams kParams{.threshold = 8.0, .ceiling_ratio = 2.0};

TEST(Cusum, FollowsTheRecursionByHand) {
  Cusum cusum{kParams};
  const double evidence[] = {-0.5, 1.0, 2.0, -1.5, 3.0, 1.0, -100.0};
  const double s[] = {0.0, 1.0, 3.0, 1.5, 4.5, 5.5, 0.0};  // max(0, s + g)
  for (int i = 0; i < 7; ++i) {
    cusum.step(evidence[i], from_us(i));
    EXPECT_DOUBLE_EQ(cusum.test_ratio(), s[i] / 8.0) << "step " << i;
  }
}

TEST(Cusum, OnsetIsTheFirstSampleOfTheRun) {
  Cusum cusum{kParams};
  cusum.step(2.0, from_us(1));
  cusum.step(-5.0, from_us(2));
  cusum.step(-1.0, from_us(3));
  cusum.step(2.0, from_us(4));
  cusum.step(2.0, from_us(5));
  EXPECT_EQ(to_us(cusum.onset()), 4);
}

TEST(Cusum, TheCeilingBoundsRecovery) {
  Cusum cusum{kParams};
  for (int i = 0; i < 1000; ++i) cusum.step(3.0, from_us(i));
  EXPECT_DOUBLE_EQ(cusum.test_ratio(), 2.0);
  int steps = 0;
  while (cusum.test_ratio() > 0) cusum.step(-1.0, from_us(1000 + ++steps));
  EXPECT_EQ(steps, 16);
}

}  // namespace
}  // namespace airworthy
