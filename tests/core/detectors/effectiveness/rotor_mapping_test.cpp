#include "core/detectors/effectiveness/rotor_mapping.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace airworthy::effectiveness {
namespace {

constexpr double kStep_s = 0.002;
constexpr double kInterval_s = 0.05;

EffectivenessMatrix<double> quad() {
  EffectivenessMatrix<double> matrix;
  matrix.rotor_count = 4;
  matrix.per_speed2[kRollRow] = {1e-4, -1e-4, -1e-4, 1e-4};
  matrix.per_speed2[kPitchRow] = {0.8e-4, 0.8e-4, -0.8e-4, -0.8e-4};
  matrix.per_speed2[kVerticalRow] = {-4e-6, -4e-6, -4e-6, -4e-6};
  return matrix;
}

/// Sums of a flight of a vehicle that answers as `real` with noise on the rates.
ControlRegression<double> flown(const EffectivenessMatrix<double>& real, double seconds, double noise_rad_s) {
  ControlRegression<double> regression{4, kInterval_s};
  std::mt19937 random{6};
  std::normal_distribution normal;
  std::array<double, 3> rate{};
  std::array<double, 4> speed{600.0, 600.0, 600.0, 600.0};
  for (double t = 0.0; t < seconds; t += kStep_s) {
    for (std::size_t i = 0; i < 4; ++i)
      speed[i] += kStep_s / 0.1 * (600.0 + 100.0 * normal(random) * 5.0 - speed[i]);
    double vertical = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      rate[0] += kStep_s * real.per_speed2[kRollRow][i] * speed[i] * speed[i];
      rate[1] += kStep_s * real.per_speed2[kPitchRow][i] * speed[i] * speed[i];
      vertical += real.per_speed2[kVerticalRow][i] * speed[i] * speed[i];
    }
    regression.add(kStep_s, speed,
                   {rate[0] + noise_rad_s * normal(random), rate[1] + noise_rad_s * normal(random), 0.0},
                   vertical);
  }
  return regression;
}

constexpr double kThreshold = 20.0;

RotorMapping<double>::Verdict judged(const ControlRegression<double>& regression,
                                     const EffectivenessMatrix<double>& described) {
  return RotorMapping<double>::judge(regression, described, kThreshold);
}

TEST(ControlRegression, FindsTheGainOfAnAxis) {
  EffectivenessMatrix<double> real = quad();
  for (double& one : real.per_speed2[kRollRow]) one *= 1.3;
  for (double& one : real.per_speed2[kPitchRow]) one *= 0.7;
  const auto regression = flown(real, 60.0, 0.0);
  EXPECT_NEAR(regression.sums(kRollRow).gain(quad().per_speed2[kRollRow], 4), 1.3, 0.02);
  EXPECT_NEAR(regression.sums(kPitchRow).gain(quad().per_speed2[kPitchRow], 4), 0.7, 0.02);
  EXPECT_NEAR(regression.sums(kVerticalRow).gain(quad().per_speed2[kVerticalRow], 4), 1.0, 0.01);
  EXPECT_GT(regression.sums(kRollRow).explained(quad().per_speed2[kRollRow], 4), 0.95);
}

TEST(RotorMapping, TellsTheDescribedNumberingFromOthers) {
  EXPECT_EQ(judged(flown(quad(), 20.0, 0.02), quad()).mapping, Mapping::kPlausible);
  EffectivenessMatrix<double> swapped = quad();
  for (auto& row : swapped.per_speed2) std::swap(row[0], row[2]);
  const auto named = judged(flown(quad(), 20.0, 0.02), swapped);
  EXPECT_EQ(named.mapping, Mapping::kWrongNumbers);
  EXPECT_THAT(std::vector(named.order.begin(), named.order.begin() + 4), testing::ElementsAre(2, 1, 0, 3));
  EffectivenessMatrix<double> shifted = quad();
  for (auto& row : shifted.per_speed2) std::rotate(row.begin(), row.begin() + 1, row.begin() + 4);
  EXPECT_EQ(judged(flown(quad(), 20.0, 0.02), shifted).mapping, Mapping::kWrongNumbers);
  EffectivenessMatrix<double> mirrored = quad();
  for (double& one : mirrored.per_speed2[kRollRow]) one = -one;
  EXPECT_EQ(judged(flown(quad(), 20.0, 0.02), mirrored).mapping, Mapping::kWrongNumbers);
}

TEST(RotorMapping, SaysNothingWithoutInformation) {
  EXPECT_EQ(judged(flown(quad(), 0.5, 0.02), quad()).mapping, Mapping::kUnknown) << "too short";
  EXPECT_EQ(judged(flown(quad(), 20.0, 20.0), quad()).mapping, Mapping::kUnknown) << "too noisy";
}

TEST(RotorMapping, ALostRotorIsNoNumbering) {
  EffectivenessMatrix<double> lost = quad();
  for (auto& row : lost.per_speed2) row[3] = 0.0;
  EXPECT_NE(judged(flown(lost, 20.0, 0.02), quad()).mapping, Mapping::kWrongNumbers);
}

}  // namespace
}  // namespace airworthy::effectiveness
