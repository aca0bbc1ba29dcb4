// One step of the unbalance estimators for 4, 6 and 8 rotors, beside the same filter as a textbook writes it (matrices of
// run-time size, every product in full) and as a programmer writes it for one size of arrays, in the same run.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/estimators/unbalance/signal_power_ekf.h"
#include "tests/support/reference/dense_signal_power_ekf.h"

namespace airworthy {
namespace {

constexpr std::size_t kSamples = 4096;
constexpr double kMass_kg = 0.69;
constexpr double kRadius_m = 0.1;

template <class Scalar, std::size_t N>
std::vector<typename SignalPowerEkf<Scalar, N>::Sample> samples() {
  std::vector<typename SignalPowerEkf<Scalar, N>::Sample> result(kSamples);
  for (std::size_t k = 0; k < kSamples; ++k) {
    const auto t = static_cast<double>(k);
    result[k].ax_m_s2 = static_cast<Scalar>(2.0 * std::sin(1.7 * t));
    result[k].ay_m_s2 = static_cast<Scalar>(2.0 * std::cos(1.1 * t));
    for (std::size_t i = 0; i < N; ++i) {
      result[k].speed_rad_s[i] =
          static_cast<Scalar>(450.0 + 60.0 * std::sin(0.01 * t * static_cast<double>(i + 1)));
    }
  }
  return result;
}

template <class Scalar, std::size_t N>
void signal_power(benchmark::State& state) {
  auto input = samples<Scalar, N>();
  SignalPowerParams params;
  params.mass_kg = kMass_kg;
  params.propeller_radius_m = kRadius_m;
  SignalPowerEkf<Scalar, N> ekf{params};
  typename SignalPowerEkf<Scalar, N>::Innovation innovation;
  std::int64_t step = 0;
  for (auto _ : state) {
    auto& sample = input[static_cast<std::size_t>(step) % kSamples];
    sample.time = from_us(2000 * ++step);
    benchmark::DoNotOptimize(ekf.update(sample, innovation));
  }
}

void signal_power_double(benchmark::State& state) {
  if (state.range(0) == 4) signal_power<double, 4>(state);
  if (state.range(0) == 6) signal_power<double, 6>(state);
  if (state.range(0) == 8) signal_power<double, 8>(state);
}
BENCHMARK(signal_power_double)->Arg(4)->Arg(6)->Arg(8);

void signal_power_float(benchmark::State& state) {
  if (state.range(0) == 4) signal_power<float, 4>(state);
  if (state.range(0) == 6) signal_power<float, 6>(state);
  if (state.range(0) == 8) signal_power<float, 8>(state);
}
BENCHMARK(signal_power_float)->Arg(4)->Arg(6)->Arg(8);

void textbook_signal_power(benchmark::State& state) {
  const auto n = state.range(0);
  const auto input = samples<double, 8>();
  test::DenseSignalPowerEkf ekf{{.rotors = n, .mass_kg = kMass_kg, .radius_m = kRadius_m}};
  std::vector<Eigen::VectorXd> speeds;
  for (const auto& sample : input) {
    speeds.emplace_back(Eigen::Map<const Eigen::VectorXd>(sample.speed_rad_s.data(), n));
  }
  std::size_t step = 0;
  for (auto _ : state) {
    const std::size_t k = step % kSamples;
    ekf.update(0.002 * static_cast<double>(++step), input[k].ax_m_s2, input[k].ay_m_s2, speeds[k]);
    benchmark::DoNotOptimize(ekf.x.data());
  }
}
BENCHMARK(textbook_signal_power)->Arg(4)->Arg(6)->Arg(8);

/// (2) to (6) only, without checks, limits, information or counters: the least a step can cost.
template <std::size_t N>
struct ByHand {
  double x[N + 1] = {};
  double p[N + 1][N + 1] = {};
  double y[2] = {};
  double last[2] = {};

  void step(const double a[2], const double* speed) {
    const double dt = 0.002;
    const double pole = std::exp(-6.283185307179586 * dt);
    double z = 0.0;
    for (int k = 0; k < 2; ++k) {
      y[k] = pole * y[k] + 0.5 * (1.0 + pole) * (a[k] - last[k]);
      last[k] = a[k];
      z += y[k] * y[k];
    }
    double h[N + 1];
    double rotors = 0.0;
    double pairs = 0.0;
    for (std::size_t i = 0; i < N; ++i) {
      const double acceleration = 2e-6 / kMass_kg * speed[i] * speed[i];
      const double w = acceleration * acceleration * std::exp(2.0 * x[i]);
      pairs += w * rotors;
      rotors += w;
      h[i] = 2.0 * w;
      p[i][i] += 0.04 / 60.0 * dt;
    }
    p[N][N] += 0.0025 / 60.0 * dt;
    const double noise = std::exp(2.0 * x[N]);
    h[N] = 4.0 * noise;
    double s = 4.0 * noise * (noise + rotors) + 2.0 * pairs + 100.0;
    double ph[N + 1];
    for (std::size_t i = 0; i <= N; ++i) {
      ph[i] = 0.0;
      for (std::size_t j = 0; j <= N; ++j) ph[i] += p[i][j] * h[j];
      s += ph[i] * h[i];
    }
    const double gain = (z - rotors - 2.0 * noise) / s;
    for (std::size_t i = 0; i <= N; ++i) {
      x[i] += ph[i] * gain;
      for (std::size_t j = 0; j <= N; ++j) p[i][j] -= ph[i] * ph[j] / s;
    }
  }
};

template <std::size_t N>
void by_hand(benchmark::State& state) {
  const auto input = samples<double, N>();
  ByHand<N> filter;
  for (std::size_t i = 0; i < N; ++i) filter.p[i][i] = 0.01;
  filter.p[N][N] = 0.0025;
  std::size_t step = 0;
  for (auto _ : state) {
    const auto& sample = input[step++ % kSamples];
    const double a[2] = {sample.ax_m_s2, sample.ay_m_s2};
    filter.step(a, sample.speed_rad_s.data());
    benchmark::DoNotOptimize(filter.x);
  }
}

void signal_power_by_hand(benchmark::State& state) {
  if (state.range(0) == 4) by_hand<4>(state);
  if (state.range(0) == 6) by_hand<6>(state);
  if (state.range(0) == 8) by_hand<8>(state);
}
BENCHMARK(signal_power_by_hand)->Arg(4)->Arg(6)->Arg(8);

// What a report costs on top, at its own rate.
void signal_power_report(benchmark::State& state) {
  auto input = samples<double, 8>();
  SignalPowerParams params;
  params.mass_kg = kMass_kg;
  params.propeller_radius_m = kRadius_m;
  SignalPowerEkf<double, 8> ekf{params};
  SignalPowerEkf<double, 8>::Innovation innovation;
  for (std::size_t k = 0; k < kSamples; ++k) {
    input[k].time = from_us(static_cast<std::int64_t>(2000 * k));
    static_cast<void>(ekf.update(input[k], innovation));
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(ekf.isolation());
    benchmark::DoNotOptimize(ekf.culprits({}));
  }
}
BENCHMARK(signal_power_report);

}  // namespace
}  // namespace airworthy

BENCHMARK_MAIN();
