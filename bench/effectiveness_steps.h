#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string_view>

#include "bench/methods.h"
#include "core/detectors/effectiveness/effectiveness_monitor.h"
#include "core/estimators/effectiveness/loss_of_effectiveness_filter.h"
#include "tests/support/reference/dense_effectiveness_filter.h"
#include "tests/support/rotor_ring.h"

namespace airworthy::bench {

inline constexpr double kHover_rad_s = 640.0;

/// With propellers and limits, which the whole detector asks for.
inline Multirotor ring(std::size_t rotors) {
  Multirotor vehicle = test::bebop_ring(rotors);
  vehicle.propeller_radius_m = 0.07;
  vehicle.propeller_inertia_kg_m2 = 5e-6;
  vehicle.motor_time_constant_s = 0.02;
  vehicle.speed_min_rad_s = 100.0;
  vehicle.speed_max_rad_s = 1300.0;
  return vehicle;
}

/// A rate that saws up and down, the same for all.
struct Saw {
  double value = 0.0;

  double next() {
    value = value > 1.0 ? 0.0 : value + 0.01;
    return value;
  }
};

/// The filter as it flies, low-passes included.
template <class Scalar, std::size_t N>
struct FilterSteps {
  LossOfEffectivenessFilter<Scalar> filter{EffectivenessMatrix<Scalar>::of(ring(N)), {}};
  std::array<Scalar, N> speed{};
  Saw rate;

  FilterSteps() { speed.fill(Scalar(kHover_rad_s)); }

  double step() {
    const Scalar now = static_cast<Scalar>(rate.next());
    static_cast<void>(
        filter.update(Scalar(0.002), std::span<const Scalar>{speed}, {now, -now, Scalar{0}}, Scalar(-9.8)));
    return static_cast<double>(filter.effectiveness(0));
  }
};

/// The Kalman update alone, dense, of run-time size.
template <std::size_t N>
struct TextbookFilterSteps {
  static constexpr auto kSize = static_cast<Eigen::Index>(N);

  TextbookFilterSteps() {
    const auto matrix = EffectivenessMatrix<double>::of(ring(N));
    for (std::size_t i = 0; i < N; ++i) {
      H.col(static_cast<Eigen::Index>(i)) << matrix.per_speed2[kRollRow][i], matrix.per_speed2[kPitchRow][i],
          matrix.per_speed2[kVerticalRow][i];
    }
    H *= kHover_rad_s * kHover_rad_s;
  }

  Eigen::MatrixXd H{3, kSize};
  Eigen::MatrixXd R = Eigen::MatrixXd::Identity(3, 3);
  Eigen::VectorXd z{3};
  reference::DenseEffectivenessFilter filter{Eigen::VectorXd::Ones(kSize),
                                             0.01 * Eigen::MatrixXd::Identity(kSize, kSize)};
  Saw rate;

  double step() {
    const double now = rate.next();
    z << now, -now, -9.8;
    filter.update(H, z, R, 0.01, 0.0, 1.5);
    return filter.k(0);
  }
};

/// The Kalman update alone, in plain loops of fixed size.
template <std::size_t N>
struct ByHandFilterSteps {
  EffectivenessMatrix<double> matrix = EffectivenessMatrix<double>::of(ring(N));
  double k[N];
  double p[N][N] = {};
  Saw rate;

  ByHandFilterSteps() {
    for (double& one : k) one = 1.0;
  }

  double step() {
    constexpr std::array kRows{kRollRow, kPitchRow, kVerticalRow};
    const double now = rate.next();
    const double z[3] = {now, -now, -9.8};
    for (std::size_t i = 0; i < N; ++i) p[i][i] += 0.01;
    for (std::size_t row = 0; row < 3; ++row) {
      double h[N];
      double ph[N];
      double innovation = z[row];
      double variance = 1.0;
      for (std::size_t i = 0; i < N; ++i) {
        h[i] = matrix.per_speed2[kRows[row]][i] * kHover_rad_s * kHover_rad_s;
        innovation -= h[i] * k[i];
      }
      for (std::size_t i = 0; i < N; ++i) {
        ph[i] = 0.0;
        for (std::size_t j = 0; j < N; ++j) ph[i] += p[i][j] * h[j];
        variance += h[i] * ph[i];
      }
      for (std::size_t i = 0; i < N; ++i) {
        const double gain = ph[i] / variance;
        k[i] += gain * innovation;
        for (std::size_t j = 0; j < N; ++j) p[i][j] -= gain * ph[j];
      }
    }
    for (double& one : k) one = one < 0.0 ? 0.0 : one > 1.5 ? 1.5 : one;
    return k[0];
  }
};

/// One inertial sample of the whole detector.
template <std::size_t N>
struct DetectorSteps {
  static effectiveness::EffectivenessParams params() {
    effectiveness::EffectivenessParams result;
    result.vehicle = ring(N);
    result.effectiveness = EffectivenessMatrix<double>::of(result.vehicle);
    result.mapping_is_known = true;
    result.speeds = {
        .rotor_count = N, .time_constant_s = 0.02, .speed_min_rad_s = 100.0, .speed_max_rad_s = 1300.0};
    return result;
  }

  effectiveness::EffectivenessMonitor monitor{params()};
  std::array<double, N> speed{};
  std::int64_t taken = 0;

  /// From where on every sample is judged.
  DetectorSteps() {
    while (to_seconds(Duration{2000 * taken}) < 4.0) step();
  }

  double step() {
    const TimePoint time = from_us(2000 * ++taken);
    speed.fill(taken % 2 == 0 ? kHover_rad_s : kHover_rad_s + 0.5);
    static_cast<void>(monitor.on_speeds(time, speed));
    constexpr std::array kNoise{0.01, -0.004, -0.006};  // never the same twice: that would be no measurement
    const double noise = kNoise[static_cast<std::size_t>(taken % 3)];
    const double judged_s = monitor.judged_s();
    static_cast<void>(monitor.on_imu(time, {0.0, 0.0, noise - 9.8}, {noise, noise, 0.0}, Phase::kInFlight));
    if (taken >= 2000 && !(monitor.judged_s() > judged_s)) {
      std::fputs("detector_sample: a sample was not judged\n", stderr);
      std::abort();
    }
    return monitor.judged_s();
  }
};

/// Calls run(steps) for a method and a number of rotors; false if there are none.
constexpr auto with_steps = [](std::string_view method, std::int64_t rotors, const auto& run) {
  return with_rotor_count(rotors, [&](auto count) {
    constexpr std::size_t kN = count;
    return run_method(
        method, run, Method<FilterSteps<double, kN>>{"filter_double"},
        Method<FilterSteps<float, kN>>{"filter_float"}, Method<TextbookFilterSteps<kN>>{"textbook_filter"},
        Method<ByHandFilterSteps<kN>>{"by_hand_filter"}, Method<DetectorSteps<kN>>{"detector_sample"});
  });
};

}  // namespace airworthy::bench
