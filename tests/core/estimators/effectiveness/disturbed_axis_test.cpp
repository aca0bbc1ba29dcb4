#include "core/estimators/effectiveness/disturbed_axis.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

namespace airworthy {
namespace {

constexpr double kStep_s = 0.002;
constexpr RateAxis<double>::Noise kNoise{0.3, 5.0};
constexpr double kVariance = 0.0009;

TEST(RateAxis, EqualsTheDenseTwoStateFilter) {
  RateAxis<double> axis;
  axis.start(0.1, 0.01, 4.0);
  Eigen::Vector2d x{0.1, 0.0};
  Eigen::Matrix2d P = Eigen::Vector2d{0.01, 4.0}.asDiagonal();
  Eigen::Matrix2d F;
  F << 1.0, kStep_s, 0.0, 1.0;
  const Eigen::Matrix2d Q =
      kStep_s * Eigen::Vector2d{kNoise.acceleration_density, kNoise.disturbance_density}.asDiagonal();
  const Eigen::RowVector2d H{1.0, 0.0};
  std::mt19937 random{2};
  std::normal_distribution normal;
  for (int i = 0; i < 2000; ++i) {
    const double u = 10.0 * normal(random);
    const double gyro = normal(random);
    const auto step = axis.step(kStep_s, u, gyro, kNoise, kVariance);
    x = F * x + Eigen::Vector2d{kStep_s * u, 0.0};
    P = F * P * F.transpose() + Q;
    const double S = (H * P * H.transpose()).value() + kVariance;
    const Eigen::Vector2d K = P * H.transpose() / S;
    const double e = gyro - (H * x).value();
    x += K * e;
    P = (Eigen::Matrix2d::Identity() - K * H) * P;
    ASSERT_NEAR(step.innovation, e, 1e-10);
    ASSERT_NEAR(step.variance, S, 1e-12);
    ASSERT_NEAR(axis.rate(), x[0], 1e-10);
    ASSERT_NEAR(axis.disturbance(), x[1], 1e-8);
    ASSERT_NEAR(axis.disturbance_variance(), P(1, 1), 1e-8);
  }
}

TEST(RateAxis, TheSignatureIsWhatAnUnmodelledAccelerationAddsToTheInnovations) {
  RateAxis<double> healthy;
  RateAxis<double> faulty;
  healthy.start(0.0, 0.01, 4.0);
  faulty.start(0.0, 0.01, 4.0);
  RateAxis<double>::Signature signature;
  std::mt19937 random{3};
  std::normal_distribution normal;
  double extra_rad_s = 0.0;
  for (int i = 0; i < 500; ++i) {
    const double u = normal(random);
    const double gyro = 0.1 * normal(random);
    const double f = i < 100 ? 0.0 : 20.0 + 5.0 * std::sin(0.1 * i);
    extra_rad_s += kStep_s * f;
    const auto a = healthy.step(kStep_s, u, gyro, kNoise, kVariance);
    const auto b = faulty.step(kStep_s, u, gyro + extra_rad_s, kNoise, kVariance);
    ASSERT_NEAR(signature.step(a, f), b.innovation - a.innovation, 1e-9) << i;
  }
  // Once believed, what the filter made of it is taken back: from here it predicts as if it had always known.
  const auto before = faulty;
  faulty.shift(signature.rate, signature.disturbance);
  EXPECT_NEAR(faulty.rate() - before.rate(), signature.rate, 1e-12);
  EXPECT_NEAR(faulty.disturbance(), before.disturbance() + signature.disturbance, 1e-12);
  EXPECT_NEAR(faulty.disturbance(), healthy.disturbance(), 1e-6) << "the disturbance held the fault";
}

TEST(ForceAxis, SignatureAndSteadyVarianceInClosedForm) {
  ForceAxis<double> healthy;
  ForceAxis<double> faulty;
  healthy.start(1.0);
  faulty.start(1.0);
  ForceAxis<double>::Signature signature;
  std::mt19937 random{4};
  std::normal_distribution normal;
  double variance = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const double accel = normal(random);
    const double f = i < 200 ? 0.0 : 2.5;
    const auto a = healthy.step(kStep_s, 0.0, accel, 1.5, 0.5);
    const auto b = faulty.step(kStep_s, 0.0, accel + f, 1.5, 0.5);
    ASSERT_NEAR(signature.step(a, f), b.innovation - a.innovation, 1e-9);
    variance = a.variance;
  }
  // Scalar random walk: P⁻ = (q + √(q² + 4·q·R))/2 with q = 1.5·Δt, S = P⁻ + R.
  const double q = 1.5 * kStep_s;
  EXPECT_NEAR(variance, 0.5 * (q + std::sqrt(q * q + 4.0 * q * 0.5)) + 0.5, 1e-9);
}

TEST(AdaptiveVariance, SettlesAtTheNoiseAndClipsWhatIsNoNoise) {
  AdaptiveVariance<double> variance{1.0, 0.01, 100.0, 2.0};
  std::mt19937 random{5};
  std::normal_distribution normal{0.0, 3.0};
  double mean = 0.0;
  for (int i = 0; i < 40'000; ++i) {
    variance.step(normal(random), variance.value, kStep_s);
    if (i >= 10'000) mean += variance.value / 30'000.0;
  }
  // E min(e², 9σ²) of a normal distribution is 0.9926·σ².
  EXPECT_NEAR(mean, 9.0, 0.5);
  const double before = variance.value;
  variance.step(1e6, before, kStep_s);
  EXPECT_NEAR(variance.value, before + kStep_s / 2.0 * 8.0 * before, 1e-9);
}

}  // namespace
}  // namespace airworthy
