#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "bench/methods.h"
#include "core/estimators/unbalance/rotor_bands.h"
#include "core/estimators/unbalance/signal_power_ekf.h"
#include "tests/support/reference/dense_signal_power_ekf.h"

namespace airworthy::bench {

inline constexpr std::size_t kSamples = 4096;
inline constexpr double kMass_kg = 0.69;
inline constexpr double kRadius_m = 0.1;

inline SignalPowerParams params() {
  SignalPowerParams result;
  result.mass_kg = kMass_kg;
  result.propeller_radius_m = kRadius_m;
  for (std::size_t i = 0; i < kMaxRotors; ++i) result.bands.spin[i] = i % 2 == 0 ? 1 : -1;
  return result;
}

template <class Scalar, std::size_t N, class Bank = FlatBand<Scalar, N>>
std::vector<typename SignalPowerEkf<Scalar, N, Bank>::Sample> samples() {
  std::vector<typename SignalPowerEkf<Scalar, N, Bank>::Sample> result(kSamples);
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

/// The estimator: the source's, or in bands, as it flies.
template <class Scalar, std::size_t N, class Bank = FlatBand<Scalar, N>>
struct SignalPowerSteps {
  using Ekf = SignalPowerEkf<Scalar, N, Bank>;
  std::vector<typename Ekf::Sample> input = samples<Scalar, N, Bank>();
  Ekf ekf{params()};
  typename Ekf::Innovation innovation;
  std::int64_t taken = 0;

  UpdateStatus step() {
    auto& sample = input[static_cast<std::size_t>(taken) % kSamples];
    sample.time = from_us(2000 * ++taken);
    return ekf.update(sample, innovation);
  }
};

/// Matrices of run-time size, every product in full.
template <std::size_t N>
struct TextbookSteps {
  TextbookSteps() {
    for (const auto& sample : input) {
      speeds.emplace_back(
          Eigen::Map<const Eigen::VectorXd>(sample.speed_rad_s.data(), static_cast<Eigen::Index>(N)));
    }
  }

  std::vector<typename SignalPowerEkf<double, N>::Sample> input = samples<double, N>();
  std::vector<Eigen::VectorXd> speeds;
  test::DenseSignalPowerEkf ekf{
      {.rotors = static_cast<Eigen::Index>(N), .mass_kg = kMass_kg, .radius_m = kRadius_m}};
  std::size_t taken = 0;

  double step() {
    const std::size_t k = taken % kSamples;
    ekf.update(0.002 * static_cast<double>(++taken), input[k].ax_m_s2, input[k].ay_m_s2, speeds[k]);
    return ekf.x(0);
  }
};

/// (2) to (6) only, without checks, limits, information or counters: the least a step can cost.
template <std::size_t N>
struct ByHandFilter {
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
struct ByHandSteps {
  ByHandSteps() {
    for (std::size_t i = 0; i < N; ++i) filter.p[i][i] = 0.01;
    filter.p[N][N] = 0.0025;
  }

  std::vector<typename SignalPowerEkf<double, N>::Sample> input = samples<double, N>();
  ByHandFilter<N> filter;
  std::size_t taken = 0;

  double step() {
    const auto& sample = input[taken++ % kSamples];
    const double a[2] = {sample.ax_m_s2, sample.ay_m_s2};
    filter.step(a, sample.speed_rad_s.data());
    return filter.x[0];
  }
};

/// Calls run(steps) for a method and a number of rotors; false if there are none.
constexpr auto with_steps = [](std::string_view method, std::int64_t rotors, const auto& run) {
  return with_rotor_count(rotors, [&](auto count) {
    constexpr std::size_t kN = count;
    return run_method(method, run, Method<SignalPowerSteps<double, kN>>{"signal_power_double"},
                      Method<SignalPowerSteps<float, kN>>{"signal_power_float"},
                      Method<SignalPowerSteps<double, kN, RotorBands<double, kN>>>{"rotor_bands_double"},
                      Method<SignalPowerSteps<float, kN, RotorBands<float, kN>>>{"rotor_bands_float"},
                      Method<TextbookSteps<kN>>{"textbook_signal_power"},
                      Method<ByHandSteps<kN>>{"signal_power_by_hand"});
  });
};

}  // namespace airworthy::bench
