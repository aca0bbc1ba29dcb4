#include "core/estimators/effectiveness/loss_of_effectiveness_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/allocation_guard.h"
#include "tests/support/reference/dense_effectiveness_filter.h"
#include "tests/support/rotor_ring.h"

namespace airworthy {
namespace {

using test::bebop_ring;

constexpr double kStep_s = 0.002;

LossOfEffectivenessParams<double> general() {
  LossOfEffectivenessParams<double> params;
  params.measurement_variance[kYawRow] = 4.0;
  params.pull_ratio = 0.005;
  return params;
}

/// Feeds a filter what (1), (2) of the model give without noise: rates that integrate z exactly.
class Flight {
 public:
  Flight(const EffectivenessMatrix<double>& matrix, unsigned seed) : matrix_{matrix}, random_{seed} {
    for (double& phase : phase_) phase = std::uniform_real_distribution{0.0, 6.28}(random_);
  }

  template <class Filter>
  UpdateStatus step(Filter& filter, const std::vector<double>& k, double noise = 0.0) {
    time_s_ += kStep_s;
    std::normal_distribution normal;
    std::vector<double> speed;
    std::array<double, kEffectivenessRows> z{};
    for (std::size_t i = 0; i < matrix_.rotor_count; ++i) {
      const double rate = 3.0 + static_cast<double>(i);
      speed.push_back(640.0 + 40.0 * std::sin(rate * time_s_ + phase_[i]));
      for (std::size_t row = 0; row < kEffectivenessRows; ++row)
        z[row] += matrix_.per_speed2[row][i] * k[i] * speed[i] * speed[i];
    }
    for (std::size_t axis = 0; axis < 3; ++axis) rates_[axis] += z[axis] * kStep_s;
    auto measured = rates_;
    for (double& rate : measured) rate += noise * normal(random_);
    return filter.update(kStep_s, speed, measured, z[kVerticalRow] + noise * normal(random_));
  }

 private:
  EffectivenessMatrix<double> matrix_;
  std::mt19937 random_;
  std::array<double, kMaxRotors> phase_{};
  std::array<double, 3> rates_{};
  double time_s_ = 0.0;
};

TEST(EffectivenessMatrix, OfAQuadByHand) {
  Multirotor quad = bebop_ring(4);
  quad.rotor[0].position_m = {0.1, 0.2, 0.0};
  const auto matrix = EffectivenessMatrix<double>::of(quad);
  // Thrust upwards on the right rolls to the left, in front it pitches up; clockwise rotors turn the body left.
  EXPECT_NEAR(matrix.per_speed2[kRollRow][0], -0.2 * 2e-6 / 0.0023, 1e-18);
  EXPECT_NEAR(matrix.per_speed2[kPitchRow][0], 0.1 * 2e-6 / 0.0018, 1e-18);
  EXPECT_NEAR(matrix.per_speed2[kYawRow][0], -0.012 * 2e-6 / 0.0036, 1e-18);
  EXPECT_NEAR(matrix.per_speed2[kVerticalRow][0], -2e-6 / 0.5, 1e-18);
}

TEST(LossOfEffectivenessFilter, OneRotorReachesTheClosedFormVariance) {
  // P⁺ of a scalar random walk: P·h²·(P⁺ + Q) = ... gives P = (−Q + √(Q² + 4QR/h²))/2 after an update.
  EffectivenessMatrix<double> matrix;
  matrix.rotor_count = 1;
  matrix.per_speed2[kVerticalRow][0] = -1e-5;
  LossOfEffectivenessParams<double> params;
  params.process_variance = 0.02;
  LossOfEffectivenessFilter<double> filter{matrix, params};
  const std::array speed{500.0};
  for (int i = 0; i < 500; ++i) {
    static_cast<void>(filter.update(kStep_s, speed, {}, -1e-5 * 250'000.0 * 0.7));
  }
  const double h2 = 2.5 * 2.5;
  const double q = 0.02;
  EXPECT_NEAR(filter.covariance(0, 0), (-q + std::sqrt(q * q + 4.0 * q / h2)) / 2.0, 1e-12);
  EXPECT_NEAR(filter.effectiveness(0), 0.7, 1e-9);
}

TEST(LossOfEffectivenessFilter, EqualsTheDenseTextbookFilter) {
  for (const std::size_t rotors : {3U, 4U, 6U, 8U}) {
    const auto matrix = EffectivenessMatrix<double>::of(bebop_ring(rotors));
    const auto params = general();
    LossOfEffectivenessFilter<double> filter{matrix, params};
    const auto n = static_cast<Eigen::Index>(rotors);
    reference::DenseEffectivenessFilter dense{Eigen::VectorXd::Ones(n),
                                              params.process_variance * Eigen::MatrixXd::Identity(n, n)};
    std::mt19937 random{static_cast<unsigned>(rotors)};
    std::normal_distribution normal;
    // Steady inputs pass the low-passes unchanged, so that the reference needs none.
    std::vector<double> speed;
    for (std::size_t i = 0; i < rotors; ++i) speed.push_back(600.0 + 20.0 * static_cast<double>(i));
    Eigen::MatrixXd H(4, n);
    for (Eigen::Index row = 0; row < 4; ++row) {
      for (Eigen::Index i = 0; i < n; ++i) {
        const auto at = static_cast<std::size_t>(i);
        H(row, i) = matrix.per_speed2[static_cast<std::size_t>(row)][at] * speed[at] * speed[at];
      }
    }
    const Eigen::Vector4d R{1.0, 1.0, 4.0, 1.0};
    const Eigen::Vector4d z{0.0, 0.0, 0.0, -9.0 + normal(random)};
    static_cast<void>(filter.update(kStep_s, speed, {}, z[3]));
    for (int step = 0; step < 200; ++step) {
      ASSERT_EQ(filter.update(kStep_s, speed, {}, z[3]), UpdateStatus::kFused);
      dense.update(H, z, R.asDiagonal(), params.process_variance, params.pull_ratio,
                   params.most_effectiveness);
      const auto singles = filter.single_faults();
      ASSERT_TRUE(singles);
      for (Eigen::Index i = 0; i < n; ++i) {
        const auto at = static_cast<std::size_t>(i);
        ASSERT_NEAR(filter.effectiveness(at), dense.k[i], 1e-9);
        for (Eigen::Index j = 0; j < n; ++j)
          ASSERT_NEAR(filter.covariance(at, static_cast<std::size_t>(j)), dense.P(i, j), 1e-9);
        const auto expected = dense.single_fault(i);
        ASSERT_NEAR((*singles)[at].effectiveness, expected.effectiveness, 1e-7);
        ASSERT_NEAR((*singles)[at].variance, expected.variance, 1e-7);
        ASSERT_NEAR((*singles)[at].unexplained, expected.unexplained, 1e-6 * (1.0 + expected.unexplained));
      }
    }
  }
}

TEST(LossOfEffectivenessFilter, ProbabilityIsTheNormalDistribution) {
  using Filter = LossOfEffectivenessFilter<double>;
  // Tables of the normal distribution. The printed 1 − ½(1 + erf(·)) gives the complements, and σ² for σ·√2 other values.
  EXPECT_NEAR(Filter::probability_below(0.25, 0.25, 0.04), 0.5, 1e-12);
  EXPECT_NEAR(Filter::probability_below(0.25, 0.25 - 1.2815515655446004 * 0.2, 0.04), 0.9, 1e-12);
  EXPECT_NEAR(Filter::probability_below(0.25, 1.0, 0.0625), 0.0013498980316301, 1e-12);
}

TEST(LossOfEffectivenessFilter, WithoutPullWhatFourRotorsHideGrowsWithoutBound) {
  auto params = LossOfEffectivenessParams<double>{};
  const auto matrix = EffectivenessMatrix<double>::of(bebop_ring(4));
  const auto hidden_variance = [&](double pull, int steps) {
    params.pull_ratio = pull;
    LossOfEffectivenessFilter<double> filter{matrix, params};
    const std::array speed{640.0, 640.0, 640.0, 640.0};
    for (int i = 0; i < steps; ++i) static_cast<void>(filter.update(kStep_s, speed, {}, -9.81));
    // Along (1, −1, 1, −1)/2 rows p, q, a_z see nothing at equal speeds.
    double sum = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) sum += ((i + j) % 2 == 0 ? 0.25 : -0.25) * filter.covariance(i, j);
    }
    return sum;
  };
  EXPECT_NEAR(hidden_variance(0.0, 1001), 0.01 * 1001, 1e-6);  // P₀ = Q, and Q with each of 1000 updates
  EXPECT_NEAR(hidden_variance(0.005, 5000), 0.01 / (1.0 - 0.995 * 0.995), 1e-6);
}

TEST(LossOfEffectivenessFilter, NamesEachLostRotorOfAnyVehicle) {
  for (std::size_t rotors = 3; rotors <= kMaxRotors; ++rotors) {
    const auto matrix = EffectivenessMatrix<double>::of(bebop_ring(rotors));
    for (std::size_t lost = 0; lost < rotors; ++lost) {
      LossOfEffectivenessFilter<double> filter{matrix, general()};
      Flight flight{matrix, 7};
      std::vector<double> k(rotors, 1.0);
      for (int i = 0; i < 500; ++i) {
        static_cast<void>(flight.step(filter, k, 0.005));
        ASSERT_FALSE(filter.single_lost(0.9)) << "healthy, step " << i;
      }
      k[lost] = 0.0;
      int steps = 0;
      while (!filter.single_lost(0.9) && steps < 100) {
        static_cast<void>(flight.step(filter, k, 0.005));
        ++steps;
      }
      ASSERT_LT(steps, 50) << rotors << " rotors, rotor " << lost + 1;
      EXPECT_EQ(*filter.single_lost(0.9), lost) << rotors << " rotors";
    }
  }
}

TEST(LossOfEffectivenessFilter, NamesNobodyForWhatOneRotorDoesNotExplain) {
  const auto matrix = EffectivenessMatrix<double>::of(bebop_ring(6));
  LossOfEffectivenessFilter<double> filter{matrix, general()};
  Flight flight{matrix, 5};
  // Two rotors two arms apart: none alone has both moments.
  const std::vector<double> k{0.0, 1.0, 0.0, 1.0, 1.0, 1.0};
  int named = 0;
  for (int i = 0; i < 200; ++i) {
    static_cast<void>(flight.step(filter, k, 0.005));
    const auto lost = filter.single_lost(0.9);
    if (!lost) continue;
    ++named;
    const auto fault = (*filter.single_faults())[*lost];
    const double explained = (1.0 - fault.effectiveness) * (1.0 - fault.effectiveness) / fault.variance;
    const double share = fault.unexplained / (fault.unexplained + explained);
    EXPECT_GT(share, 0.01) << i;
    EXPECT_FALSE(filter.single_lost(0.9, 0.999 * share)) << i;
    EXPECT_EQ(filter.single_lost(0.9, 1.001 * share), lost) << i;
  }
  EXPECT_GT(named, 0);
}

TEST(LossOfEffectivenessFilter, ReadsWhatIsLeftOfOneRotor) {
  for (const double left : {0.4, 0.7, 1.3}) {
    const auto matrix = EffectivenessMatrix<double>::of(bebop_ring(6));
    LossOfEffectivenessFilter<double> filter{matrix, general()};
    Flight flight{matrix, 3};
    const std::vector<double> k{1.0, 1.0, left, 1.0, 1.0, 1.0};
    for (int i = 0; i < 1000; ++i) static_cast<void>(flight.step(filter, k));
    EXPECT_NEAR((*filter.single_faults())[2].effectiveness, left, 0.03);
    EXPECT_FALSE(filter.single_lost(0.9));
  }
}

TEST(LossOfEffectivenessFilter, MeasuresAFaultFromWhatTheFlightShowedBefore) {
  // The vehicle file promises a quarter more than the rotors give: a rotor that gives 0.2 of its own is not below 0.25 of
  // what the file says by much, and one that gives all of its own is not whole.
  const auto matrix = EffectivenessMatrix<double>::of(bebop_ring(6));
  LossOfEffectivenessFilter<double> filter{matrix, general()};
  LossOfEffectivenessFilter<double> without{matrix, general()};
  Flight flight{matrix, 3};
  Flight same{matrix, 3};
  std::vector<double> k(6, 0.8);
  for (int i = 0; i < 5000; ++i) {
    static_cast<void>(flight.step(filter, k));
    filter.learn_reference(kStep_s);
    static_cast<void>(same.step(without, k));
  }
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR((*filter.single_faults())[i].effectiveness, 1.0, 0.01);
    EXPECT_NEAR(filter.reference(i), filter.effectiveness(i), 0.01);
    EXPECT_EQ(without.reference(i), 1.0);
  }
  k[2] = 0.5 * 0.8;
  for (int i = 0; i < 100; ++i) {
    static_cast<void>(flight.step(filter, k));
    static_cast<void>(same.step(without, k));
  }
  const auto learned = (*filter.single_faults())[2];
  EXPECT_NEAR(learned.effectiveness, 0.5, 0.03);
  EXPECT_LT(learned.unexplained, 0.01 * (*without.single_faults())[2].unexplained);
  // The share that is left unexplained does not depend on what the deviation is measured in.
  const double explained = (1.0 - learned.effectiveness) * (1.0 - learned.effectiveness) / learned.variance;
  EXPECT_LT(learned.unexplained, 0.01 * explained);
}

TEST(LossOfEffectivenessFilter, TheReferenceIsAMeanThatForgetsAndHasALeast) {
  EffectivenessMatrix<double> matrix;
  matrix.rotor_count = 1;
  matrix.per_speed2[kVerticalRow][0] = -1e-5;
  auto params = LossOfEffectivenessParams<double>{};
  params.reference_memory_s = 1.0;
  LossOfEffectivenessFilter<double> filter{matrix, params};
  const std::array speed{1000.0};
  const auto fly = [&](double k) {
    static_cast<void>(filter.update(kStep_s, speed, {}, -10.0 * k));
    filter.learn_reference(kStep_s);
  };
  // At first the mean of all steps, whatever it was before them.
  for (int i = 0; i < 100; ++i) fly(0.9);
  EXPECT_NEAR(filter.reference(0), 0.9, 0.005);
  // One memory later 1/e of what was is left.
  for (int i = 0; i < 1000; ++i) fly(0.9);
  for (int i = 0; i < 520; ++i) fly(1.2);
  EXPECT_NEAR(filter.reference(0), 1.2 - 0.3 * std::exp(-1.0), 0.01);
  for (int i = 0; i < 5000; ++i) fly(0.1);
  EXPECT_EQ(filter.reference(0), 0.5);
  const double before = filter.reference(0);
  filter.learn_reference(0.0);
  filter.learn_reference(-1.0);
  filter.learn_reference(std::nan(""));
  EXPECT_EQ(filter.reference(0), before);
}

TEST(LossOfEffectivenessFilter, RenumberingTheRotorsRenumbersTheAnswer) {
  const std::array<std::size_t, 6> order{3, 0, 5, 1, 4, 2};
  const Multirotor vehicle = bebop_ring(6);
  Multirotor renumbered = vehicle;
  for (std::size_t i = 0; i < 6; ++i) renumbered.rotor[i] = vehicle.rotor[order[i]];
  LossOfEffectivenessFilter<double> a{EffectivenessMatrix<double>::of(vehicle), general()};
  LossOfEffectivenessFilter<double> b{EffectivenessMatrix<double>::of(renumbered), general()};
  std::mt19937 random{5};
  std::normal_distribution normal;
  for (int step = 0; step < 300; ++step) {
    std::array<double, 6> speed{};
    std::array<double, 6> speed_b{};
    for (double& one : speed) one = 640.0 + 30.0 * normal(random);
    for (std::size_t i = 0; i < 6; ++i) speed_b[i] = speed[order[i]];
    const std::array gyro{0.1 * normal(random), 0.1 * normal(random), 0.1 * normal(random)};
    static_cast<void>(a.update(kStep_s, speed, gyro, -9.8));
    static_cast<void>(b.update(kStep_s, speed_b, gyro, -9.8));
  }
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(b.effectiveness(i), a.effectiveness(order[i]), 1e-9);
    EXPECT_NEAR(b.covariance(i, i), a.covariance(order[i], order[i]), 1e-9);
  }
}

TEST(LossOfEffectivenessFilter, RefusesWhatIsNoNumberAndKeepsItsState) {
  const auto matrix = EffectivenessMatrix<double>::of(bebop_ring(4));
  LossOfEffectivenessFilter<double> filter{matrix, {}};
  std::array speed{640.0, 640.0, 640.0, 640.0};
  EXPECT_EQ(filter.update(0.0, speed, {}, -9.8), UpdateStatus::kConverging);
  EXPECT_EQ(filter.update(kStep_s, speed, {}, -9.8), UpdateStatus::kFused);
  const double before = filter.covariance(0, 0);
  const double nan = std::nan("");
  EXPECT_EQ(filter.update(kStep_s, speed, {0.0, nan, 0.0}, -9.8), UpdateStatus::kNotFinite);
  EXPECT_EQ(filter.update(kStep_s, speed, {}, nan), UpdateStatus::kNotFinite);
  EXPECT_EQ(filter.update(nan, speed, {}, -9.8), UpdateStatus::kNotFinite);
  EXPECT_EQ(filter.update(kStep_s, std::span{speed}.first(3), {}, -9.8), UpdateStatus::kNotFinite);
  speed[2] = nan;
  EXPECT_EQ(filter.update(kStep_s, speed, {}, -9.8), UpdateStatus::kNotFinite);
  speed[2] = 640.0;
  EXPECT_EQ(filter.update(0.0, speed, {}, -9.8), UpdateStatus::kTimeBackward);
  EXPECT_EQ(filter.covariance(0, 0), before);
  EXPECT_EQ(filter.update(0.2, speed, {5.0, 0.0, 0.0}, -9.8), UpdateStatus::kConverging);
  EXPECT_EQ(filter.covariance(0, 0), before);
}

TEST(LossOfEffectivenessFilter, FloatFollowsDouble) {
  const auto matrix = EffectivenessMatrix<double>::of(bebop_ring(8));
  const auto matrix_f = EffectivenessMatrix<float>::of(bebop_ring(8));
  LossOfEffectivenessParams<float> params_f;
  params_f.measurement_variance[kYawRow] = 4.0F;
  params_f.pull_ratio = 0.005F;
  LossOfEffectivenessFilter<double> filter{matrix, general()};
  LossOfEffectivenessFilter<float> filter_f{matrix_f, params_f};
  std::mt19937 random{1};
  std::normal_distribution normal;
  for (int step = 0; step < 5000; ++step) {
    std::array<double, 8> speed{};
    std::array<float, 8> speed_f{};
    for (std::size_t i = 0; i < 8; ++i) {
      speed[i] = 640.0 + 20.0 * normal(random);
      speed_f[i] = static_cast<float>(speed[i]);
    }
    static_cast<void>(filter.update(kStep_s, speed, {}, -9.8));
    static_cast<void>(filter_f.update(static_cast<float>(kStep_s), speed_f, {}, -9.8F));
  }
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_NEAR(filter_f.effectiveness(i), filter.effectiveness(i), 2e-3);
    EXPECT_GT(filter_f.covariance(i, i), 0.0F);
  }
}

TEST(LossOfEffectivenessFilter, UsesNoHeap) {
  const auto matrix = EffectivenessMatrix<double>::of(bebop_ring(8));
  const std::array speed{640.0, 640.0, 640.0, 640.0, 640.0, 640.0, 640.0, 640.0};
  const test::AllocationGuard guard;
  LossOfEffectivenessFilter<double> filter{matrix, general()};
  for (int i = 0; i < 10; ++i) static_cast<void>(filter.update(kStep_s, speed, {}, -9.8));
  static_cast<void>(filter.single_lost(0.9));
  EXPECT_EQ(guard.allocations(), 0U);
}

}  // namespace
}  // namespace airworthy
