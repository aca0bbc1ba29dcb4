#include "core/estimators/unbalance/rotor_bands.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "core/estimators/unbalance/signal_power_ekf.h"
#include "tests/support/reference/dense_rotor_bands.h"
#include "tests/support/signal_power_checks.h"
#include "tests/support/unbalance_flight.h"

namespace airworthy {
namespace {

using test::DenseRotorBands;
using test::fly;
using test::kHexa;
using test::kMedium;
using test::kSmall;
using test::ModelFlight;
using test::PaperVehicle;

template <class Scalar, std::size_t N>
using InBands = SignalPowerEkf<Scalar, N, RotorBands<Scalar, N>>;

// As ModelFlight has them: the first turns clockwise, the next the other way.
int spin_of(std::size_t rotor) { return rotor % 2 == 0 ? 1 : -1; }

SignalPowerParams in_bands(const PaperVehicle& vehicle) {
  SignalPowerParams params = test::params_of(vehicle);
  params.expect_nothing();
  for (std::size_t i = 0; i < vehicle.rotors; ++i) params.bands.spin[i] = spin_of(i);
  return params;
}

// Forces that wander by a tenth within half a second, so speeds by a twentieth.
constexpr ModelFlight<4>::Options kCalm{.force_ratio = 0.1, .correlation_s = 0.5, .noise_m_s2 = 0.5};
constexpr ModelFlight<6>::Options kCalmHexa{.force_ratio = 0.1, .correlation_s = 0.5, .noise_m_s2 = 0.5};

/// Makes the speeds of a sample wrong by a common factor.
auto scaled(double factor) {
  return [factor](auto& sample) {
    for (auto& speed : sample.speed_rad_s) speed *= factor;
  };
}

template <std::size_t N>
double read_mg(const InBands<double, N>& ekf, const PaperVehicle& vehicle, std::size_t rotor) {
  return vehicle.initial_tip_mass_mg * std::sqrt(std::max(0.0, ekf.isolation().power[rotor]));
}

// (1) to (5) against what they say: mean power in each band of one rotor whose phase walks as in (2), at speeds that
// cross, and of white noise.
TEST(RotorBands, GainsAreMeanPowersOverRandomPhases) {
  SignalPowerParams params = in_bands(kMedium);
  constexpr std::size_t kSource = 1;
  constexpr int kDraws = 4000;
  constexpr int kSteps = 400;
  const auto speeds_at = [](int step) {
    const double t = 0.002 * step;
    return std::array{480.0 + 40.0 * std::sin(9.0 * t), 470.0, 455.0 + 60.0 * t,
                      440.0 + 30.0 * std::sin(4.0 * t)};
  };
  std::mt19937_64 random{3};
  std::normal_distribution<double> normal;
  std::array<double, 4> of_rotor{};
  std::array<double, 4> of_noise{};
  RotorBands<double, 4>::Readings reading;
  for (int draw = 0; draw < kDraws; ++draw) {
    RotorBands<double, 4> bands{params};
    RotorBands<double, 4> noisy{params};
    double phase = std::uniform_real_distribution<double>{0.0, 2.0 * std::numbers::pi}(random);
    RotorBands<double, 4>::Readings noise;
    for (int step = 0; step < kSteps; ++step) {
      const auto speeds = speeds_at(step);
      const double speed = speeds[kSource];
      phase += spin_of(kSource) * speed * 0.002 +
               std::sqrt(2.0 * params.bands.speed_error_ratio * speed * 0.002) * normal(random);
      const double a = params.reference_m() * speed * speed;
      reading = bands.step({a * std::cos(phase), a * std::sin(phase)}, speeds, 0.002);
      noise = noisy.step({normal(random), normal(random)}, speeds, 0.002);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      of_rotor[i] += reading[i].power_m2_s4 / kDraws;
      of_noise[i] += noise[i].power_m2_s4 / kDraws;
    }
  }
  // What is nearly exponential has a standard error of its mean over √n.
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(of_rotor[i], reading[i].gain_m2_s4[kSource], 5.0 / std::sqrt(kDraws) * of_rotor[i]) << i;
    EXPECT_NEAR(of_noise[i], reading[i].noise_gain, 5.0 / std::sqrt(kDraws) * of_noise[i]) << i;
  }
  // The band of another sense of rotation holds next to nothing, that of the rotor half: the line is as wide as a band.
  EXPECT_LT(reading[0].gain_m2_s4[kSource], 0.01 * reading[kSource].gain_m2_s4[kSource]);
  const double whole = std::pow(params.reference_m() * 470.0 * 470.0, 2);
  EXPECT_NEAR(reading[kSource].gain_m2_s4[kSource], 0.5 * whole, 0.02 * whole);
}

template <std::size_t N>
void compare_with_dense(const PaperVehicle& vehicle, const std::array<double, N>& tip_mass_mg,
                        const typename ModelFlight<N>::Options& options, double speed_factor) {
  SignalPowerParams params = in_bands(vehicle);
  params.innovation_limit_sigma = std::numeric_limits<double>::infinity();
  InBands<double, N> ekf{params};
  DenseRotorBands::Params dense_params;
  dense_params.reference_m = params.reference_m();
  for (std::size_t i = 0; i < N; ++i) dense_params.spin.push_back(spin_of(i));
  DenseRotorBands dense{dense_params};
  ModelFlight<N> flight{vehicle, tip_mass_mg, 21, options};
  typename InBands<double, N>::Innovation innovation;
  double worst = 0.0;
  while (flight.time_s < 60.0) {
    flight.step();
    auto sample = test::sample_of<InBands<double, N>>(flight);
    scaled(speed_factor)(sample);
    dense.update(to_seconds(sample.time - TimePoint{}), sample.ax_m_s2, sample.ay_m_s2,
                 Eigen::Map<const Eigen::VectorXd>(sample.speed_rad_s.data(), N));
    if (ekf.update(sample, innovation) != UpdateStatus::kFused) continue;
    for (std::size_t i = 0; i <= N; ++i) {
      const auto a = static_cast<Eigen::Index>(i);
      worst = std::max(worst, std::abs(ekf.state()[i] - dense.x(a)));
      worst = std::max(worst, std::abs(ekf.covariance()[i][i] - dense.p(a, a)) / dense.p(a, a));
      worst = std::max(worst, std::abs(ekf.information()[i][i] - dense.information(a, a)) /
                                  (1e-6 + dense.information(a, a)));
    }
    worst = std::max(worst, std::abs(innovation.nis - dense.nis));
    worst = std::max(worst, std::abs(ekf.bank().speed_scale() - dense.scale));
  }
  EXPECT_LT(worst, 1e-9);
  EXPECT_EQ(ekf.limits().innovation + ekf.limits().state + ekf.limits().variance, 0);
  const auto told = ekf.isolation();
  const Eigen::VectorXd powers = dense.powers();
  for (std::size_t i = 0; i < N; ++i) {
    EXPECT_NEAR(told.power[i], powers(static_cast<Eigen::Index>(i)), 1e-8 * powers.cwiseAbs().maxCoeff());
  }
}

TEST(RotorBands, TheFilterEqualsTheDenseTextbookOne) {
  compare_with_dense<4>(kSmall, {0.3, 5.0, 0.5, 0.2}, kCalm, 1.0);
  compare_with_dense<4>(kMedium, {5.0, 3.0, 40.0, 8.0}, kCalm, 1.03);
  compare_with_dense<6>(kHexa, {5.0, 40.0, 4.0, 3.0, 6.0, 5.0}, kCalmHexa, 0.98);
}

// One rotor that shakes eight times as much as the others, its speed known to a part in a hundred.
template <std::size_t N>
void expect_found(const PaperVehicle& vehicle, double damage_mg, double good_mg, double within_s,
                  double speed_factor, const typename ModelFlight<N>::Options& options) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    InBands<double, N> ekf{in_bands(vehicle)};
    ModelFlight<N> flight{vehicle, test::one_damaged<N>(damage_mg, good_mg), seed, options};
    fly(ekf, flight, within_s, scaled(speed_factor));
    // A line narrower than a band reads up to √2 high, and these few seconds have their own scatter.
    EXPECT_GT(read_mg(ekf, vehicle, 1), 0.8 * damage_mg) << "seed " << seed;
    EXPECT_LT(read_mg(ekf, vehicle, 1), 1.75 * damage_mg) << "seed " << seed;
    for (std::size_t i = 0; i < N; ++i) {
      EXPECT_TRUE(i == 1 || read_mg(ekf, vehicle, i) < 0.5 * read_mg(ekf, vehicle, 1)) << seed << ' ' << i;
    }
  }
}

TEST(RotorBands, FindTheDamageInSeconds) {
  expect_found<4>(kMedium, 40.0, 5.0, 10.0, 1.0, kCalm);
  expect_found<4>(kMedium, 40.0, 5.0, 20.0, 0.98, kCalm);
  expect_found<6>(kHexa, 40.0, 5.0, 20.0, 1.0, kCalmHexa);
}

// At 500 Hz half the rate is 250 Hz: the small vehicle turns at 242 Hz, one twice as heavy at 342 Hz, seen at −158 Hz.
TEST(RotorBands, FindTheDamageBeyondHalfTheRateOfSampling) {
  expect_found<4>(kSmall, 5.0, 0.6, 10.0, 1.0, kCalm);
  PaperVehicle fast = kSmall;
  fast.mass_kg *= 2.0;
  expect_found<4>(fast, 10.0, 1.2, 10.0, 1.0, kCalm);
}

TEST(RotorBands, TakeWhatAllSpeedsShare) {
  for (const double factor : {0.97, 1.02}) {
    InBands<double, 4> ekf{in_bands(kMedium)};
    ModelFlight<4> flight{kMedium, {20.0, 40.0, 10.0, 5.0}, 5, kCalm};
    fly(ekf, flight, 40.0, scaled(factor));
    EXPECT_NEAR(ekf.bank().speed_scale() * factor, 1.0, 0.004);
  }
}

TEST(RotorBands, RenumberedRotorsGiveRenumberedAnswers) {
  constexpr std::array<std::size_t, 6> kOrder{3, 0, 5, 1, 4, 2};
  SignalPowerParams params = in_bands(kHexa);
  InBands<double, 6> ekf{params};
  for (std::size_t i = 0; i < 6; ++i) params.bands.spin[i] = spin_of(kOrder[i]);
  InBands<double, 6> renumbered{params};
  ModelFlight<6> flight{kHexa, {5.0, 40.0, 4.0, 3.0, 6.0, 5.0}, 31, kCalmHexa};
  test::fly_renumbered(ekf, renumbered, flight, 30.0, kOrder);
  // Sums of rounded numbers depend on their order, hence not to the bit.
  const auto told = ekf.isolation();
  const auto other = renumbered.isolation();
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(other.power[i], told.power[kOrder[i]], 1e-8 * told.power[1]);
    EXPECT_NEAR(renumbered.state()[i], ekf.state()[kOrder[i]], 1e-9);
  }
}

TEST(RotorBands, FloatTracksDouble) {
  InBands<double, 4> ekf{in_bands(kSmall)};
  InBands<float, 4> single{in_bands(kSmall)};
  ModelFlight<4> flight{kSmall, {0.5, 0.3, 5.0, 0.8}, 41, kCalm};
  ModelFlight<4> same{kSmall, {0.5, 0.3, 5.0, 0.8}, 41, kCalm};
  fly(ekf, flight, 120.0);
  fly(single, same, 120.0);
  double worst = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    worst = std::max(worst,
                     std::abs(static_cast<double>(single.isolation().power[i]) - ekf.isolation().power[i]));
  }
  worst /= ekf.isolation().power[2];
  EXPECT_LT(worst, 5e-3);
  EXPECT_NEAR(static_cast<double>(single.bank().speed_scale()), ekf.bank().speed_scale(), 1e-4);
  std::printf("float against double after 120 s: %.1e of the largest power\n", worst);
}

TEST(RotorBands, NeverTouchTheHeap) { test::expect_no_heap<InBands<float, 8>>(in_bands(kHexa)); }

TEST(RotorBands, WhatIsNoNumberLeavesEverythingAsItWas) {
  InBands<double, 4> ekf{in_bands(kMedium)};
  ModelFlight<4> flight{kMedium, {5.0, 3.0, 40.0, 8.0}, 51, kCalm};
  fly(ekf, flight, 5.0);
  test::expect_refuses_what_is_no_number(ekf, flight);
}

// However wrong its input, the answer stays a number.
TEST(RotorBands, StayFiniteUnderAnyInput) {
  InBands<float, 6> ekf{in_bands(kHexa)};
  test::feed_anything(ekf, 50'000);
  for (const float x : ekf.state()) EXPECT_TRUE(std::isfinite(x));
  for (const float power : ekf.isolation().power) EXPECT_TRUE(std::isfinite(power));
  EXPECT_TRUE(std::isfinite(ekf.bank().speed_scale()));
}

// Rotors of one sense that turn alike pass for each other, and the information says so; others do not.
TEST(RotorBands, TellWhichRotorsAreConfounded) {
  InBands<double, 4> ekf{in_bands(kMedium)};
  ModelFlight<4> flight{kMedium, {5.0, 5.0, 40.0, 5.0}, 102, kCalm};
  fly(ekf, flight, 30.0, [](auto& sample) {
    sample.speed_rad_s[2] = sample.speed_rad_s[0];
    sample.speed_rad_s[3] = sample.speed_rad_s[0];
  });
  const auto told = ekf.isolation();
  EXPECT_LT(told.correlation[0][2], -0.999);
  EXPECT_LT(told.information[0] / told.alone[0], 1e-6);
  EXPECT_GT(told.information[3] / told.alone[3], 0.03);
}

}  // namespace
}  // namespace airworthy
