#include "core/detectors/unbalance/power_policy.h"

#include <gtest/gtest.h>

#include <cmath>

namespace airworthy {
namespace {

using Policy = PowerPolicy<4>;
using Rotors = Policy::Rotors;

constexpr double kReference_kg_m = 2e-6;
constexpr double kSmallest_kg_m = 1e-6;
constexpr Rotors kBaseline_kg_m{2e-6, 1e-6, 0.0, 2e-6};
constexpr Rotors kHealthy{1.0, 0.25, 0.0, 1.0};  // (U/U₀)²
constexpr Rotors kSure{1e4, 1e4, 1e4, 1e4};      // σ = 0.01
constexpr double kStep_s = 0.1;

/// Asked for `duration_s`; the last verdict.
Policy::Verdict after(const Rotors& power, const Rotors& information, double duration_s,
                      double learned_s = 60.0) {
  Policy policy{kReference_kg_m, kBaseline_kg_m, kSmallest_kg_m};
  Policy::Verdict verdict;
  for (int k = 0; k < std::lround(duration_s / kStep_s); ++k)
    verdict = policy.judge(power, information, learned_s, kStep_s);
  return verdict;
}

int count(const Policy::Verdict& verdict) {
  int named = 0;
  for (const bool is_named : verdict.is_named) named += is_named ? 1 : 0;
  return named;
}

TEST(PowerPolicy, NamesWhatHasGrownForLongEnough) {
  Rotors power = kHealthy;
  power[1] = 4.0;  // from 1e-6 to 4e-6 kg·m
  const auto verdict = after(power, kSure, 1.2);
  EXPECT_TRUE(verdict.is_named[1]);
  EXPECT_EQ(count(verdict), 1);
  EXPECT_NEAR(verdict.unbalance_kg_m[1], 4e-6, 1e-15);
  EXPECT_NEAR(verdict.growth_kg_m[1], 3e-6, 1e-15);
  EXPECT_NEAR(verdict.sigma_kg_m[1], 1e-6 * 0.01 / (2.0 * 1.0), 1e-10);  // U₀²·σ/(2U)
  EXPECT_EQ(count(after(power, kSure, 0.8)), 0);
}

TEST(PowerPolicy, NamesNobodyOfAHealthyVehicle) {
  EXPECT_EQ(count(after(kHealthy, kSure, 10.0)), 0);
  // Noise may make a power negative.
  EXPECT_EQ(count(after({1.0, 0.25, -0.3, 1.0}, kSure, 10.0)), 0);
}

TEST(PowerPolicy, APowerWithinItsDoubtOfZeroIsNotSurelyZero) {
  // σ = 0.01 of the power: an unbalance of up to U₀·√0.01 would not be told from none.
  EXPECT_NEAR(after({-0.3, 0.0, 0.0, 0.0}, kSure, 1.0).sigma_kg_m[0], 0.1 * kReference_kg_m, 1e-15);
  EXPECT_NEAR(after(kHealthy, kSure, 1.0).sigma_kg_m[2], 0.1 * kReference_kg_m, 1e-15);
  // As much above as a hair below one sigma: up to √0.02 from none at all.
  EXPECT_NEAR(after({0.01, 0.0, 0.0, 0.0}, kSure, 1.0).sigma_kg_m[0], std::sqrt(0.02) * kReference_kg_m,
              1e-15);
}

TEST(PowerPolicy, NamesNobodyBeforeItHasLearned) {
  Rotors power = kHealthy;
  power[1] = 4.0;
  EXPECT_EQ(count(after(power, kSure, 10.0, Policy::kLeast_s - 0.1)), 0);
  EXPECT_EQ(count(after(power, kSure, 10.0, Policy::kLeast_s)), 1);
}

TEST(PowerPolicy, AGrowthWithinTheDoubtNamesNobody) {
  Rotors power = kHealthy;
  power[1] = 4.0;
  // Two sigma below must still be 2e-6 kg·m, a power of 1: σ below 1.5.
  EXPECT_EQ(count(after(power, {1e4, 1.0 / (1.6 * 1.6), 1e4, 1e4}, 10.0)), 0);
  EXPECT_EQ(count(after(power, {1e4, 1.0 / (1.4 * 1.4), 1e4, 1e4}, 10.0)), 1);
  const auto unknown = after(power, {0.0, 0.0, 0.0, 0.0}, 10.0);
  EXPECT_EQ(count(unknown), 0);
}

TEST(PowerPolicy, WhatMayBeAnothersIsNotNamed) {
  Rotors power = kHealthy;
  power[1] = 30.0;  // grows by 9.95e-6
  power[2] = 7.0;   // grows by 5.29e-6: less than half of that and the smallest growth
  const auto leaked = after(power, kSure, 10.0);
  EXPECT_TRUE(leaked.is_named[1]);
  EXPECT_FALSE(leaked.is_named[2]);
  power[2] = 20.0;  // by 8.9e-6
  const auto two = after(power, kSure, 10.0);
  EXPECT_TRUE(two.is_named[1]);
  EXPECT_TRUE(two.is_named[2]);
}

}  // namespace
}  // namespace airworthy
