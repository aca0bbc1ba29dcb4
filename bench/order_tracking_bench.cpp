// One sample through the order tracker, with its phases, sensor response and learned noise, beside the same filter as
// a textbook would write it (dense matrices of run-time size, both axes in one state, Joseph's form) and beside C
// written by hand for it, in the same run.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

#include "core/estimators/unbalance/order_tracker.h"
#include "tests/support/reference/dense_order_filter.h"

namespace airworthy {
namespace {

constexpr std::size_t kSamples = 4096;
constexpr double kHover_rad_s = 500.0;
constexpr double kDt_s = 0.002;
constexpr std::size_t kMost = 8;

struct Sample {
  double x_m_s2;
  double y_m_s2;
  std::array<double, kMost> speed_rad_s;
};

std::vector<Sample> samples_of(std::size_t rotors) {
  std::vector<Sample> samples(kSamples);
  std::array<double, kMost> phase{};
  for (std::size_t k = 0; k < kSamples; ++k) {
    const double t = kDt_s * static_cast<double>(k);
    samples[k].x_m_s2 = 0.2 * std::sin(91.0 * t);
    samples[k].y_m_s2 = 0.2 * std::cos(77.0 * t);
    for (std::size_t i = 0; i < rotors; ++i) {
      const auto n = static_cast<double>(i);
      samples[k].speed_rad_s[i] = kHover_rad_s + 4.0 * n + 8.0 * std::sin((1.0 + 0.3 * n) * t);
      phase[i] += kDt_s * samples[k].speed_rad_s[i];
      samples[k].x_m_s2 += 0.5 * std::cos(phase[i]);
      samples[k].y_m_s2 += 0.5 * std::sin(phase[i]);
    }
  }
  return samples;
}

template <class Scalar, std::size_t N>
void order_tracker(benchmark::State& state) {
  const auto samples = samples_of(N);
  OrderTrackerParams<Scalar> params;
  params.reference_speed_rad_s = static_cast<Scalar>(kHover_rad_s);
  OrderTracker<Scalar, N> tracker{params};
  std::int64_t k = 0;
  for (auto _ : state) {
    const Sample& sample = samples[static_cast<std::size_t>(k) % kSamples];
    const TimePoint time = from_us(1'000'000 + 2000 * k);
    if (k % 5 == 0) {
      std::array<Scalar, N> speeds;
      for (std::size_t i = 0; i < N; ++i) speeds[i] = static_cast<Scalar>(sample.speed_rad_s[i]);
      tracker.on_speeds(time, speeds);
    }
    benchmark::DoNotOptimize(tracker.on_accel(time, static_cast<Scalar>(sample.x_m_s2),
                                              static_cast<Scalar>(sample.y_m_s2), Scalar{0}));
    ++k;
  }
}
BENCHMARK(order_tracker<double, 4>)->Name("order_tracker/double/4");
BENCHMARK(order_tracker<double, 6>)->Name("order_tracker/double/6");
BENCHMARK(order_tracker<double, 8>)->Name("order_tracker/double/8");
BENCHMARK(order_tracker<float, 4>)->Name("order_tracker/float/4");
BENCHMARK(order_tracker<float, 6>)->Name("order_tracker/float/6");
BENCHMARK(order_tracker<float, 8>)->Name("order_tracker/float/8");

void textbook_kalman(benchmark::State& state) {
  const auto rotors = static_cast<std::size_t>(state.range(0));
  const auto samples = samples_of(rotors);
  test::DenseOrderFilter filter{static_cast<Eigen::Index>(rotors), {kHover_rad_s, 0.3, 0.004, 0.0}};
  const Eigen::VectorXd spacing_s = Eigen::VectorXd::Constant(state.range(0), 0.01);
  Eigen::VectorXd speed(state.range(0));
  std::size_t k = 0;
  for (auto _ : state) {
    const Sample& sample = samples[k];
    for (std::size_t i = 0; i < rotors; ++i) speed(static_cast<Eigen::Index>(i)) = sample.speed_rad_s[i];
    filter.step(kDt_s, {sample.x_m_s2, sample.y_m_s2}, 0.0, speed, spacing_s);
    benchmark::DoNotOptimize(filter.x.data());
    k = (k + 1) % kSamples;
  }
}
BENCHMARK(textbook_kalman)->Arg(4)->Arg(6)->Arg(8);

// C by hand: fixed arrays, the regressor by the library's sine and cosine without any sensor, half of P, no waiting
// for speeds, no cut, constant noise.
struct ByHand {
  double P[2 * kMost][2 * kMost];
  double x[2 * kMost];
  double y[2 * kMost];
  double phase[kMost];
};

void step_by_hand(ByHand* f, int rotors, const Sample* sample) {
  const int n = 2 * rotors;
  double h[2 * kMost];
  double Ph[2 * kMost];
  double nu_x = sample->x_m_s2;
  double nu_y = sample->y_m_s2;
  double S = 0.04;
  for (int i = 0; i < rotors; ++i) {
    const double speed = sample->speed_rad_s[static_cast<std::size_t>(i)];
    f->phase[i] = std::fmod(f->phase[i] + kDt_s * speed, 6.283185307179586);
    const double gain = speed * speed / (kHover_rad_s * kHover_rad_s);
    h[2 * i] = gain * std::cos(f->phase[i]);
    h[2 * i + 1] = -gain * std::sin(f->phase[i]);
    f->P[2 * i][2 * i] += 1e-4;
    f->P[2 * i + 1][2 * i + 1] += 1e-4;
  }
  for (int i = 0; i < n; ++i) {
    double sum = 0.0;
    for (int j = 0; j <= i; ++j) sum += f->P[i][j] * h[j];
    for (int j = i + 1; j < n; ++j) sum += f->P[j][i] * h[j];
    Ph[i] = sum;
    S += sum * h[i];
    nu_x -= h[i] * f->x[i];
    nu_y -= h[i] * f->y[i];
  }
  for (int i = 0; i < n; ++i) {
    const double k = Ph[i] / S;
    f->x[i] += k * nu_x;
    f->y[i] += k * nu_y;
    for (int j = 0; j <= i; ++j) f->P[i][j] -= k * Ph[j];
  }
}

void by_hand(benchmark::State& state) {
  const auto rotors = static_cast<int>(state.range(0));
  const auto samples = samples_of(static_cast<std::size_t>(rotors));
  ByHand filter{};
  for (int i = 0; i < 2 * rotors; ++i) filter.P[i][i] = 144.0;
  std::size_t k = 0;
  for (auto _ : state) {
    step_by_hand(&filter, rotors, &samples[k]);
    benchmark::DoNotOptimize(filter.x);
    k = (k + 1) % kSamples;
  }
}
BENCHMARK(by_hand)->Arg(4)->Arg(6)->Arg(8);

}  // namespace
}  // namespace airworthy

BENCHMARK_MAIN();
