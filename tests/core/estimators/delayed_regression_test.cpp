#include "core/estimators/delayed_regression.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "tests/support/allocation_guard.h"

namespace airworthy {
namespace {

using Regression = DelayedRegression<double, 4, 64>;
using Vector = Regression::Vector;

class DelayedRegressionTest : public ::testing::Test {
 protected:
  static constexpr double kNoise = 0.3;

  // y = 2·x0 − 1·x1 + 0.5 + noise
  void feed(int ticks, double offset = 0.0) {
    for (int i = 0; i < ticks; ++i) {
      Vector x(3);
      x << normal_(random_), normal_(random_), 1.0;
      status_ =
          regression_.update(x, 2 * x(0) - x(1) + 0.5 + kNoise * normal_(random_) + offset, prediction_);
    }
  }

  static DelayedRegressionParams params() {
    DelayedRegressionParams params;
    params.terms = 3;
    return params;
  }

  std::mt19937 random_{11};
  std::normal_distribution<double> normal_;
  Regression regression_{params()};
  Regression::Prediction prediction_;
  UpdateStatus status_ = UpdateStatus::kConverging;
};

TEST_F(DelayedRegressionTest, FindsTheCoefficientsAndTheScale) {
  feed(4000);
  EXPECT_EQ(status_, UpdateStatus::kFused);
  // Standard error of each coefficient is 0.3/sqrt(4000) = 0.005.
  EXPECT_NEAR(regression_.theta()(0), 2.0, 0.02);
  EXPECT_NEAR(regression_.theta()(1), -1.0, 0.02);
  EXPECT_NEAR(regression_.theta()(2), 0.5, 0.02);
  EXPECT_NEAR(regression_.sigma(), kNoise, 0.06);
}

TEST_F(DelayedRegressionTest, MatchesOrdinaryLeastSquaresWithoutWeightsAndRidge) {
  DelayedRegressionParams plain = params();
  plain.ridge = 0.0;
  plain.huber_sigmas = 1e9;
  Regression regression{plain};
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  const int ticks = 500;
  for (int i = 0; i < ticks; ++i) {
    Vector x(3);
    x << normal_(random_), normal_(random_), 1.0;
    const double y = normal_(random_);
    (void)regression.update(x, y, prediction_);
    if (i < ticks - plain.delay_ticks) {  // learned D ticks late
      const Eigen::Vector3d x3 = x;
      a += x3 * x3.transpose();
      b += y * x3;
    }
  }
  const Eigen::Vector3d expected = a.inverse() * b;
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(regression.theta()(i), expected(i), 1e-9);
}

TEST_F(DelayedRegressionTest, DoesNotAbsorbAFaultWithinTheDelay) {
  feed(1000);
  const Vector before = regression_.theta();
  feed(params().delay_ticks - params().refit_ticks, -5.0);
  EXPECT_LT((regression_.theta() - before).norm(), 0.05);
  EXPECT_LT(prediction_.innovation, -5.0 + 5 * kNoise);
}

TEST_F(DelayedRegressionTest, OutliersBarelyMoveIt) {
  for (int i = 0; i < 3000; ++i) feed(1, i % 20 == 0 && i > 200 ? 50.0 : 0.0);
  EXPECT_NEAR(regression_.theta()(2), 0.5, 0.1);  // the mean of the outliers alone is 2.5
}

TEST_F(DelayedRegressionTest, WidensWhereItHasNotBeen) {
  feed(1000);
  Vector x(3);
  x << 0.0, 0.0, 1.0;
  (void)regression_.predict(x, 0.5, prediction_);
  const double near = prediction_.sigma;
  x << 100.0, 0.0, 1.0;
  (void)regression_.predict(x, 200.5, prediction_);
  EXPECT_GT(prediction_.sigma, 5 * near);
}

TEST_F(DelayedRegressionTest, NotANumberChangesNothing) {
  feed(500);
  Regression twin = regression_;
  Vector x(3);
  x << std::nan(""), 0.0, 1.0;
  EXPECT_EQ(regression_.update(x, 1.0, prediction_), UpdateStatus::kNotFinite);
  x(0) = 0.0;
  EXPECT_EQ(regression_.update(x, HUGE_VAL, prediction_), UpdateStatus::kNotFinite);
  Regression::Prediction of_twin;
  for (int i = 0; i < 100; ++i) {
    x << normal_(random_), normal_(random_), 1.0;
    const double y = normal_(random_);
    (void)regression_.update(x, y, prediction_);
    (void)twin.update(x, y, of_twin);
    ASSERT_EQ(prediction_.innovation, of_twin.innovation);
    ASSERT_EQ(prediction_.sigma, of_twin.sigma);
  }
}

TEST_F(DelayedRegressionTest, WithoutExcitationItStaysFinite) {
  Vector x = Vector::Zero(3);
  for (int i = 0; i < 100'000; ++i) (void)regression_.update(x, 0.0, prediction_);
  EXPECT_TRUE(regression_.theta().allFinite());
  EXPECT_TRUE(std::isfinite(prediction_.sigma));
  EXPECT_GT(regression_.sigma(), 0.0);
}

TEST_F(DelayedRegressionTest, UsesNoHeap) {
  feed(200);
  const test::AllocationGuard guard;
  feed(200);
  EXPECT_EQ(guard.allocations(), 0U);
}

TEST_F(DelayedRegressionTest, AWarmStartPredictsAtOnceAndGivesWayToTheFlight) {
  Vector theta(3);
  theta << 2.0, -1.0, 3.5;  // the constant of this flight is 0.5
  ASSERT_TRUE(regression_.warm_start(theta, Regression::Matrix::Identity(3, 3), kNoise, 300));
  Vector x(3);
  x << 1.0, 1.0, 1.0;
  EXPECT_EQ(regression_.update(x, 4.5, prediction_), UpdateStatus::kFused);
  EXPECT_NEAR(prediction_.expected, 4.5, 0.01);
  EXPECT_GT(prediction_.sigma, kNoise);
  EXPECT_LT(prediction_.sigma, 1.2 * kNoise);
  feed(300);  // as many samples as the prior is worth: half way
  EXPECT_NEAR(regression_.theta()(2), 2.0, 0.5);
  feed(20000);
  EXPECT_NEAR(regression_.theta()(2), 0.5, 0.1);
}

TEST_F(DelayedRegressionTest, AWarmStartOnNoPriorIsRefused) {
  Vector theta(3);
  theta << 2.0, -1.0, 0.5;
  const Regression::Matrix identity = Regression::Matrix::Identity(3, 3);
  Regression::Matrix singular = identity;
  singular(1, 1) = 0;
  Regression::Matrix unknown = identity;
  unknown(2, 1) = std::nan("");
  EXPECT_FALSE(regression_.warm_start(theta, singular, kNoise, 300));
  EXPECT_FALSE(regression_.warm_start(theta, unknown, kNoise, 300));
  EXPECT_FALSE(regression_.warm_start(theta, identity, 0.0, 300));
  EXPECT_FALSE(regression_.warm_start(theta, identity, kNoise, 8));
  EXPECT_FALSE(regression_.warm_start(theta.head(2), identity, kNoise, 300));
  EXPECT_EQ(regression_.learned(), 0);
  EXPECT_EQ(regression_.sigma(), 0.0);
}

}  // namespace
}  // namespace airworthy
