#include "core/estimators/effectiveness/thrust_regression.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/allocation_guard.h"

namespace airworthy {
namespace {

constexpr double kStep_s = 0.002;
constexpr double kLift_m_s2 = 2.45;
constexpr std::array<std::array<double, 3>, 4> kPerRotor{{{-44.0, 44.0, -kLift_m_s2},
                                                          {44.0, 44.0, -kLift_m_s2},
                                                          {44.0, -44.0, -kLift_m_s2},
                                                          {-44.0, -44.0, -kLift_m_s2}}};

template <class Scalar>
ThrustRegressionParams<Scalar> params() {
  ThrustRegressionParams<Scalar> result;
  result.rotor_count = 4;
  result.authority = {44, 44, Scalar(kLift_m_s2)};
  result.offset_rad_s2_per_m_s2 = {25, 25};
  return result;
}

/// A body whose rotors give what `effectiveness` says, beside what is described; thrusts wander by a tenth.
template <class Scalar>
class Flight {
 public:
  std::array<double, 4> effectiveness{1.0, 1.0, 1.0, 1.0};
  double late_s = 0.0;  ///< what is described comes so much too late
  ThrustRegression<Scalar> regression{params<Scalar>()};

  void fly(double seconds) {
    for (double t = 0.0; t < seconds; t += kStep_s) {
      ThrustSample<Scalar> sample;
      sample.dt_s = Scalar(kStep_s);
      std::array<double, 3> real{};
      for (std::size_t i = 0; i < 4; ++i) {
        const double change = kStep_s / 0.15 * (1.0 - thrust_[i] + 1.2 * normal_(random_));
        thrust_[i] += change;
        const double described = thrust_[i] - late_s / kStep_s * change;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          real[axis] += effectiveness[i] * thrust_[i] * kPerRotor[i][axis];
          sample.contribution[i][axis] = static_cast<Scalar>(described * kPerRotor[i][axis]);
        }
        sample.lift_m_s2 += sample.contribution[i][2];
      }
      for (std::size_t axis = 0; axis < 2; ++axis) {
        rate_[axis] += kStep_s * (real[axis] - 5.0 * rate_[axis]);  // somebody keeps it from spinning ...
        sample.gyroscopic_rad_s2[axis] = static_cast<Scalar>(-5.0 * rate_[axis]);  // ... and is known
        sample.rate_rad_s[axis] = static_cast<Scalar>(rate_[axis] + 0.02 * normal_(random_));
      }
      sample.vertical_m_s2 = static_cast<Scalar>(real[2] + 0.5 * normal_(random_));
      if (!started_) regression.start(sample.rate_rad_s);
      started_ = true;
      regression.step(sample);
    }
  }

 private:
  std::mt19937 random_{31};
  std::normal_distribution<> normal_;
  std::array<double, 4> thrust_{1.0, 1.0, 1.0, 1.0};
  std::array<double, 2> rate_{};
  bool started_ = false;
};

TEST(ThrustRegression, ReadsTheRotorThatGivesMore) {
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    Flight<double> flight;
    flight.effectiveness[rotor] = 1.3;
    flight.fly(60.0);
    const auto deviations = flight.regression.deviations();
    ASSERT_TRUE(deviations);
    const auto& one = (*deviations)[rotor];
    EXPECT_NEAR(one.mean, 0.3, 0.06);
    EXPECT_LT(one.variance, 0.05 * 0.05);
    // (5) by hand.
    EXPECT_NEAR(one.evidence, one.mean * one.mean / (2.0 * (one.variance + 0.04 * 0.04)), 1e-12);
    for (std::size_t other = 0; other < 4; ++other) {
      if (other == rotor) continue;
      EXPECT_LT((*deviations)[other].evidence, one.evidence - 8.0) << other;
    }
  }
}

TEST(ThrustRegression, WhatAllRotorsShareIsNobodys) {
  for (const double excess : {0.75, 1.3}) {
    Flight<double> flight;
    flight.effectiveness.fill(excess);
    flight.fly(60.0);
    const auto deviations = flight.regression.deviations();
    ASSERT_TRUE(deviations);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((*deviations)[i].evidence, 6.0) << excess << " " << i;
  }
}

TEST(ThrustRegression, LateSpeedsAreNobodys) {
  Flight<double> flight;
  flight.late_s = 0.005;
  flight.fly(60.0);
  const auto deviations = flight.regression.deviations();
  ASSERT_TRUE(deviations);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((*deviations)[i].evidence, 3.0) << i;
}

TEST(ThrustRegression, KnowsNothingBeforeItHasSeenSomething) {
  ThrustRegression<double> regression{params<double>()};
  regression.start({});
  const auto deviations = regression.deviations();
  ASSERT_TRUE(deviations);
  for (const auto& one : *deviations) EXPECT_LT(one.evidence, 1e-9);
}

TEST(ThrustRegression, FloatTracksDouble) {
  Flight<double> exact;
  Flight<float> rounded;
  exact.effectiveness[1] = rounded.effectiveness[1] = 1.4;
  exact.fly(30.0);
  rounded.fly(30.0);
  const auto a = exact.regression.deviations();
  const auto b = rounded.regression.deviations();
  ASSERT_TRUE(a && b);
  EXPECT_NEAR((*a)[1].mean, static_cast<double>((*b)[1].mean), 0.01);
}

TEST(ThrustRegression, UsesNoHeap) {
  Flight<double> flight;
  const test::AllocationGuard guard;
  flight.fly(1.0);
  static_cast<void>(flight.regression.deviations());
  EXPECT_EQ(guard.allocations(), 0U);
}

}  // namespace
}  // namespace airworthy
