#include "core/detectors/response/evidence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace airworthy::response {
namespace {

TEST(ShiftEvidence, IsTheClippedResidualLessTheDrift) {
  const EvidenceParams params{.clip_sigmas = 4.0, .drift_sigmas = 1.0};
  EXPECT_DOUBLE_EQ(shift_evidence(params, 0.5), -0.5);
  EXPECT_DOUBLE_EQ(shift_evidence(params, 2.0), 1.0);
  EXPECT_DOUBLE_EQ(shift_evidence(params, 100.0), 3.0);
  EXPECT_DOUBLE_EQ(shift_evidence(params, -100.0), -5.0);
}

// Without clips and inflation it must be the log-likelihood ratio of two normal distributions.
TEST(GainLossEvidence, IsTheLogLikelihoodRatio) {
  const EvidenceParams params{.alternative = Alternative::kGainLoss,
                              .clip_sigmas = 1e9,
                              .remaining_gain = 0.4,
                              .sigma_inflation = 1.0,
                              .most_per_tick = 1e9};
  const auto log_density = [](double e, double mean, double sigma) {
    return -0.5 * std::pow((e - mean) / sigma, 2);
  };
  for (const double commanded : {-1.0, -0.1, 0.0, 0.3, 2.0}) {
    for (const double innovation : {-1.0, 0.0, 0.2, 0.7}) {
      const double sigma = 0.3;
      const double expected =
          log_density(innovation, -(1 - 0.4) * commanded, sigma) - log_density(innovation, 0.0, sigma);
      EXPECT_NEAR(gain_loss_evidence(params, innovation, commanded, sigma), expected, 1e-12);
    }
  }
}

TEST(GainLossEvidence, WithoutACommandThereIsNone) {
  const EvidenceParams params{.alternative = Alternative::kGainLoss};
  EXPECT_EQ(gain_loss_evidence(params, 5.0, 0.0, 0.1), 0.0);
}

TEST(GainLossEvidence, IsNegativeInTheMeanOfAHealthyVehicleAndPositiveOfAFailedOne) {
  const EvidenceParams params{
      .alternative = Alternative::kGainLoss, .clip_sigmas = 3.0, .remaining_gain = 0.5};
  std::mt19937 random{5};
  std::normal_distribution<double> normal;
  double healthy = 0;
  double failed = 0;
  for (int i = 0; i < 20'000; ++i) {
    const double commanded = 0.5 * normal(random);
    const double noise = 0.1 * normal(random);
    healthy += gain_loss_evidence(params, noise, commanded, 0.1);
    failed += gain_loss_evidence(params, noise - 0.5 * commanded, commanded, 0.1);
  }
  EXPECT_LT(healthy, 0.0);
  EXPECT_GT(failed, 0.0);
}

}  // namespace
}  // namespace airworthy::response
