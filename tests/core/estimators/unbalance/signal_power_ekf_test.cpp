#include "core/estimators/unbalance/signal_power_ekf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/reference/dense_signal_power_ekf.h"
#include "tests/support/signal_power_checks.h"
#include "tests/support/unbalance_flight.h"

namespace airworthy {
namespace {

using test::DenseSignalPowerEkf;
using test::fly;
using test::kHexa;
using test::kMedium;
using test::kSmall;
using test::ModelFlight;
using test::PaperVehicle;
using test::params_of;
using test::sample_of;

DenseSignalPowerEkf::Params dense_params_of(const PaperVehicle& vehicle) {
  DenseSignalPowerEkf::Params params;
  params.rotors = static_cast<Eigen::Index>(vehicle.rotors);
  params.mass_kg = vehicle.mass_kg;
  params.radius_m = vehicle.radius_m;
  params.thrust_coefficient_N_s2 = vehicle.thrust_coefficient_N_s2;
  params.tip_mass_mg = vehicle.initial_tip_mass_mg;
  return params;
}

template <std::size_t N>
void feed(DenseSignalPowerEkf& dense, const ModelFlight<N>& flight) {
  const Eigen::VectorXd speed = Eigen::Map<const Eigen::VectorXd>(flight.speed_rad_s.data(), N);
  dense.update(static_cast<double>(std::llround(flight.time_s * 1e6)) * 1e-6, flight.ax_m_s2, flight.ay_m_s2,
               speed);
}

/// What the flat band expects at these speeds.
template <std::size_t N>
BandReading<double, N> reading_at(const SignalPowerParams& params, const std::array<double, N>& speed_rad_s) {
  return FlatBand<double, N>{params}.step({}, speed_rad_s, 0.002)[0];
}

TEST(SignalPowerEkf, TheJacobianIsTheSlopeOfTheModel) {
  std::mt19937_64 random{11};
  std::uniform_real_distribution<double> state{-3.0, 3.0};
  std::uniform_real_distribution<double> speed{0.0, 900.0};
  SignalPowerParams params = params_of(kHexa);
  params.sensor = {.filter_cutoff_Hz = 90.0, .averaging_window_s = 0.004};
  const SignalPowerEkf<double, 6> ekf{params};
  for (int trial = 0; trial < 200; ++trial) {
    SignalPowerEkf<double, 6>::Vector x{};
    SignalPowerEkf<double, 6>::Rotors speeds{};
    for (double& value : x) value = state(random);
    for (double& value : speeds) value = speed(random);
    const auto reading = reading_at(params, speeds);
    const auto square = SignalPowerEkf<double, 6>::squares(x);
    const auto at = ekf.predict(square, reading);
    for (std::size_t i = 0; i < x.size(); ++i) {
      constexpr double kStep = 1e-5;
      auto above = x;
      auto below = x;
      above[i] += kStep;
      below[i] -= kStep;
      using Ekf = SignalPowerEkf<double, 6>;
      const double slope = (ekf.predict(Ekf::squares(above), reading).power_m2_s4 -
                            ekf.predict(Ekf::squares(below), reading).power_m2_s4) /
                           (2.0 * kStep);
      EXPECT_NEAR(at.jacobian[i], slope, 1e-7 * at.power_m2_s4 + 1e-8 * std::abs(slope));
      EXPECT_NEAR(square[i], std::exp(2.0 * x[i]), 1e-12 * square[i]);
    }
  }
}

// (3) and (5) against what they say: mean and variance of the power of sines with uniform, independent phases in
// white noise.
TEST(SignalPowerEkf, ModelAndNoiseAreMeanAndVarianceOverPhases) {
  SignalPowerParams params = params_of(kMedium);
  params.extra_variance_m4_s8 = 0.0;
  const SignalPowerEkf<double, 4> ekf{params};
  const SignalPowerEkf<double, 4>::Vector x{0.3, 1.2, -0.4, 0.8, -0.5};
  const SignalPowerEkf<double, 4>::Rotors speeds{400.0, 480.0, 520.0, 450.0};
  const auto predicted = ekf.predict(SignalPowerEkf<double, 4>::squares(x), reading_at(params, speeds));

  std::mt19937_64 random{12};
  std::uniform_real_distribution<double> phase{0.0, 2.0 * std::numbers::pi};
  std::normal_distribution<double> noise{0.0, std::exp(-0.5)};
  double sum = 0.0;
  double squares = 0.0;
  constexpr int kDraws = 2'000'000;
  for (int draw = 0; draw < kDraws; ++draw) {
    double ax = noise(random);
    double ay = noise(random);
    for (std::size_t i = 0; i < 4; ++i) {
      const double unbalance_kg_m = 20e-6 * kMedium.radius_m * std::exp(x[i]);
      const double a = unbalance_kg_m * speeds[i] * speeds[i] / kMedium.mass_kg;
      const double angle = phase(random);
      ax += a * std::cos(angle);
      ay += a * std::sin(angle);
    }
    const double z = ax * ax + ay * ay;
    sum += z;
    squares += z * z;
  }
  const double mean = sum / kDraws;
  const double variance = squares / kDraws - mean * mean;
  // Standard error of the mean √(var/n); of the variance about √(8/n) for what is nearly exponential.
  EXPECT_NEAR(predicted.power_m2_s4, mean, 5.0 * std::sqrt(variance / kDraws));
  EXPECT_NEAR(predicted.variance_m4_s8, variance, 5.0 * std::sqrt(8.0 / kDraws) * variance);
}

template <std::size_t N>
void compare_with_dense(const PaperVehicle& vehicle, const std::array<double, N>& tip_mass_mg,
                        double duration_s) {
  SignalPowerEkf<double, N> ekf{params_of(vehicle)};
  DenseSignalPowerEkf dense{dense_params_of(vehicle)};
  ModelFlight<N> flight{vehicle, tip_mass_mg, 21};
  typename SignalPowerEkf<double, N>::Innovation innovation;
  double worst = 0.0;
  while (flight.time_s < duration_s) {
    flight.step();
    feed(dense, flight);
    const UpdateStatus status = ekf.update(test::sample_of<SignalPowerEkf<double, N>>(flight), innovation);
    if (status != UpdateStatus::kFused) continue;
    for (std::size_t i = 0; i < N; ++i) {
      const double expected = dense.tip_mass_mg(static_cast<Eigen::Index>(i));
      worst = std::max(worst, std::abs(ekf.tip_mass_mg(i) - expected) / expected);
    }
    for (std::size_t i = 0; i <= N; ++i) {
      const auto a = static_cast<Eigen::Index>(i);
      worst = std::max(worst, std::abs(ekf.covariance()[i][i] - dense.p(a, a)) / dense.p(a, a));
      for (std::size_t j = 0; j < i; ++j) ASSERT_EQ(ekf.covariance()[i][j], ekf.covariance()[j][i]);
    }
    worst = std::max(worst, std::abs(innovation.nis - dense.nis) / (1.0 + dense.nis));
  }
  EXPECT_LT(worst, 1e-9);
  EXPECT_EQ(ekf.limits().innovation + ekf.limits().state + ekf.limits().variance, 0);
  EXPECT_GT(ekf.fused(), static_cast<std::int64_t>(450.0 * duration_s));
}

TEST(SignalPowerEkf, EqualsTheDenseTextbookFilterOverLongFlights) {
  compare_with_dense<4>(kSmall, {0.3, 5.0, 0.5, 0.2}, 300.0);
  compare_with_dense<4>(kMedium, {5.0, 3.0, 40.0, 8.0}, 600.0);
  compare_with_dense<6>(kHexa, {5.0, 40.0, 4.0, 3.0, 6.0, 5.0}, 300.0);
}

TEST(SignalPowerEkf, RenumberedRotorsGiveRenumberedAnswers) {
  constexpr std::array<std::size_t, 6> kOrder{3, 0, 5, 1, 4, 2};
  SignalPowerEkf<double, 6> ekf{params_of(kHexa)};
  SignalPowerEkf<double, 6> renumbered{params_of(kHexa)};
  ModelFlight<6> flight{kHexa, {5.0, 40.0, 4.0, 3.0, 6.0, 5.0}, 31};
  test::fly_renumbered(ekf, renumbered, flight, 60.0, kOrder);
  // Sums of rounded numbers depend on their order, hence not to the bit.
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(renumbered.tip_mass_mg(i), ekf.tip_mass_mg(kOrder[i]), 1e-11 * ekf.tip_mass_mg(kOrder[i]));
  }
  const auto isolation = ekf.isolation();
  const auto other = renumbered.isolation();
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(other.information[i], isolation.information[kOrder[i]],
                1e-9 * isolation.information[kOrder[i]]);
  }
}

TEST(SignalPowerEkf, FloatTracksDouble) {
  SignalPowerEkf<double, 4> ekf{params_of(kMedium)};
  SignalPowerEkf<float, 4> single{params_of(kMedium)};
  ModelFlight<4> flight{kMedium, {5.0, 3.0, 40.0, 8.0}, 41};
  ModelFlight<4> same{kMedium, {5.0, 3.0, 40.0, 8.0}, 41};
  fly(ekf, flight, 300.0);
  fly(single, same, 300.0);
  double worst = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    worst = std::max(worst, std::abs(static_cast<double>(single.state()[i]) - ekf.state()[i]));
    EXPECT_NEAR(static_cast<double>(single.relative_sigma(i)), ekf.relative_sigma(i),
                1e-3 * ekf.relative_sigma(i));
  }
  EXPECT_LT(worst, 2e-3);  // 0.2 % of the unbalance, after 150,000 steps
  std::printf("float against double after 300 s: %.1e of the unbalance at most\n", worst);
}

TEST(SignalPowerEkf, NeverTouchesTheHeap) {
  test::expect_no_heap<SignalPowerEkf<float, 8>>(params_of(kHexa));
}

TEST(SignalPowerEkf, WhatIsNoNumberLeavesEverythingAsItWas) {
  SignalPowerEkf<double, 4> ekf{params_of(kMedium)};
  ModelFlight<4> flight{kMedium, {5.0, 3.0, 40.0, 8.0}, 51};
  fly(ekf, flight, 5.0);
  test::expect_refuses_what_is_no_number(ekf, flight);
}

TEST(SignalPowerEkf, TimeMustGoForwardAndAGapStartsTheHighPassAfresh) {
  using Ekf = SignalPowerEkf<double, 4>;
  Ekf ekf{params_of(kMedium)};
  ModelFlight<4> flight{kMedium, {5.0, 3.0, 40.0, 8.0}, 61};
  fly(ekf, flight, 5.0);
  const Ekf before = ekf;
  Ekf::Innovation innovation;
  Ekf::Sample sample = sample_of<Ekf>(flight);
  EXPECT_EQ(ekf.update(sample, innovation), UpdateStatus::kTimeBackward);  // the same again
  sample.time -= from_seconds(1.0);
  EXPECT_EQ(ekf.update(sample, innovation), UpdateStatus::kTimeBackward);
  test::expect_unchanged(ekf, before);

  // An hour later: no less sure of anything than the bound allows, and a new offset of the sensor is no vibration.
  sample.time += from_seconds(3600.0);
  sample.ax_m_s2 = 20.0;
  EXPECT_EQ(ekf.update(sample, innovation), UpdateStatus::kConverging);
  EXPECT_EQ(ekf.state(), before.state());
  EXPECT_GT(ekf.relative_sigma(0), before.relative_sigma(0));
  EXPECT_LE(ekf.relative_sigma(0), 1.0);
  int settling = 0;
  UpdateStatus status = UpdateStatus::kConverging;
  while (status == UpdateStatus::kConverging) {
    sample.time += from_seconds(0.002);
    status = ekf.update(sample, innovation);
    ++settling;
  }
  EXPECT_EQ(status, UpdateStatus::kFused);
  EXPECT_NEAR(settling * 0.002, 3.0 / (2.0 * std::numbers::pi), 0.004);
  EXPECT_LT(innovation.power_m2_s4, 1e-20);
}

TEST(SignalPowerEkf, AKnockIsLimitedAndCounted) {
  using Ekf = SignalPowerEkf<double, 4>;
  Ekf ekf{params_of(kMedium)};
  ModelFlight<4> flight{kMedium, {20.0, 20.0, 20.0, 20.0}, 71};
  fly(ekf, flight, 20.0);
  const Ekf before = ekf;
  flight.step();
  Ekf::Sample sample = sample_of<Ekf>(flight);
  sample.ax_m_s2 += 150.0;  // full range
  Ekf::Innovation innovation;
  ASSERT_EQ(ekf.update(sample, innovation), UpdateStatus::kFused);
  EXPECT_EQ(ekf.limits().innovation, 1);
  EXPECT_GT(innovation.nis, 1e6);  // reported in full
  for (std::size_t i = 0; i < 4; ++i) EXPECT_LT(std::abs(ekf.state()[i] - before.state()[i]), 0.2);
}

// However wrong its input, the answer stays a number and P positive definite.
TEST(SignalPowerEkf, StaysPositiveDefiniteUnderAnyInput) {
  SignalPowerEkf<float, 6> ekf{params_of(kHexa)};
  test::feed_anything(ekf, 200'000);
  Eigen::MatrixXd p(7, 7);
  for (Eigen::Index i = 0; i < 7; ++i) {
    for (Eigen::Index j = 0; j < 7; ++j) {
      p(i, j) =
          static_cast<double>(ekf.covariance()[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]);
    }
  }
  EXPECT_TRUE(p.allFinite());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>{p}.eigenvalues().minCoeff(), 0.0);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_TRUE(std::isfinite(ekf.tip_mass_mg(i)));
}

// The experiments of the paper, on data of its model: one damaged propeller among good ones, random flights.
template <std::size_t N>
void expect_paper_experiment(const char* name, const PaperVehicle& vehicle, double damage_mg, double good_mg,
                             double within_s) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SignalPowerEkf<double, N> ekf{params_of(vehicle)};
    ModelFlight<N> flight{vehicle, test::one_damaged<N>(damage_mg, good_mg), seed};
    const double nis = fly(ekf, flight, within_s);
    std::printf("%s, seed %u, after %.0f s:", name, seed, within_s);
    for (std::size_t i = 0; i < N; ++i) std::printf(" %.2f", ekf.tip_mass_mg(i));
    std::printf(" mg, true %.1f and %.1f; mean NIS %.3f\n", damage_mg, good_mg, nis);
    EXPECT_NEAR(ekf.tip_mass_mg(1), damage_mg, 0.2 * damage_mg) << name << ", seed " << seed;
    for (std::size_t i = 0; i < N; ++i) {
      EXPECT_TRUE(i == 1 || ekf.tip_mass_mg(i) < 0.6 * ekf.tip_mass_mg(1)) << name << ", seed " << seed;
    }
  }
}

TEST(SignalPowerEkf, FindsTheDamageInThePapersTimes) {
  expect_paper_experiment<4>("small", kSmall, 5.0, 0.5, 15.0);
  expect_paper_experiment<4>("medium", kMedium, 40.0, 5.0, 100.0);
  expect_paper_experiment<6>("hexacopter", kHexa, 40.0, 5.0, 200.0);
}

// With r₀ = 0 the innovations of data that fit the model are as large as S says; r₀ = 100 m⁴/s⁸ declares a
// noise many times that of z (4σ⁴ = 4 at σ = 1), so its mean NIS is far below 1, on purpose: it stands for the slow
// beating of rotors against each other, for which consecutive samples are no new evidence.
TEST(SignalPowerEkf, MeanNisSaysHowConservativeR0Is) {
  for (const double r0 : {100.0, 0.0}) {
    SignalPowerParams params = params_of(kMedium);
    params.extra_variance_m4_s8 = r0;
    SignalPowerEkf<double, 4> ekf{params};
    ModelFlight<4> flight{kMedium, {10.0, 15.0, 40.0, 20.0}, 91};
    fly(ekf, flight, 200.0);
    const double nis = fly(ekf, flight, 200.0);
    std::printf("r0 = %.0f: mean NIS %.3f\n", r0, nis);
    if (r0 > 0.0) {
      EXPECT_LT(nis, 0.5);
    } else {
      EXPECT_NEAR(nis, 1.0, 0.1);
    }
  }
}

TEST(SignalPowerEkf, ForcesInUnisonIsolateNothing) {
  using Ekf = SignalPowerEkf<double, 4>;
  const std::array<double, 4> truth_mg{5.0, 5.0, 40.0, 5.0};
  Ekf varied{params_of(kMedium)};
  ModelFlight<4> flight{kMedium, truth_mg, 101};
  fly(varied, flight, 60.0);
  Ekf unison{params_of(kMedium)};
  ModelFlight<4> alike{kMedium, truth_mg, 101, {.is_in_unison = true}};
  fly(unison, alike, 60.0);
  const auto known = varied.isolation();
  const auto confounded = unison.isolation();
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_GT(known.information[i] / known.alone[i], 0.05);
    EXPECT_LT(confounded.information[i] / confounded.alone[i], 1e-9);
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_LT(confounded.correlation[i][j], -0.2);
      EXPECT_GT(known.correlation[i][j], confounded.correlation[i][j]);
    }
  }
  // In numbers a policy can use: half a milligramme against no idea.
  const double damage_kg_m = 40e-6 * kMedium.radius_m;
  EXPECT_LT(varied.unbalance_sigma_kg_m(known.information[2], damage_kg_m), 0.2 * damage_kg_m);
  EXPECT_GT(unison.unbalance_sigma_kg_m(confounded.information[2], damage_kg_m), 10.0 * damage_kg_m);
}

// Two of four rotors alike: these two stand for each other, and no other.
TEST(SignalPowerEkf, TellsWhichRotorsAreConfounded) {
  SignalPowerEkf<double, 4> ekf{params_of(kMedium)};
  ModelFlight<4> flight{kMedium, {5.0, 5.0, 40.0, 5.0}, 102};
  fly(ekf, flight, 60.0, [](auto& sample) { sample.speed_rad_s[3] = sample.speed_rad_s[0]; });
  const auto isolation = ekf.isolation();
  EXPECT_LT(isolation.correlation[0][3], -0.999);
  EXPECT_GT(isolation.correlation[0][1], -0.9);
  EXPECT_LT(isolation.information[0] / isolation.alone[0], 1e-6);
  EXPECT_GT(isolation.information[1] / isolation.alone[1], 0.05);
}

// J of (7) is the inverse of the variance of a weighted least squares of z on f²: computed so, by batch.
TEST(SignalPowerEkf, InformationIsThatOfWeightedLeastSquares) {
  using Ekf = SignalPowerEkf<double, 4>;
  SignalPowerParams params = params_of(kMedium);
  params.information_memory_s = 1e12;
  Ekf ekf{params};
  ModelFlight<4> flight{kMedium, {5.0, 5.0, 40.0, 5.0}, 103};
  Ekf::Innovation innovation;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(5, 5);
  while (flight.time_s < 20.0) {
    flight.step();
    if (ekf.update(sample_of<Ekf>(flight), innovation) != UpdateStatus::kFused) continue;
    Eigen::VectorXd row(5);
    for (Eigen::Index i = 0; i < 4; ++i) {
      const double speed = flight.speed_rad_s[static_cast<std::size_t>(i)];
      row(i) = std::pow(20e-6 * kMedium.radius_m * speed * speed / kMedium.mass_kg, 2);
    }
    row(4) = 2.0;
    normal += row * row.transpose() / innovation.measurement_variance_m4_s8;
  }
  const Eigen::MatrixXd covariance = normal.inverse();
  const auto isolation = ekf.isolation();
  for (Eigen::Index i = 0; i < 4; ++i) {
    const auto rotor = static_cast<std::size_t>(i);
    EXPECT_NEAR(isolation.information[rotor], 1.0 / covariance(i, i), 1e-6 / covariance(i, i));
    EXPECT_NEAR(isolation.alone[rotor], normal(i, i), 1e-9 * normal(i, i));
  }
}

// The least squares of (7): no prior, so of the same data no need to wait.
TEST(SignalPowerEkf, PowersAreThoseOfWeightedLeastSquares) {
  using Ekf = SignalPowerEkf<double, 4>;
  SignalPowerParams params = params_of(kMedium);
  params.information_memory_s = 1e12;
  Ekf ekf{params};
  ModelFlight<4> flight{kMedium, {10.0, 5.0, 40.0, 5.0}, 104};
  std::vector<double> values;
  Ekf::Innovation innovation;
  while (flight.time_s < 20.0) {
    flight.step();
    if (ekf.update(sample_of<Ekf>(flight), innovation) != UpdateStatus::kFused) continue;
    const double weight = 1.0 / std::sqrt(innovation.measurement_variance_m4_s8);
    for (const double speed : flight.speed_rad_s) {
      values.push_back(weight * std::pow(20e-6 * kMedium.radius_m * speed * speed / kMedium.mass_kg, 2));
    }
    values.push_back(weight * 2.0);
    values.push_back(weight * innovation.power_m2_s4);
  }
  const auto count = static_cast<Eigen::Index>(values.size() / 6);
  const Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>> all{values.data(), count, 6};
  const Eigen::VectorXd expected = all.leftCols<5>().householderQr().solve(all.col(5));
  const auto told = ekf.isolation();
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(told.power[i], expected(static_cast<Eigen::Index>(i)), 1e-6 * std::abs(expected(2)));
  }
}

// Erratum: the correction as printed, with S where S⁻¹ belongs, is no estimator.
TEST(SignalPowerEkfErrata, WithoutTheInverseTheFilterDiverges) {
  DenseSignalPowerEkf::Params params = dense_params_of(kMedium);
  DenseSignalPowerEkf right{params};
  params.inverts_innovation_covariance = false;
  DenseSignalPowerEkf printed{params};
  ModelFlight<4> flight{kMedium, {5.0, 40.0, 5.0, 5.0}, 111};
  double diverged_s = 0.0;
  while (flight.time_s < 100.0) {
    flight.step();
    feed(right, flight);
    feed(printed, flight);
    const bool is_sane = printed.x.allFinite() && printed.x.cwiseAbs().maxCoeff() < 20.0;
    if (!is_sane && diverged_s == 0.0) diverged_s = flight.time_s;
  }
  EXPECT_NEAR(right.tip_mass_mg(1), 40.0, 8.0);
  EXPECT_GT(diverged_s, 0.0);
  EXPECT_LT(diverged_s, 2.0);
  std::printf("without the inverse: a log unbalance beyond ±20 after %.2f s\n", diverged_s);
}

// The answer, a mass, cannot depend on the unit of length in which z is computed. With r₀ in m⁴/s⁸ it does not; in
// m²/s⁴, as printed, it does. With S for S⁻¹ even the correct r₀ gives another answer in another unit.
TEST(SignalPowerEkfErrata, OnlyAVarianceOfZIsFreeOfTheUnitOfLength) {
  const auto log_unbalance = [](double unit_m, double power, bool inverts, double duration_s) {
    DenseSignalPowerEkf::Params params = dense_params_of(kMedium);
    params.length_unit_m = unit_m;
    params.r0_power_of_length = power;
    params.inverts_innovation_covariance = inverts;
    DenseSignalPowerEkf dense{params};
    ModelFlight<4> flight{kMedium, {5.0, 40.0, 5.0, 5.0}, 112};
    while (flight.time_s < duration_s) {
      flight.step();
      feed(dense, flight);
    }
    return dense.x(1);
  };
  const double in_metres = log_unbalance(1.0, 4.0, true, 20.0);
  EXPECT_NEAR(log_unbalance(0.01, 4.0, true, 20.0), in_metres, 1e-6);
  EXPECT_GT(std::abs(log_unbalance(0.01, 2.0, true, 20.0) - in_metres), 0.02);
  const double first_correction_s = 0.4795;
  const double first = log_unbalance(1.0, 4.0, false, first_correction_s);
  EXPECT_NE(first, 0.0);
  EXPECT_GT(std::abs(log_unbalance(0.01, 4.0, false, first_correction_s)), 1e6 * std::abs(first));
}

}  // namespace
}  // namespace airworthy
