#include "core/estimators/factorised_rls.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/allocation_guard.h"

namespace airworthy {
namespace {

using LongMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using LongVector = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

constexpr int kMost = 8;
using Rls = FactorisedRls<double, kMost>;
using RlsFloat = FactorisedRls<float, kMost>;
using Vector = Rls::Vector;

struct Sample {
  Eigen::VectorXd x;
  double y = 0;
};

/// The same cost minimised at once: rows √w·x, among them the prior and what (4) recalls of it, solved by
/// Householder QR in long double. Its error is about the condition number of the rows times 1e-19.
class Batch {
 public:
  Batch(int terms, double prior_variance, double forgetting)
      : terms_{terms}, prior_variance_{prior_variance}, forgetting_{forgetting} {
    for (int i = 0; i < terms; ++i) add(LongVector::Unit(terms, i), 0.0L, 1.0L / prior_variance_);
  }

  void learn(const Sample& sample) {
    for (long double& weight : weights_) weight *= forgetting_;
    add(sample.x.cast<long double>(), sample.y, 1.0L);
    if (forgetting_ < 1.0L) {
      const long double recalled = (1.0L - std::pow(forgetting_, static_cast<long double>(terms_)));
      add(LongVector::Unit(terms_, next_), 0.0L, recalled / prior_variance_);
      next_ = (next_ + 1) % terms_;
    }
  }

  [[nodiscard]] LongVector theta() const {
    LongMatrix rows(static_cast<Eigen::Index>(xs_.size()), terms_);
    LongVector ys(rows.rows());
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      rows.row(i) = std::sqrt(weights_[at]) * xs_[at].transpose();
      ys(i) = std::sqrt(weights_[at]) * ys_[at];
    }
    return rows.householderQr().solve(ys);
  }

  /// P = (Σ w·x·xᵀ)⁻¹.
  [[nodiscard]] LongMatrix covariance() const {
    LongMatrix a = LongMatrix::Zero(terms_, terms_);
    for (std::size_t i = 0; i < xs_.size(); ++i) a += weights_[i] * xs_[i] * xs_[i].transpose();
    return a.inverse();
  }

 private:
  void add(const LongVector& x, long double y, long double weight) {
    xs_.push_back(x);
    ys_.push_back(y);
    weights_.push_back(weight);
  }

  int terms_;
  long double prior_variance_;
  long double forgetting_;
  int next_ = 0;
  std::vector<LongVector> xs_;
  std::vector<long double> ys_;
  std::vector<long double> weights_;
};

/// Recursive least squares as textbooks print it.
struct DenseRls {
  DenseRls(int terms, double prior_variance, double lambda)
      : forgetting{lambda},
        theta{Eigen::VectorXd::Zero(terms)},
        p{prior_variance * Eigen::MatrixXd::Identity(terms, terms)} {}

  void learn(const Sample& sample) {
    const Eigen::VectorXd k = p * sample.x / (forgetting + sample.x.dot(p * sample.x));
    theta += k * (sample.y - sample.x.dot(theta));
    p = (p - k * sample.x.transpose() * p) / forgetting;
  }

  [[nodiscard]] bool positive_definite() const {
    return p.allFinite() && Eigen::LLT<Eigen::MatrixXd>{p}.info() == Eigen::Success;
  }

  double forgetting;
  Eigen::VectorXd theta;
  Eigen::MatrixXd p;
};

template <class Estimator>
UpdateStatus learn(Estimator& rls, const Sample& sample, typename Estimator::Innovation* out = nullptr) {
  using Scalar = std::decay_t<decltype(out->innovation)>;
  typename Estimator::Innovation innovation;
  const typename Estimator::Vector x = sample.x.cast<Scalar>();
  const UpdateStatus status = rls.update(x, static_cast<Scalar>(sample.y), innovation);
  if (out != nullptr) *out = innovation;
  return status;
}

template <class Estimator>
LongMatrix covariance_of(const Estimator& rls) {
  const auto n = static_cast<int>(rls.theta().size());
  LongMatrix u(n, n);
  LongMatrix d = LongMatrix::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) u(i, j) = static_cast<long double>(rls.factor(i, j));
    d(i, i) = static_cast<long double>(rls.diagonal(i));
  }
  return u * d * u.transpose();
}

// By the definition: U is unit triangular by construction, so D alone decides, and every entry must be a
// number.
template <class Estimator>
bool positive_definite(const Estimator& rls) {
  const auto n = static_cast<int>(rls.theta().size());
  bool good = rls.theta().allFinite();
  for (int j = 0; j < n; ++j) {
    good = good && std::isnormal(rls.diagonal(j)) && rls.diagonal(j) > 0;
    for (int i = 0; i < j; ++i) good = good && std::isfinite(rls.factor(i, j));
  }
  return good;
}

double relative_error(const Eigen::VectorXd& theta, const LongVector& expected) {
  return static_cast<double>((theta.cast<long double>() - expected).norm() / expected.norm());
}

class Source {
 public:
  explicit Source(unsigned seed) : random_{seed} {}

  double normal() { return normal_(random_); }

  Sample gaussian(const Eigen::VectorXd& theta, double noise) {
    Sample sample{Eigen::VectorXd(theta.size()), 0};
    for (Eigen::Index i = 0; i < theta.size(); ++i) sample.x(i) = normal();
    sample.y = sample.x.dot(theta) + noise * normal();
    return sample;
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

const Eigen::VectorXd kTruth = (Eigen::VectorXd(5) << 1.5, -0.7, 0.2, 3.0, -2.0).finished();

TEST(FactorisedRls, EqualsBatchLeastSquares) {
  for (const double forgetting : {1.0, 0.99, 0.9}) {
    Source source{1};
    Rls rls{{.terms = 5, .prior_variance = 1e4, .forgetting = forgetting, .excitation_floor = 0.0}};
    Batch batch{5, 1e4, forgetting};
    for (int i = 0; i < 400; ++i) {
      const Sample sample = source.gaussian(kTruth, 0.3);
      ASSERT_EQ(learn(rls, sample), UpdateStatus::kFused);
      batch.learn(sample);
    }
    EXPECT_LT(relative_error(rls.theta(), batch.theta()), 1e-12) << forgetting;
    const LongMatrix expected = batch.covariance();
    EXPECT_LT((covariance_of(rls) - expected).norm() / expected.norm(), 1e-12L) << forgetting;
    EXPECT_NEAR(rls.covariance(1, 3), static_cast<double>(expected(1, 3)), 1e-12);
  }
}

TEST(FactorisedRls, EqualsTheTextbookWhereThatBehaves) {
  Source source{2};
  Rls rls{{.terms = 5, .prior_variance = 1e4}};
  DenseRls dense{5, 1e4, 1.0};
  for (int i = 0; i < 2000; ++i) {
    const Sample sample = source.gaussian(kTruth, 0.3);
    ASSERT_EQ(learn(rls, sample), UpdateStatus::kFused);
    dense.learn(sample);
    ASSERT_LT((rls.theta() - dense.theta).norm(), 1e-9) << i;
  }
  EXPECT_LT((covariance_of(rls).cast<double>() - dense.p).norm() / dense.p.norm(), 1e-9);
}

// With forgetting the two differ by what (4) recalls of the prior: it keeps an information of 1/p₀ = 1e-4
// about each coefficient beside the 1/(1 − λ) = 100 of the samples, and so pulls each to 0 by one part in
// 1e6.
TEST(FactorisedRls, ForgettingDiffersFromTheTextbookByTheWeightOfThePriorAlone) {
  Source source{3};
  Rls rls{{.terms = 5, .prior_variance = 1e4, .forgetting = 0.99, .excitation_floor = 0.0}};
  DenseRls dense{5, 1e4, 0.99};
  for (int i = 0; i < 5000; ++i) {
    const Sample sample = source.gaussian(kTruth, 0.3);
    learn(rls, sample);
    dense.learn(sample);
  }
  EXPECT_NEAR((rls.theta() - dense.theta).norm(), 1e-6 * kTruth.norm(), 0.3e-6 * kTruth.norm());
}

TEST(FactorisedRls, PublishesTheInnovationAndItsVariance) {
  Source source{4};
  Rls rls{{.terms = 5, .prior_variance = 100.0}};
  for (int i = 0; i < 10; ++i) learn(rls, source.gaussian(kTruth, 0.3));
  const Sample sample = source.gaussian(kTruth, 0.3);
  const double expected = sample.x.dot(rls.theta());
  const Eigen::VectorXd before = rls.theta();
  const LongVector x = sample.x.cast<long double>();
  const auto information = static_cast<double>(x.dot(covariance_of(rls) * x));
  Rls::Innovation predicted;
  ASSERT_EQ(rls.predict(sample.x, sample.y, predicted), UpdateStatus::kFused);
  EXPECT_EQ(before, rls.theta());
  Rls::Innovation innovation;
  ASSERT_EQ(learn(rls, sample, &innovation), UpdateStatus::kFused);
  EXPECT_NEAR(innovation.expected, expected, 1e-14);
  EXPECT_NEAR(innovation.innovation, sample.y - expected, 1e-14);
  EXPECT_NEAR(innovation.variance_ratio, 1.0 + information, 1e-12);
  EXPECT_NEAR(innovation.largest_change, (rls.theta() - before).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_EQ(predicted.innovation, innovation.innovation);
  EXPECT_EQ(predicted.variance_ratio, innovation.variance_ratio);
}

TEST(FactorisedRls, FindsTheNoiseAndItsInnovationsAreConsistent) {
  Source source{5};
  Rls rls{{.terms = 5, .prior_variance = 1e4}};
  EXPECT_TRUE(std::isnan(rls.noise_variance()));
  double sum = 0;
  const int samples = 20'000;
  for (int i = 0; i < samples; ++i) {
    Rls::Innovation innovation;
    learn(rls, source.gaussian(kTruth, 0.3), &innovation);
    if (i >= 5) sum += innovation.innovation * innovation.innovation / innovation.variance_ratio / 0.09;
  }
  // The mean of 20 000 squares of unit normals: 1 ± 4·sqrt(2/20 000).
  EXPECT_NEAR(sum / samples, 1.0, 0.04);
  EXPECT_NEAR(rls.noise_variance(), 0.09, 0.09 * 0.04);
}

// Two columns that differ by 1e-8 of their size. The solution moves by the condition number times the
// rounding of the factors; the rows have condition 1e8 to 1e9, and 1e9·2e-16 = 2e-7.
TEST(FactorisedRls, IllConditionedRegressors) {
  const Eigen::VectorXd truth = (Eigen::VectorXd(3) << 1.0, 2.0, -1.0).finished();
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Source source{seed};
    Rls rls{{.terms = 3, .prior_variance = 1e20}};
    Batch batch{3, 1e20, 1.0};
    for (int i = 0; i < 1000; ++i) {
      Sample sample = source.gaussian(truth, 0.0);
      sample.x(1) = sample.x(0) + 1e-8 * sample.x(1);
      sample.y = sample.x.dot(truth) + 1e-9 * source.normal();
      ASSERT_EQ(learn(rls, sample), UpdateStatus::kFused);
      batch.learn(sample);
    }
    EXPECT_LT(relative_error(rls.theta(), batch.theta()), 1e-6) << "seed " << seed;
    EXPECT_TRUE(positive_definite(rls));
  }
}

// The classic of the subject: rows that only the small part tells apart (Hilbert matrix, condition 1.5e10 at
// n = 8).
TEST(FactorisedRls, HilbertMatrix) {
  constexpr int kTerms = 8;
  Rls rls{{.terms = kTerms, .prior_variance = 1e30}};
  Batch batch{kTerms, 1e30, 1.0};
  for (int i = 0; i < kTerms; ++i) {
    Sample sample{Eigen::VectorXd(kTerms), 0};
    for (int j = 0; j < kTerms; ++j) sample.x(j) = 1.0 / (i + j + 1);
    sample.y = sample.x.sum();
    ASSERT_EQ(learn(rls, sample), UpdateStatus::kFused);
    batch.learn(sample);
  }
  EXPECT_LT(relative_error(rls.theta(), batch.theta()), 1e-4);
  EXPECT_TRUE(positive_definite(rls));
}

TEST(FactorisedRls, ScalesFromHugeToTiny) {
  for (const double scale : {1e-8, 1.0, 1e8}) {
    for (const double other : {1e-8, 1.0, 1e8}) {
      Source source{6};
      Eigen::VectorXd truth(3);
      truth << 2.0 / scale, -1.0 / other, 0.5;
      Rls rls{{.terms = 3, .prior_variance = 1e24}};
      Batch batch{3, 1e24, 1.0};
      for (int i = 0; i < 500; ++i) {
        Sample sample{Eigen::VectorXd(3), 0};
        sample.x << scale * source.normal(), other * source.normal(), 1.0;
        sample.y = sample.x.dot(truth) + 0.1 * source.normal();
        ASSERT_EQ(learn(rls, sample), UpdateStatus::kFused);
        batch.learn(sample);
      }
      // Each coefficient in its own unit: the rows' condition of 1e16 is one of scale, which costs nothing
      // here.
      const LongVector expected = batch.theta();
      for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(rls.theta()(i) / static_cast<double>(expected(i)), 1.0, 1e-9) << scale << ' ' << other;
      }
    }
  }
}

TEST(FactorisedRls, WithoutExcitationNothingIsLearnedAndNothingForgotten) {
  Source source{7};
  Rls rls{{.terms = 5, .prior_variance = 1e4, .forgetting = 0.95}};
  for (int i = 0; i < 200; ++i) learn(rls, source.gaussian(kTruth, 0.1));
  const Rls before = rls;
  for (int i = 0; i < 100'000; ++i) {
    ASSERT_EQ(learn(rls, {Eigen::VectorXd::Zero(5), 3.0}), UpdateStatus::kNotExcited);
  }
  EXPECT_EQ(rls.unexcited() - before.unexcited(), 100'000);
  EXPECT_EQ(rls.theta(), before.theta());
  EXPECT_EQ(covariance_of(rls), covariance_of(before));
}

// Only the sum of the coefficients shows; the prior chooses among them, as in the batch.
TEST(FactorisedRls, ConstantRegressorsFollowThePrior) {
  for (const double forgetting : {1.0, 0.98}) {
    Source source{8};
    Rls rls{{.terms = 4, .prior_variance = 100.0, .forgetting = forgetting, .excitation_floor = 0.0}};
    Batch batch{4, 100.0, forgetting};
    for (int i = 0; i < 2000; ++i) {
      const Sample sample{Eigen::VectorXd::Ones(4), 4.0 + 0.1 * source.normal()};
      learn(rls, sample);
      batch.learn(sample);
    }
    EXPECT_LT(relative_error(rls.theta(), batch.theta()), 1e-10) << forgetting;
    EXPECT_TRUE(positive_definite(rls));
  }
}

TEST(FactorisedRls, ForgettingNeverLeavesACoefficientLessCertainThanThePrior) {
  constexpr double kPrior = 1e4;
  constexpr double kForgetting = 0.98;
  Source source{9};
  Rls rls{{.terms = 4, .prior_variance = kPrior, .forgetting = kForgetting, .excitation_floor = 0.0}};
  Sample sample{Eigen::VectorXd(4), 0};
  double largest = 0;
  for (int i = 0; i < 50'000; ++i) {
    sample.x << source.normal(), 1.0, 0.0, 2.0;
    sample.y = sample.x(0) + 1.0;
    learn(rls, sample);
    for (int j = 0; j < 4; ++j) largest = std::max(largest, rls.covariance(j, j));
  }
  EXPECT_LE(largest, kPrior * std::pow(kForgetting, -4) * (1 + 1e-9));
  EXPECT_GT(largest, 0.5 * kPrior);  // and it does forget
}

TEST(FactorisedRls, TheGateHasALimitThatNoSampleMayCross) {
  Source source{10};
  Rls rls{{.terms = 3, .prior_variance = 1e4, .forgetting = 0.95}};
  int skipped = 0;
  for (int i = 0; i < 3000; ++i) {
    const Sample sample = source.gaussian(kTruth.head(3), 0.1);
    const LongVector x = sample.x.cast<long double>();
    const long double before = x.dot(covariance_of(rls) * x);
    const UpdateStatus status = learn(rls, sample);
    const long double after = x.dot(covariance_of(rls) * x);
    EXPECT_LE(after, before * (1.0L + 1e-12L)) << "a sample that makes its own prediction less certain";
    EXPECT_EQ(status == UpdateStatus::kFused, before >= 0.05L) << i;
    skipped += status == UpdateStatus::kNotExcited ? 1 : 0;
  }
  EXPECT_GT(skipped, 0);
  EXPECT_LT(skipped, 2500);
}

// One direction in four is excited, and that by a constant; the others now and then, by little. Textbook
// least squares with forgetting divides what it knows of them by λ at every sample: it must end, and does
// within some thousands.
TEST(FactorisedRls, StaysDefiniteForTenMillionUpdatesWhereTheTextbookFails) {
#if defined(__SANITIZE_ADDRESS__)
  constexpr int kUpdates = 300'000;  // the sanitized build is some thirty times slower
#else
  constexpr int kUpdates = 10'000'000;
#endif
  constexpr double kForgetting = 0.98;
  for (const double floor : {0.0, 1.0}) {
    Source source{11};
    Rls rls{{.terms = 4, .prior_variance = 1e6, .forgetting = kForgetting, .excitation_floor = floor}};
    DenseRls dense{4, 1e6, kForgetting};
    int dense_lost_at = -1;
    Sample sample{Eigen::VectorXd(4), 0};
    Vector x(4);
    Rls::Innovation innovation;
    for (int i = 0; i < kUpdates; ++i) {
      const bool excited = i % 4096 < 8;
      x << 1.0, 1.0, excited ? 1e-3 * source.normal() : 0.0, excited ? source.normal() : 0.0;
      const double y = x.sum() + (i % 3 - 1) * 0.1;
      (void)rls.update(x, y, innovation);
      if (dense_lost_at < 0) {
        sample.x = x;
        sample.y = y;
        dense.learn(sample);
        if (!dense.positive_definite()) dense_lost_at = i;
      }
      if (i % 1000 == 0) {
        ASSERT_TRUE(positive_definite(rls)) << i;
      }
    }
    EXPECT_TRUE(positive_definite(rls));
    const LongMatrix p = covariance_of(rls);
    EXPECT_EQ(Eigen::LLT<LongMatrix>{p}.info(), Eigen::Success);
    for (int j = 0; j < 4; ++j) EXPECT_LE(p(j, j), 1e6L / std::pow(0.98L, 4.0L) * (1 + 1e-6L));
    EXPECT_NEAR(rls.theta()(0) + rls.theta()(1), 2.0, 0.1);
    EXPECT_GE(dense_lost_at, 0) << "the textbook was to fail";
    EXPECT_EQ(rls.fused() + rls.unexcited(), kUpdates);
    RecordProperty("textbook_lost_definiteness_at_update", dense_lost_at);
    std::printf(
        "floor %.0f: textbook lost definiteness at update %d; factorised never in %d (%lld learned)\n", floor,
        dense_lost_at, kUpdates, static_cast<long long>(rls.fused()));
  }
}

TEST(FactorisedRls, NotANumberAndInfinityChangeNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double forgetting : {1.0, 0.97}) {
    Source source{12};
    Rls rls{{.terms = 5, .prior_variance = 1e4, .forgetting = forgetting}};
    Rls clean = rls;
    int hostile = 0;
    for (int i = 0; i < 500; ++i) {
      for (const double bad : {nan, infinity, -infinity, 1e200, -1e308}) {
        Sample sample = source.gaussian(kTruth, 0.1);
        sample.x(i % 5) = bad;
        EXPECT_EQ(learn(rls, sample), UpdateStatus::kNotFinite) << bad;
        sample = {Eigen::VectorXd::Ones(5), bad};
        EXPECT_EQ(learn(rls, sample), UpdateStatus::kNotFinite) << bad;
        hostile += 2;
      }
      const Sample sample = source.gaussian(kTruth, 0.1);
      ASSERT_EQ(learn(rls, sample), learn(clean, sample));
      ASSERT_EQ(rls.theta(), clean.theta());
    }
    EXPECT_EQ(covariance_of(rls), covariance_of(clean));
    EXPECT_EQ(rls.noise_variance(), clean.noise_variance());
    EXPECT_EQ(rls.refused(), hostile);
  }
}

// Regressors that fit into a double and would, one after the other, drive D out of it.
TEST(FactorisedRls, ValuesAtTheEndOfTheRangeNeverBreakTheFactors) {
  for (const double forgetting : {1.0, 0.9}) {
    Source source{13};
    Rls rls{{.terms = 4, .prior_variance = 1e10, .forgetting = forgetting}};
    for (int i = 0; i < 20'000; ++i) {
      Sample sample{Eigen::VectorXd(4), 0};
      for (int j = 0; j < 4; ++j) sample.x(j) = source.normal() * std::pow(10.0, 100.0 * source.normal());
      sample.y = source.normal() * std::pow(10.0, 100.0 * source.normal());
      learn(rls, sample);
      ASSERT_TRUE(positive_definite(rls)) << i;
    }
    EXPECT_GT(rls.refused(), 0);
    EXPECT_GT(rls.fused(), 0);
  }
}

TEST(FactorisedRls, FloatTracksDouble) {
  for (const double forgetting : {1.0, 0.99}) {
    Source source{14};
    const FactorisedRlsParams params{.terms = 5, .prior_variance = 1e4, .forgetting = forgetting};
    Rls rls{params};
    RlsFloat single{params};
    for (int i = 0; i < 20'000; ++i) {
      const Sample sample = source.gaussian(kTruth, 0.3);
      learn(rls, sample);
      learn(single, sample);
      // 20 000 updates of 6e-8 each, added up as a random walk, on coefficients of size 3: 3e-5; ten times
      // that.
      ASSERT_LT((single.theta().cast<double>() - rls.theta()).norm(), 3e-4) << i;
    }
    EXPECT_TRUE(positive_definite(single));
    const LongMatrix expected = covariance_of(rls);
    EXPECT_LT((covariance_of(single) - expected).norm() / expected.norm(), 1e-3L);
  }
}

TEST(FactorisedRls, FollowsAChangeOnlyIfItForgets) {
  Source source{15};
  Rls remembers{{.terms = 5, .prior_variance = 1e4}};
  Rls forgets{{.terms = 5, .prior_variance = 1e4, .forgetting = 0.98}};
  for (int i = 0; i < 2000; ++i) {
    const Sample sample = source.gaussian(i < 1500 ? kTruth : Eigen::VectorXd{-kTruth}, 0.1);
    learn(remembers, sample);
    learn(forgets, sample);
  }
  EXPECT_LT((forgets.theta() + kTruth).norm(), 0.2);
  EXPECT_GT((remembers.theta() + kTruth).norm(), 1.0);
}

TEST(FactorisedRls, UsesNoHeap) {
  Source source{16};
  Rls rls{{.terms = 5, .prior_variance = 1e4, .forgetting = 0.99}};
  Vector x(5);
  Rls::Innovation innovation;
  const test::AllocationGuard guard;
  for (int i = 0; i < 1000; ++i) {
    for (int j = 0; j < 5; ++j) x(j) = source.normal();
    (void)rls.update(x, source.normal(), innovation);
    (void)rls.predict(x, source.normal(), innovation);
    (void)rls.covariance(0, 4);
  }
  EXPECT_EQ(guard.allocations(), 0U);
}

}  // namespace
}  // namespace airworthy
