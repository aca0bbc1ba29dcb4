// One step of the filter of effectiveness for 4, 6 and 8 rotors, beside the same filter as a textbook writes it (matrices of
// run-time size) and by hand for four rotors; and one inertial sample of the whole detector.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>

#include "core/detectors/effectiveness/effectiveness_monitor.h"
#include "core/estimators/effectiveness/loss_of_effectiveness_filter.h"
#include "tests/support/reference/dense_effectiveness_filter.h"

namespace airworthy {
namespace {

Multirotor ring(std::size_t rotors) {
  Multirotor vehicle;
  vehicle.mass_kg = 0.5;
  vehicle.inertia_kg_m2 = {0.0023, 0.0018, 0.0036};
  vehicle.thrust_coefficient_N_s2 = 8e-6 / static_cast<double>(rotors);
  vehicle.torque_ratio_m = 0.012;
  vehicle.propeller_radius_m = 0.07;
  vehicle.motor_time_constant_s = 0.02;
  vehicle.speed_min_rad_s = 100.0;
  vehicle.speed_max_rad_s = 1300.0;
  vehicle.rotor_count = rotors;
  for (std::size_t i = 0; i < rotors; ++i) {
    const double angle = 6.283185307179586 * (static_cast<double>(i) + 0.5) / static_cast<double>(rotors);
    vehicle.rotor[i].position_m = {0.14 * std::cos(angle), 0.14 * std::sin(angle), -0.01};
    vehicle.rotor[i].spin = i % 2 == 0 ? 1 : -1;
  }
  return vehicle;
}

template <class Scalar>
void filter_step(benchmark::State& state) {
  const auto rotors = static_cast<std::size_t>(state.range(0));
  LossOfEffectivenessFilter<Scalar> filter{EffectivenessMatrix<Scalar>::of(ring(rotors)), {}};
  std::array<Scalar, kMaxRotors> speed{};
  speed.fill(Scalar(640));
  Scalar rate = 0;
  for (auto _ : state) {
    rate = rate > Scalar{1} ? Scalar{0} : rate + Scalar(0.01);
    benchmark::DoNotOptimize(
        filter.update(Scalar(0.002), std::span{speed}.first(rotors), {rate, -rate, Scalar{0}}, Scalar(-9.8)));
  }
}
void filter_double(benchmark::State& state) { filter_step<double>(state); }
BENCHMARK(filter_double)->Arg(4)->Arg(6)->Arg(8);
void filter_float(benchmark::State& state) { filter_step<float>(state); }
BENCHMARK(filter_float)->Arg(4)->Arg(6)->Arg(8);

/// The Kalman update alone, without low-passes.
void textbook_filter(benchmark::State& state) {
  const auto n = static_cast<Eigen::Index>(state.range(0));
  const auto matrix = EffectivenessMatrix<double>::of(ring(static_cast<std::size_t>(n)));
  Eigen::MatrixXd H(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    H.col(i) << matrix.per_speed2[kRollRow][at], matrix.per_speed2[kPitchRow][at],
        matrix.per_speed2[kVerticalRow][at];
  }
  H *= 640.0 * 640.0;
  reference::DenseEffectivenessFilter filter{Eigen::VectorXd::Ones(n),
                                             0.01 * Eigen::MatrixXd::Identity(n, n)};
  const Eigen::MatrixXd R = Eigen::MatrixXd::Identity(3, 3);
  Eigen::VectorXd z(3);
  double rate = 0.0;
  for (auto _ : state) {
    rate = rate > 1.0 ? 0.0 : rate + 0.01;
    z << rate, -rate, -9.8;
    filter.update(H, z, R, 0.01, 0.0, 1.5);
    benchmark::DoNotOptimize(filter.k.data());
  }
}
BENCHMARK(textbook_filter)->Arg(4)->Arg(6)->Arg(8);

/// The Kalman update alone, as C for four rotors and three rows.
void by_hand_filter(benchmark::State& state) {
  const auto matrix = EffectivenessMatrix<double>::of(ring(4));
  constexpr std::array kRows{kRollRow, kPitchRow, kVerticalRow};
  double k[4] = {1, 1, 1, 1};
  double p[4][4] = {};
  double rate = 0.0;
  for (auto _ : state) {
    rate = rate > 1.0 ? 0.0 : rate + 0.01;
    const double z[3] = {rate, -rate, -9.8};
    for (int i = 0; i < 4; ++i) p[i][i] += 0.01;
    for (int row = 0; row < 3; ++row) {
      double h[4];
      double ph[4];
      double innovation = z[row];
      double variance = 1.0;
      for (int i = 0; i < 4; ++i) {
        h[i] = matrix.per_speed2[kRows[static_cast<std::size_t>(row)]][static_cast<std::size_t>(i)] * 640.0 *
               640.0;
        innovation -= h[i] * k[i];
      }
      for (int i = 0; i < 4; ++i) {
        ph[i] = p[i][0] * h[0] + p[i][1] * h[1] + p[i][2] * h[2] + p[i][3] * h[3];
        variance += h[i] * ph[i];
      }
      for (int i = 0; i < 4; ++i) {
        const double gain = ph[i] / variance;
        k[i] += gain * innovation;
        for (int j = 0; j < 4; ++j) p[i][j] -= gain * ph[j];
      }
    }
    for (double& one : k) one = one < 0.0 ? 0.0 : one > 1.5 ? 1.5 : one;
    benchmark::DoNotOptimize(k);
  }
}
BENCHMARK(by_hand_filter)->Arg(4);

void detector_sample(benchmark::State& state) {
  const auto rotors = static_cast<std::size_t>(state.range(0));
  effectiveness::EffectivenessParams params;
  params.vehicle = ring(rotors);
  params.effectiveness = EffectivenessMatrix<double>::of(params.vehicle);
  params.mapping_is_known = true;
  params.speeds = {
      .rotor_count = rotors, .time_constant_s = 0.02, .speed_min_rad_s = 100.0, .speed_max_rad_s = 1300.0};
  effectiveness::EffectivenessMonitor monitor{params};
  std::array<double, kMaxRotors> speed{};
  std::int64_t step = 0;
  for (auto _ : state) {
    const TimePoint time = from_us(2000 * ++step);
    speed.fill(step % 2 == 0 ? 640.0 : 640.5);
    benchmark::DoNotOptimize(monitor.on_speeds(time, std::span{speed}.first(rotors)));
    const double noise = step % 3 == 0 ? 0.01 : -0.005;
    benchmark::DoNotOptimize(monitor.on_imu(time, {0.0, 0.0, -9.8}, {noise, noise, 0.0}, Phase::kInFlight));
  }
}
BENCHMARK(detector_sample)->Arg(4)->Arg(6)->Arg(8);

}  // namespace
}  // namespace airworthy

BENCHMARK_MAIN();
