#include "core/math/cholesky.h"

#include <gtest/gtest.h>

#include <random>

namespace airworthy {
namespace {

using Matrix = BoundedMatrix<double, 12>;

TEST(InvertPositiveDefinite, TimesTheMatrixIsTheIdentity) {
  std::mt19937 random{7};
  std::normal_distribution<double> normal;
  for (int n = 1; n <= 12; ++n) {
    Matrix factor(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) factor(i, j) = normal(random);
    }
    const Matrix a = factor * factor.transpose() + Matrix::Identity(n, n);
    Matrix inverse;
    ASSERT_TRUE((invert_positive_definite<double, 12>(a, inverse)));
    EXPECT_LT((a * inverse - Matrix::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-10) << "n " << n;
    EXPECT_EQ(inverse, inverse.transpose().eval());
  }
}

TEST(InvertPositiveDefinite, RefusesWhatIsNotPositiveDefinite) {
  Matrix inverse = Matrix::Constant(1, 1, 42.0);
  const Matrix before = inverse;
  Matrix a = Matrix::Identity(3, 3);
  a(2, 2) = -1;
  EXPECT_FALSE((invert_positive_definite<double, 12>(a, inverse)));
  a(2, 2) = 0;
  EXPECT_FALSE((invert_positive_definite<double, 12>(a, inverse)));
  a(2, 2) = std::nan("");
  EXPECT_FALSE((invert_positive_definite<double, 12>(a, inverse)));
  a(2, 2) = HUGE_VAL;
  EXPECT_FALSE((invert_positive_definite<double, 12>(a, inverse)));
  EXPECT_EQ(inverse, before);
}

}  // namespace
}  // namespace airworthy
