#include "core/estimators/actuator/multi_stage_observer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/allocation_guard.h"
#include "tests/support/reference/augmented_fault_filter.h"
#include "tests/support/reference/thrifty_fault_filter.h"

namespace airworthy {
namespace {

using reference::AugmentedFaultFilter;
using reference::ThriftyFaultFilter;

/// Random systems that change at every step: no structure to lean on.
template <class Observer>
class RandomSystem {
 public:
  explicit RandomSystem(unsigned seed) : random_{seed} {}

  double normal() { return normal_(random_); }

  template <class Matrix>
  void fill(Matrix& m, double scale) {
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      for (Eigen::Index j = 0; j < m.cols(); ++j) m(i, j) = scale * normal();
    }
  }
  template <class Matrix>
  Matrix positive(double least, double scale) {
    Matrix root;
    fill(root, scale);
    return Matrix{root * root.transpose() + least * Matrix::Identity()};
  }

  typename Observer::Prior prior() {
    typename Observer::Prior prior;
    fill(prior.state, 1.0);
    fill(prior.fault, 0.3);
    prior.state_covariance = positive<typename Observer::StateMatrix>(0.5, 0.5);
    for (auto& variance : prior.fault_variance) variance = std::exp(normal());
    return prior;
  }
  /// `fault_noise`: largest q; one actuator in four has none at all.
  typename Observer::Transition transition(double fault_noise) {
    typename Observer::Transition model;
    fill(model.a, 0.6 / std::sqrt(static_cast<double>(model.a.rows())));
    fill(model.b, 0.7);
    fill(model.u, 2.0);
    fill(model.known, 0.5);
    model.noise = positive<typename Observer::StateMatrix>(0.01, 0.2);
    for (auto& variance : model.fault_noise_variance) {
      variance =
          std::uniform_int_distribution<int>{0, 3}(random_) == 0 ? 0.0 : fault_noise * std::abs(normal());
    }
    return model;
  }
  typename Observer::Measurement measurement() {
    typename Observer::Measurement measurement;
    fill(measurement.c, 1.0);
    fill(measurement.y, 2.0);
    measurement.noise = positive<typename Observer::OutputCovariance>(0.05, 0.4);
    return measurement;
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// The largest difference between all that the two filters say, in units of 1 + |value|.
template <class Observer>
double difference(const Observer& ours, const typename Observer::Innovation& innovation,
                  const AugmentedFaultFilter<double>& reference) {
  double worst = 0;
  const auto compare = [&](double value, double expected) {
    worst = std::max(worst, std::abs(value - expected) / (1.0 + std::abs(expected)));
  };
  const auto n = static_cast<int>(ours.state().rows());
  const auto m = static_cast<int>(ours.fault().rows());
  const auto p = static_cast<int>(innovation.innovation.rows());
  const auto state_covariance = ours.state_covariance();
  const auto cross = ours.cross_covariance();
  for (int i = 0; i < n; ++i) {
    compare(ours.state()(i), reference.estimate()(i, 0));
    for (int j = 0; j < n; ++j) compare(state_covariance(i, j), reference.covariance()(i, j));
    for (int j = 0; j < m; ++j) compare(cross(i, j), reference.covariance()(i, n + j));
  }
  for (int i = 0; i < m; ++i) {
    compare(ours.fault()(i), reference.estimate()(n + i, 0));
    for (int j = 0; j < m; ++j) compare(ours.fault_covariance()(i, j), reference.covariance()(n + i, n + j));
  }
  for (int i = 0; i < p; ++i) {
    compare(innovation.innovation(i), reference.innovation()(i, 0));
    for (int j = 0; j < p; ++j) compare(innovation.covariance(i, j), reference.innovation_covariance()(i, j));
  }
  compare(innovation.nis, reference.nis());
  return worst;
}

template <int kStates, int kInputs, int kOutputs>
void expect_equal_over_random_systems(double fault_noise) {
  using Observer = MultiStageObserver<double, kStates, kInputs, kOutputs>;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    RandomSystem<Observer> random{seed};
    const auto prior = random.prior();
    Observer ours{prior};
    AugmentedFaultFilter<double> reference{prior};
    for (int k = 0; k < 200; ++k) {
      const auto model = random.transition(fault_noise);
      const auto measurement = random.measurement();
      typename Observer::Innovation innovation;
      ASSERT_EQ(ours.step(model, measurement, innovation), UpdateStatus::kFused);
      reference.predict(model);
      reference.correct(measurement);
      ASSERT_LT(difference(ours, innovation, reference), 1e-9)
          << kStates << ' ' << kInputs << ' ' << kOutputs << " seed " << seed << " step " << k;
    }
  }
}

TEST(MultiStageObserver, EqualsTheAugmentedFilterOverRandomTimeVaryingSystems) {
  for (const double fault_noise : {0.0, 1e-4, 1.0}) {
    expect_equal_over_random_systems<1, 1, 1>(fault_noise);
    expect_equal_over_random_systems<2, 1, 1>(fault_noise);
    expect_equal_over_random_systems<3, 1, 2>(fault_noise);
    expect_equal_over_random_systems<4, 6, 3>(fault_noise);
    expect_equal_over_random_systems<8, 4, 4>(fault_noise);
    expect_equal_over_random_systems<8, 8, 4>(fault_noise);
  }
}

TEST(MultiStageObserver, EqualsTheAugmentedFilterWhenMeasurementsAreRarerThanPredictions) {
  using Observer = MultiStageObserver<double, 4, 3, 2>;
  RandomSystem<Observer> random{7};
  const auto prior = random.prior();
  Observer ours{prior};
  AugmentedFaultFilter<double> reference{prior};
  Observer::Innovation innovation;
  for (int k = 0; k < 300; ++k) {
    const auto model = random.transition(0.01);
    ASSERT_EQ(ours.predict(model), UpdateStatus::kFused);
    reference.predict(model);
    if (k % 7 != 6) continue;
    const auto measurement = random.measurement();
    ASSERT_EQ(ours.correct(measurement, innovation), UpdateStatus::kFused);
    reference.correct(measurement);
    ASSERT_LT(difference(ours, innovation, reference), 1e-9) << k;
  }
}

/// The equations as they are usually printed: the fault-free filter keeps the noise Q, and its prediction takes no
/// notice of the fault. One state, one actuator, one output: all are numbers.
struct AsPrinted {
  double x = 0, p = 1, gamma = 0, p_gamma = 1, v = 0;
  double estimate = 0;

  void step(double a, double b, double u, double q, double q_gamma, double y, double r) {
    const double w = a * v - b * u;
    const double p_gamma_minus = p_gamma + q_gamma;
    const double v_minus = w * p_gamma / p_gamma_minus;
    const double p_minus = a * p * a + q;
    const double x_minus = a * x + b * u;
    const double k = p_minus / (p_minus + r);
    const double e = y - x_minus;
    x = x_minus + k * e;
    p = (1 - k) * p_minus;
    v = v_minus - k * v_minus;
    const double s = v_minus * p_gamma_minus * v_minus + p_minus + r;
    const double k_gamma = p_gamma_minus * v_minus / s;
    gamma += k_gamma * (e - v_minus * gamma);
    p_gamma = (1 - k_gamma * v_minus) * p_gamma_minus;
    estimate = x + v * gamma;
  }
};

double printed_error(double q_gamma) {
  using Observer = MultiStageObserver<double, 1, 1, 1>;
  Observer ours{Observer::Prior{}};
  AsPrinted printed;
  std::mt19937 random{11};
  std::normal_distribution<double> normal;
  double worst = 0;
  for (int k = 0; k < 100; ++k) {
    Observer::Transition model;
    model.a << 0.9;
    model.b << 0.5;
    model.u << 2.0 + normal(random);
    model.noise << 0.01;
    model.fault_noise_variance << q_gamma;
    Observer::Measurement measurement;
    measurement.c << 1.0;
    measurement.y << normal(random);
    measurement.noise << 0.1;
    Observer::Innovation innovation;
    EXPECT_EQ(ours.step(model, measurement, innovation), UpdateStatus::kFused);
    printed.step(0.9, 0.5, model.u(0), 0.01, q_gamma, measurement.y(0), 0.1);
    worst = std::max(
        {worst, std::abs(printed.estimate - ours.state()(0)), std::abs(printed.gamma - ours.fault()(0))});
  }
  return worst;
}

TEST(MultiStageObserver, ThePrintedEquationsAreExactOnlyForAConstantFault) {
  EXPECT_LT(printed_error(0.0), 1e-12);
  EXPECT_GT(printed_error(0.01), 0.01);
}

TEST(MultiStageObserver, WhatIsNotFiniteLeavesTheEstimateAsItWas) {
  using Observer = MultiStageObserver<double, 3, 2, 2>;
  RandomSystem<Observer> random{3};
  Observer observer{random.prior()};
  Observer::Innovation innovation;
  ASSERT_EQ(observer.step(random.transition(0.1), random.measurement(), innovation), UpdateStatus::kFused);
  const Observer before = observer;
  const auto expect_refused = [&](const Observer::Transition& model,
                                  const Observer::Measurement& measurement) {
    EXPECT_EQ(observer.step(model, measurement, innovation), UpdateStatus::kNotFinite);
    EXPECT_EQ(observer.state(), before.state());
    EXPECT_EQ(observer.fault(), before.fault());
    EXPECT_EQ(observer.fault_covariance(), before.fault_covariance());
    EXPECT_EQ(observer.state_covariance(), before.state_covariance());
  };
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200}) {
    auto model = random.transition(0.1);
    const auto measurement = random.measurement();
    model.u(1) = bad;
    expect_refused(model, measurement);
    model = random.transition(0.1);
    model.a(2, 1) = bad;
    expect_refused(model, measurement);
    model = random.transition(0.1);
    auto wrong = measurement;
    wrong.c(0, 2) = bad;
    expect_refused(model, wrong);
    if (std::isfinite(bad)) continue;  // a measurement far off is still one
    wrong = measurement;
    wrong.y(1) = bad;
    expect_refused(model, wrong);
  }
  auto measurement = random.measurement();
  measurement.noise(0, 0) = -1e6;
  expect_refused(random.transition(0.1), measurement);
  EXPECT_GT(observer.refused(), 10);
}

TEST(MultiStageObserver, AnActuatorThatIsNotUsedStaysUnknown) {
  using Observer = MultiStageObserver<double, 1, 2, 1>;
  Observer observer{Observer::Prior{}};
  Observer::Transition model;
  model.a << 0.5;
  model.b << 1.0, 1.0;
  model.u << 1.0, 0.0;
  model.noise << 1e-4;
  Observer::Measurement measurement;
  measurement.c << 1.0;
  measurement.noise << 1e-4;
  Observer::Innovation innovation;
  double x = 0.0;
  for (int k = 0; k < 500; ++k) {
    x = 0.5 * x + 0.7;  // actuator 1 has lost 0.3
    measurement.y << x;
    ASSERT_EQ(observer.step(model, measurement, innovation), UpdateStatus::kFused);
  }
  EXPECT_NEAR(observer.fault()(0), 0.3, 0.01);
  EXPECT_LT(observer.fault_covariance()(0, 0), 1e-4);
  EXPECT_EQ(observer.fault()(1), 0.0);
  EXPECT_EQ(observer.fault_covariance()(1, 1), 1.0);
}

TEST(MultiStageObserver, NisIsAsLargeAsItShouldBe) {
  using Observer = MultiStageObserver<double, 2, 1, 2>;
  std::mt19937 random{5};
  std::normal_distribution<double> normal;
  Observer observer{Observer::Prior{}};
  Eigen::Vector2d x{normal(random), normal(random)};
  double gamma = normal(random);
  double sum = 0;
  constexpr int kSteps = 4000;
  for (int k = 0; k < kSteps; ++k) {
    Observer::Transition model;
    model.a << 0.95, 0.1, -0.1, 0.9;
    model.b << 0.0, 0.5;
    model.u << 1.0 + std::sin(0.05 * k);
    model.noise = 0.01 * Eigen::Matrix2d::Identity();
    model.fault_noise_variance << 1e-4;
    x = model.a * x + model.b * model.u * (1 - gamma) + 0.1 * Eigen::Vector2d{normal(random), normal(random)};
    gamma += 0.01 * normal(random);
    Observer::Measurement measurement;
    measurement.c.setIdentity();
    measurement.noise = 0.04 * Eigen::Matrix2d::Identity();
    measurement.y = x + 0.2 * Eigen::Vector2d{normal(random), normal(random)};
    Observer::Innovation innovation;
    ASSERT_EQ(observer.step(model, measurement, innovation), UpdateStatus::kFused);
    sum += innovation.nis;
  }
  // χ² of 2·4000 degrees: σ of the sum 126; the band is ±4σ.
  EXPECT_NEAR(sum, 2.0 * kSteps, 4 * std::sqrt(4.0 * kSteps));
}

TEST(MultiStageObserver, FloatTracksDoubleWithoutTheHeap) {
  using Wide = MultiStageObserver<double, 4, 4, 4>;
  using Narrow = MultiStageObserver<float, 4, 4, 4>;
  RandomSystem<Wide> random{9};
  const auto prior = random.prior();
  Wide wide{prior};
  Narrow narrow{{.state = prior.state.cast<float>(),
                 .state_covariance = prior.state_covariance.cast<float>(),
                 .fault = prior.fault.cast<float>(),
                 .fault_variance = prior.fault_variance.cast<float>()}};
  Wide::Innovation innovation;
  Narrow::Innovation innovation_float;
  for (int k = 0; k < 500; ++k) {
    const auto model = random.transition(0.001);
    const auto measurement = random.measurement();
    const Narrow::Transition model_float{model.a.cast<float>(),     model.b.cast<float>(),
                                         model.u.cast<float>(),     model.known.cast<float>(),
                                         model.noise.cast<float>(), model.fault_noise_variance.cast<float>()};
    const Narrow::Measurement measurement_float{measurement.c.cast<float>(), measurement.y.cast<float>(),
                                                measurement.noise.cast<float>()};
    const test::AllocationGuard guard;
    ASSERT_EQ(wide.step(model, measurement, innovation), UpdateStatus::kFused);
    ASSERT_EQ(narrow.step(model_float, measurement_float, innovation_float), UpdateStatus::kFused);
    ASSERT_EQ(guard.allocations(), 0);
    ASSERT_LT((narrow.fault().cast<double>() - wide.fault()).norm(), 2e-3) << k;
    ASSERT_LT((narrow.state().cast<double>() - wide.state()).norm(), 2e-3) << k;
  }
}

template <bool kBlocks>
void expect_thrifty_equal() {
  using Observer = MultiStageObserver<double, 4, 3, 2>;
  RandomSystem<Observer> random{13};
  const auto prior = random.prior();
  Observer ours{prior};
  ThriftyFaultFilter<double, 4, 3, 2, kBlocks> thrifty{prior};
  Observer::Innovation innovation;
  for (int k = 0; k < 100; ++k) {
    const auto model = random.transition(0.1);
    const auto measurement = random.measurement();
    ASSERT_EQ(ours.step(model, measurement, innovation), UpdateStatus::kFused);
    thrifty.predict(model);
    thrifty.correct(measurement);
    ASSERT_NEAR(thrifty.nis(), innovation.nis, 1e-9 * (1 + innovation.nis));
    for (int j = 0; j < 3; ++j) ASSERT_NEAR(thrifty.estimate()(4 + j), ours.fault()(j), 1e-9);
  }
}

TEST(MultiStageObserver, TheFiltersItIsCountedAgainstComputeTheSame) {
  expect_thrifty_equal<false>();
  expect_thrifty_equal<true>();
}

}  // namespace
}  // namespace airworthy
