#include "core/detectors/cusum.h"

#include <gtest/gtest.h>

namespace airworthy {
namespace {

constexpr CusumParams kParams{
    .drift_sigmas = 1.0, .clip_sigmas = 4.0, .threshold = 8.0, .ceiling_ratio = 2.0};

TEST(Cusum, FollowsTheRecursionByHand) {
  Cusum cusum{kParams};
  const double z[] = {0.5, 2.0, 3.0, -0.5, 10.0, 2.0};
  const double s[] = {0.0, 1.0, 3.0, 1.5, 4.5, 5.5};  // max(0, s + clip(z, ±4) − 1)
  for (int i = 0; i < 6; ++i) {
    cusum.step(z[i], from_us(i));
    EXPECT_DOUBLE_EQ(cusum.test_ratio(), s[i] / 8.0) << "step " << i;
  }
}

TEST(Cusum, OnsetIsTheFirstSampleOfTheRun) {
  Cusum cusum{kParams};
  cusum.step(3.0, from_us(1));
  cusum.step(-4.0, from_us(2));
  cusum.step(0.0, from_us(3));
  cusum.step(3.0, from_us(4));
  cusum.step(3.0, from_us(5));
  EXPECT_EQ(to_us(cusum.onset()), 4);
}

TEST(Cusum, TheCeilingBoundsRecovery) {
  Cusum cusum{kParams};
  for (int i = 0; i < 1000; ++i) cusum.step(100.0, from_us(i));
  EXPECT_DOUBLE_EQ(cusum.test_ratio(), 2.0);
  int steps = 0;
  while (cusum.test_ratio() > 0) cusum.step(0.0, from_us(1000 + ++steps));
  EXPECT_EQ(steps, 16);
}

TEST(Cusum, ALargerShiftIsNeverFoundLater) {
  int last_delay = 1 << 20;
  for (const double shift : {1.5, 2.0, 3.0, 4.0, 8.0}) {
    Cusum cusum{kParams};
    int delay = 0;
    while (cusum.test_ratio() < 1.0) cusum.step(shift, from_us(++delay));
    EXPECT_LE(delay, last_delay);
    last_delay = delay;
  }
  EXPECT_EQ(last_delay, 3);  // 3 + 3 + 3 ≥ 8
}

}  // namespace
}  // namespace airworthy
