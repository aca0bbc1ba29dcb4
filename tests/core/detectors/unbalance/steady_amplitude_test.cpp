#include "core/detectors/unbalance/steady_amplitude.h"

#include <gtest/gtest.h>

#include <random>

namespace airworthy {
namespace {

constexpr double kStep_s = 0.1;
constexpr double kSigma = 0.2;

/// Adds an amplitude in noise whose variance is taken off, as the monitor does.
class Rotor {
 public:
  void fly(double amplitude, double duration_s) {
    std::normal_distribution<double> normal{0.0, kSigma};
    for (double t = 0.0; t < duration_s; t += kStep_s) {
      const double re = amplitude + normal(random_);
      const double im = normal(random_);
      steady.add(re * re + im * im - 2.0 * kSigma * kSigma, kSigma, amplitude, kStep_s);
    }
  }
  SteadyAmplitude steady;

 private:
  std::mt19937 random_{5};
};

TEST(SteadyAmplitude, IsTheMeanAndItsSigmaFalls) {
  Rotor rotor;
  rotor.fly(1.0, 1.0);
  const double at_first = rotor.steady.sigma_m_s2();
  rotor.fly(1.0, 60.0);
  EXPECT_NEAR(rotor.steady.amplitude_m_s2(), 1.0, 0.05);
  EXPECT_LT(rotor.steady.sigma_m_s2(), 0.4 * at_first);
}

TEST(SteadyAmplitude, HasNoValueBeforeItWasGivenOne) {
  Rotor rotor;
  EXPECT_FALSE(rotor.steady.has_value());
  rotor.fly(1.0, kStep_s);
  EXPECT_TRUE(rotor.steady.has_value());
  rotor.steady.restart();
  EXPECT_FALSE(rotor.steady.has_value());
}

TEST(SteadyAmplitude, OfNothingButNoiseIsNearlyNothing) {
  Rotor rotor;
  rotor.fly(0.0, 60.0);
  EXPECT_LT(rotor.steady.amplitude_m_s2(), kSigma);
}

TEST(SteadyAmplitude, FollowsAChangeAtOnceAndDoubtsItselfAgain) {
  Rotor rotor;
  rotor.fly(1.0, 60.0);
  const double sure = rotor.steady.sigma_m_s2();
  rotor.fly(3.0, 3.0);
  EXPECT_NEAR(rotor.steady.amplitude_m_s2(), 3.0, 0.2);
  EXPECT_GT(rotor.steady.sigma_m_s2(), 1.5 * sure);
}

}  // namespace
}  // namespace airworthy
