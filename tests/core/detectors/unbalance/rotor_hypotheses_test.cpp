#include "core/detectors/unbalance/rotor_hypotheses.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "tests/support/allocation_guard.h"

namespace airworthy {
namespace {

using Complex = std::complex<double>;
constexpr std::size_t kN = 4;
using Hypotheses = RotorHypotheses<double, kN>;
using Prior = UnbalancePrior<double, kN>;

/// Stands for an order tracker: amplitudes and covariance as a test wants them.
struct Seen {
  std::array<Complex, kN> x{};
  std::array<Complex, kN> y{};
  Eigen::MatrixXd P = 1e-3 * Eigen::MatrixXd::Identity(2 * kN, 2 * kN);

  [[nodiscard]] Phasor<double> x_m_s2(std::size_t k) const { return {x[k].real(), x[k].imag()}; }
  [[nodiscard]] Phasor<double> y_m_s2(std::size_t k) const { return {y[k].real(), y[k].imag()}; }
  [[nodiscard]] Phasor<double> turning_m_s2(std::size_t k, int spin) const {
    const Complex a = 0.5 * (x[k] + Complex{0.0, static_cast<double>(spin)} * y[k]);
    return {a.real(), a.imag()};
  }
  [[nodiscard]] double covariance_m2_s4(std::size_t i, std::size_t j) const {
    return P(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  }
  /// A force that turns with `spin`.
  void turn(std::size_t k, Complex amplitude, int spin) {
    x[k] = amplitude;
    y[k] = Complex{0.0, -static_cast<double>(spin)} * amplitude;
  }
};

Prior prior() {
  Prior result;
  result.spin = {1, -1, 1, -1};
  result.amplitude_m_s2 = {0.2, 0.3, 0.25, 0.4};
  return result;
}

/// (4) from its words: X = A₊ + A₋, Y = −j·s·(A₊ − A₋), one part of A₊ and A₋ after the other.
Eigen::Matrix4d covariance_of_rotor(double amplitude, int spin, double against) {
  Eigen::Matrix4d map;
  for (int part = 0; part < 4; ++part) {
    const Complex own{part == 0 ? 1.0 : 0.0, part == 1 ? 1.0 : 0.0};
    const Complex opposite{part == 2 ? 1.0 : 0.0, part == 3 ? 1.0 : 0.0};
    const Complex x = own + opposite;
    const Complex y = Complex{0.0, -static_cast<double>(spin)} * (own - opposite);
    map.col(part) << x.real(), x.imag(), y.real(), y.imag();
  }
  const double a2 = 0.5 * amplitude * amplitude;
  const Eigen::Vector4d variances{a2, a2, against * against * a2, against * against * a2};
  return map * variances.asDiagonal() * map.transpose();
}

/// ln N(z; 0, C) with z = (Re X, Im X, Re Y, Im Y) of one rotor after the other.
double log_density(const Seen& seen, const Prior& prior, const std::array<double, kN>& amplitude) {
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(4 * kN, 4 * kN);
  Eigen::VectorXd z(4 * kN);
  for (std::size_t i = 0; i < kN; ++i) {
    const auto r = static_cast<Eigen::Index>(i);
    for (Eigen::Index c = 0; c < static_cast<Eigen::Index>(kN); ++c) {
      C.block(4 * r, 4 * c, 2, 2) = seen.P.block(2 * r, 2 * c, 2, 2);
      C.block(4 * r + 2, 4 * c + 2, 2, 2) = seen.P.block(2 * r, 2 * c, 2, 2);
    }
    C.block(4 * r, 4 * r, 4, 4) += covariance_of_rotor(amplitude[i], prior.spin[i], prior.against_ratio);
    z.segment(4 * r, 4) << seen.x[i].real(), seen.x[i].imag(), seen.y[i].real(), seen.y[i].imag();
  }
  const Eigen::LDLT<Eigen::MatrixXd> factor{C};
  const double log_determinant = factor.vectorD().array().log().sum();
  return -0.5 * (z.dot(factor.solve(z)) + log_determinant +
                 static_cast<double>(4 * kN) * std::log(2.0 * std::numbers::pi));
}

struct Expected {
  std::array<double, kN> ratio{};
  std::array<double, kN> odds{};
  double faulty = 0.0;
};

Expected brute_force(const Seen& seen, const Prior& prior, const std::array<bool, kN>& known,
                     double smallest) {
  std::array<double, kN> usual = prior.amplitude_m_s2;
  std::array<double, kN> faulty{};
  for (std::size_t i = 0; i < kN; ++i) {
    faulty[i] = std::hypot(usual[i], std::max(seen.turning_m_s2(i, prior.spin[i]).magnitude(), smallest));
    if (known[i]) usual[i] = faulty[i];
  }
  const double healthy = log_density(seen, prior, usual);
  Expected expected;
  double sum = 0.0;
  for (std::size_t i = 0; i < kN; ++i) {
    if (known[i]) continue;
    std::array<double, kN> amplitude = usual;
    amplitude[i] = faulty[i];
    expected.ratio[i] = log_density(seen, prior, amplitude) - healthy;
    sum += prior.fault_probability * std::exp(expected.ratio[i]);
  }
  for (std::size_t i = 0; i < kN; ++i) {
    if (known[i]) continue;
    double others = 1.0;
    for (std::size_t j = 0; j < kN; ++j) {
      if (j != i && !known[j]) others += prior.fault_probability * std::exp(expected.ratio[j]);
    }
    expected.odds[i] = std::log(prior.fault_probability / others) + expected.ratio[i];
  }
  expected.faulty = std::log(sum);
  return expected;
}

TEST(RotorHypotheses, EqualDenseGaussianLikelihoods) {
  std::mt19937 random{17};
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    Seen seen;
    Eigen::MatrixXd root(2 * kN, 2 * kN);
    for (double& element : root.reshaped()) element = 0.1 * normal(random);
    seen.P = root * root.transpose() + 1e-4 * Eigen::MatrixXd::Identity(2 * kN, 2 * kN);
    for (std::size_t i = 0; i < kN; ++i) {
      seen.x[i] = 0.6 * Complex{normal(random), normal(random)};
      seen.y[i] = 0.6 * Complex{normal(random), normal(random)};
    }
    const std::array<bool, kN> known{trial % 3 == 0, false, trial % 5 == 0, false};
    const auto verdict = Hypotheses::test(seen, prior(), known, 0.4);
    ASSERT_TRUE(verdict.has_value());
    const Expected expected = brute_force(seen, prior(), known, 0.4);
    for (std::size_t i = 0; i < kN; ++i) {
      const double scale = 1.0 + std::abs(expected.ratio[i]);
      ASSERT_NEAR(verdict->log_likelihood_ratio[i], expected.ratio[i], 1e-9 * scale) << trial << ", " << i;
      ASSERT_NEAR(verdict->log_odds[i], expected.odds[i], 1e-9 * scale) << trial << ", " << i;
    }
    ASSERT_NEAR(verdict->log_odds_faulty, expected.faulty, 1e-9 * (1.0 + std::abs(expected.faulty)));
  }
}

TEST(RotorHypotheses, NameTheRotorThatShakesMoreAndMore) {
  double before = -1e9;
  for (const double amplitude : {0.1, 0.5, 1.0, 2.0, 5.0, 20.0, 100.0}) {
    Seen seen;
    seen.turn(2, std::polar(amplitude, 0.7), 1);
    const auto verdict = Hypotheses::test(seen, prior(), {}, 0.4);
    ASSERT_TRUE(verdict.has_value());
    EXPECT_GT(verdict->log_odds[2], before) << amplitude;
    before = verdict->log_odds[2];
    for (const std::size_t other : {0U, 1U, 3U}) EXPECT_LT(verdict->log_odds[other], -9.0) << amplitude;
  }
  EXPECT_GT(before, 100.0);
}

// Of two rotors with one speed only the sum is known: the filter gives half to each, and none of the difference.
Seen shared(std::size_t a, std::size_t b, Complex sum, int sense) {
  Seen seen;
  seen.turn(a, 0.5 * sum, sense);
  seen.turn(b, 0.5 * sum, sense);
  for (Eigen::Index part = 0; part < 2; ++part) {
    const auto i = static_cast<Eigen::Index>(2 * a) + part;
    const auto j = static_cast<Eigen::Index>(2 * b) + part;
    seen.P(i, i) += 128.0;
    seen.P(j, j) += 128.0;
    seen.P(i, j) -= 128.0;
    seen.P(j, i) -= 128.0;
  }
  return seen;
}

TEST(RotorHypotheses, RotorsThatTurnAlikeAreEquallyLikelyAndNeitherIsBlamed) {
  Prior alike = prior();
  alike.amplitude_m_s2.fill(0.3);
  const auto verdict = Hypotheses::test(shared(0, 2, {4.0, 0.0}, 1), alike, {}, 0.4);
  ASSERT_TRUE(verdict.has_value());
  EXPECT_GT(verdict->log_odds_faulty, 9.2);
  EXPECT_NEAR(verdict->log_odds[0], verdict->log_odds[2], 1e-9);
  EXPECT_LE(verdict->log_odds[0], 0.0);
  EXPECT_LT(verdict->log_odds[1], -9.2);
}

TEST(RotorHypotheses, TheSenseOfRotationTellsRotorsOfOneSpeedApart) {
  Prior alike = prior();
  alike.amplitude_m_s2.fill(0.3);
  for (const int sense : {1, -1}) {
    const auto verdict = Hypotheses::test(shared(0, 1, {4.0, 0.0}, sense), alike, {}, 0.4);
    ASSERT_TRUE(verdict.has_value());
    EXPECT_GT(verdict->log_odds[sense == 1 ? 0 : 1], 9.2) << sense;
    EXPECT_LT(verdict->log_odds[sense == 1 ? 1 : 0], -9.2) << sense;
  }
}

TEST(RotorHypotheses, WhatIsKnownExplainsWhatItShares) {
  const auto verdict =
      Hypotheses::test(shared(0, 2, {4.0, 0.0}, 1), prior(), {true, false, false, false}, 0.4);
  ASSERT_TRUE(verdict.has_value());
  EXPECT_EQ(verdict->log_odds[0], 0.0);
  EXPECT_LT(verdict->log_odds_faulty, 0.0);
}

TEST(RotorHypotheses, WithoutAPositiveCovarianceThereIsNoVerdict) {
  Seen seen;
  seen.P(3, 3) = -10.0;
  EXPECT_FALSE(Hypotheses::test(seen, prior(), {}, 0.4).has_value());
  seen.P(3, 3) = std::nan("");
  EXPECT_FALSE(Hypotheses::test(seen, prior(), {}, 0.4).has_value());
}

TEST(RotorHypotheses, AllKnownLeavesNobodyToSuspect) {
  Seen seen;
  seen.turn(2, {3.0, 0.0}, 1);
  const auto verdict = Hypotheses::test(seen, prior(), {true, true, true, true}, 0.4);
  ASSERT_TRUE(verdict.has_value());
  EXPECT_LT(verdict->log_odds_faulty, -1e9);
  for (const double odds : verdict->log_odds) EXPECT_EQ(odds, 0.0);
}

TEST(RotorHypotheses, UseNoHeap) {
  const Seen seen = shared(0, 2, {4.0, 0.0}, 1);
  const Prior usual = prior();
  const test::AllocationGuard guard;
  const auto verdict = Hypotheses::test(seen, usual, {}, 0.4);
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_TRUE(verdict.has_value());
}

}  // namespace
}  // namespace airworthy
