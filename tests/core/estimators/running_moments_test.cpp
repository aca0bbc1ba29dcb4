#include "core/estimators/running_moments.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace airworthy {
namespace {

TEST(RunningMoments, UnknownUntilTwoValues) {
  RunningMoments moments;
  EXPECT_TRUE(std::isnan(moments.variance()));
  moments.add(3.0);
  EXPECT_EQ(moments.mean(), 3.0);
  EXPECT_TRUE(std::isnan(moments.variance()));
  moments.add(5.0);
  EXPECT_EQ(moments.mean(), 4.0);
  EXPECT_EQ(moments.variance(), 2.0);
  EXPECT_EQ(moments.count(), 2);
}

// Σv² − N·mean² would have nothing left: the squares are 1e18, the variance is 1.
TEST(RunningMoments, EqualsTwoPassesFarFromZero) {
  std::mt19937 random{1};
  std::normal_distribution<double> normal{1e9, 1.0};
  RunningMoments moments;
  std::vector<double> values;
  for (int i = 0; i < 10'000; ++i) {
    values.push_back(normal(random));
    moments.add(values.back());
  }
  long double mean = 0;
  for (const double value : values) mean += value;
  mean /= 10'000;
  long double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  EXPECT_NEAR(moments.mean(), static_cast<double>(mean), 1e-6);
  EXPECT_NEAR(moments.variance(), static_cast<double>(squares / 9'999), 1e-6);
}

}  // namespace
}  // namespace airworthy
