#include "cli/calibrate/tail.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace airworthy::calibrate {
namespace {

TEST(Tail, OfAnExponentialIsFoundAndExtrapolated) {
  // P(M > h) = exp(−h/2): the level exceeded once in 10 h of 180 blocks is 2·ln(1800) = 14.99.
  std::mt19937 random{3};
  std::exponential_distribution<double> exponential{0.5};
  std::vector<double> maxima(20000);
  for (double& maximum : maxima) maximum = exponential(random);
  const Tail tail = fit_tail(maxima);
  EXPECT_NEAR(tail.scale, 2.0, 0.1);
  EXPECT_NEAR(tail.start, 2.0 * std::log(5.0), 0.1);
  EXPECT_NEAR(tail.threshold(0.1), 2.0 * std::log(1800.0), 0.6);
}

TEST(Tail, ARarerAlarmNeedsAHigherThreshold) {
  std::vector<double> maxima;
  for (int i = 0; i < 50; ++i) maxima.push_back(0.1 * i);
  const Tail tail = fit_tail(maxima);
  EXPECT_GT(tail.threshold(0.001), tail.threshold(0.01));
  // Never the observed maximum: one in 100 h lies well beyond what 50 blocks have shown.
  EXPECT_GT(tail.threshold(0.01), 1.5 * 4.9);
}

TEST(Tail, OfTooFewBlocksIsNone) {
  const Tail tail = fit_tail(std::vector<double>(Tail::kFewestBlocks - 1, 1.0));
  EXPECT_EQ(tail.blocks, Tail::kFewestBlocks - 1);
  EXPECT_EQ(tail.scale, 0.0);
}

}  // namespace
}  // namespace airworthy::calibrate
