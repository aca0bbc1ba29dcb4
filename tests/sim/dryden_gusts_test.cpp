#include "sim/dynamics/dryden_gusts.h"

#include <gtest/gtest.h>

#include <cmath>

namespace airworthy::sim {
namespace {

struct Moments {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();
  double correlation_u = 0.0;  ///< of u with itself `lag` later
};

Moments moments_of(const Eigen::Vector3d& wind, double height_m, double airspeed_m_s, double step_s,
                   int steps, int lag) {
  DrydenGusts gusts{wind, Random{7, "gusts"}};
  std::vector<double> u;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (int i = 0; i < steps; ++i) {
    const Eigen::Vector3d now = gusts.step(height_m, airspeed_m_s, step_s);
    sum += now;
    squares += now.cwiseProduct(now);
    u.push_back(now.x());
  }
  Moments result;
  result.mean = sum / steps;
  result.sigma = (squares / steps - result.mean.cwiseProduct(result.mean)).cwiseSqrt();
  double product = 0.0;
  for (std::size_t i = 0; i + static_cast<std::size_t>(lag) < u.size(); ++i) {
    product += (u[i] - result.mean.x()) * (u[i + static_cast<std::size_t>(lag)] - result.mean.x());
  }
  result.correlation_u = product / static_cast<double>(u.size()) / (result.sigma.x() * result.sigma.x());
  return result;
}

TEST(DrydenGusts, HaveTheIntensityAndLengthOfTheirSpecification) {
  // At 20 ft with 10 m/s: σ_w = 1 m/s, σ_u = σ_v = 1/(0.177 + 0.000823·20)^0.4 m/s, L_u = 20/(…)^1.2 ft.
  const double height_m = 20.0 * 0.3048;
  const double shape = 0.177 + 0.000823 * 20.0;
  const double length_m = 20.0 / std::pow(shape, 1.2) * 0.3048;
  const double airspeed = 10.0;
  const double step_s = 0.02;
  const int lag = static_cast<int>(std::lround(length_m / airspeed / step_s));
  const Moments found = moments_of({10.0, 0.0, 0.0}, height_m, airspeed, step_s, 3'000'000, lag);
  EXPECT_NEAR(found.mean.x(), 10.0, 0.15);
  EXPECT_NEAR(found.mean.y(), 0.0, 0.15);
  EXPECT_NEAR(found.sigma.x(), std::pow(shape, -0.4), 0.03 * std::pow(shape, -0.4));
  EXPECT_NEAR(found.sigma.y(), std::pow(shape, -0.4), 0.03 * std::pow(shape, -0.4));
  EXPECT_NEAR(found.sigma.z(), 1.0, 0.03);
  // u is a first-order process: its correlation falls to 1/e over its length.
  EXPECT_NEAR(found.correlation_u, std::exp(-1.0), 0.03);
}

TEST(DrydenGusts, AreThoseOfTheWindWhateverItsDirection) {
  const Moments found = moments_of({0.0, -10.0, 0.0}, 20.0 * 0.3048, 10.0, 0.02, 300'000, 1);
  EXPECT_NEAR(found.mean.y(), -10.0, 0.5);
  EXPECT_NEAR(found.mean.x(), 0.0, 0.5);
}

TEST(DrydenGusts, FadeTowardTheGroundAndAreNoneInACalm) {
  EXPECT_EQ(moments_of({0.0, 0.0, 0.0}, 5.0, 1.0, 0.01, 100, 1).sigma.norm(), 0.0);
  const Moments low = moments_of({10.0, 0.0, 0.0}, 0.04, 1.0, 0.01, 10'000, 1);
  EXPECT_EQ(low.mean.norm(), 0.0);
  EXPECT_EQ(low.sigma.norm(), 0.0);
}

}  // namespace
}  // namespace airworthy::sim
