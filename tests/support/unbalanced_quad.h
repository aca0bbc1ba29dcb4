#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <random>

#include "core/detectors/unbalance/rotor_unbalance_monitor.h"

namespace airworthy::test {

/// Flies a quadrotor whose unbalanced rotors wander about means of their own, and keeps what the monitor said.
struct UnbalancedQuad {
  static constexpr std::size_t kN = 4;
  using Complex = std::complex<double>;
  using Transition = FaultLifeCycle::Transition;

  /// It hovers at 470 rad/s; what it shakes by nature is known.
  static UnbalanceParams with_baseline() {
    UnbalanceParams params;
    params.vehicle.mass_kg = 0.69;
    params.vehicle.thrust_coefficient_N_s2 = 7.64e-6;
    params.vehicle.rotor_count = kN;
    for (std::size_t i = 0; i < kN; ++i) params.vehicle.rotor[i].spin = i < 2 ? -1 : 1;
    params.has_baseline = true;
    params.baseline_m_s2 = {0.2, 0.3, 0.1, 0.4};
    params.baseline_sigma_m_s2.fill(0.05);
    return params;
  }

  static TimePoint at(double time_s) { return from_us(std::llround((1000.0 + time_s) * 1e6)); }

  explicit UnbalancedQuad(const UnbalanceParams& params)
      : vehicle{params.vehicle},
        hover_rad_s{UnbalanceMonitor::hover_speed_rad_s(params.vehicle)},
        monitor{params} {
    monitor.on_phase(Phase::kInFlight);
  }

  void fly(double duration_s) {
    const double end_s = time_s + duration_s;
    for (; time_s < end_s - 1e-9; time_s += dt_s) step();
  }

  [[nodiscard]] const RotorUnbalance& rotor(std::size_t index) const { return monitor.rotors()[index]; }
  [[nodiscard]] UnbalanceNotJudged reason(std::size_t index) const { return rotor(index).reason; }

  Multirotor vehicle;
  double hover_rad_s;
  RotorUnbalanceMonitor<kN> monitor;
  std::array<double, kN> natural{0.2, 0.3, 0.1, 0.4};
  std::array<double, kN> damage{};
  std::array<double, kN> offset_rad_s{-9.0, -2.0, 4.0, 12.0};
  std::array<double, kN> wander_rad_s{6.0, 6.0, 6.0, 6.0};
  std::array<double, kN> wander_rate_rad_s{1.1, 1.6, 1.3, 1.9};
  double speed_error_ratio =
      0.0;  ///< how far the rotors turn from what is commanded: standard deviation, lasting 0.3 s
  bool has_speeds = true;  ///< reported at 100 Hz
  std::array<double, kN> telemetry_factor{1.0, 1.0, 1.0, 1.0};
  std::array<bool, kN> is_frozen{};
  double telemetry_noise = 0.003;
  bool has_commands = false;  ///< reported at 50 Hz
  double noise_m_s2 = 0.4;
  double foreign_m_s2 = 0.0;  ///< along x at 68 Hz, the speed of no rotor
  double window_s = 0.0;
  double dt_s = 0.002;
  double time_s = 0.0;
  double next_report_s = 0.0;

  std::uint32_t blamed = 0;
  std::uint32_t cleared = 0;
  int updates = 0;
  std::uint32_t candidates = 0;
  bool is_ambiguous = false;
  double found_s = -1.0;

 private:
  void step() {
    for (std::size_t i = 0; i < kN; ++i) {
      commanded_rad_s_[i] =
          hover_rad_s + offset_rad_s[i] + wander_rad_s[i] * std::sin(wander_rate_rad_s[i] * time_s);
      speed_rad_s_[i] = commanded_rad_s_[i] * (1.0 + speed_error_ratio * error_[i]);
      phase_rad_[i] += speed_rad_s_[i] * dt_s;
    }
    if (has_speeds && time_s >= next_report_s - 1e-9) tell_speeds();
    if (has_commands && time_s >= next_command_s_) tell_commands();
    const Complex felt = circle();
    if (monitor.on_accel(at(time_s), felt.real(), felt.imag(), window_s)) note();
    if (speed_error_ratio > 0.0) change_errors();
  }

  void tell_speeds() {
    next_report_s += 0.01;
    std::array<double, kN> told;
    for (std::size_t i = 0; i < kN; ++i) {
      told[i] = is_frozen[i]
                    ? 480.0
                    : speed_rad_s_[i] * telemetry_factor[i] * (1.0 + telemetry_noise * normal_(random_));
    }
    monitor.on_speeds(at(time_s), told);
  }

  void tell_commands() {
    next_command_s_ = time_s + 0.02;
    std::array<double, kN> told;
    for (std::size_t i = 0; i < kN; ++i) {
      told[i] = (commanded_rad_s_[i] - vehicle.speed_min_rad_s) /
                (vehicle.speed_max_rad_s - vehicle.speed_min_rad_s);
    }
    monitor.on_commands(at(time_s), told);
  }

  /// What is felt, as x + j·y.
  Complex circle() {
    Complex sum = 0.0;
    for (std::size_t i = 0; i < kN; ++i) {
      const double spin = vehicle.rotor[i].spin;
      const double ratio = speed_rad_s_[i] / hover_rad_s;
      const double half = 0.5 * speed_rad_s_[i] * window_s;
      const double passed = half > 0.0 ? std::sin(half) / half : 1.0;
      sum += ratio * ratio * passed * (natural[i] + damage[i]) * std::polar(1.0, spin * phase_rad_[i]);
    }
    sum += foreign_m_s2 * std::cos(430.0 * time_s);
    return sum + noise_m_s2 * Complex{normal_(random_), normal_(random_)};
  }

  void note() {
    for (std::size_t i = 0; i < kN; ++i) {
      if (rotor(i).transition == Transition::kRaise) {
        blamed |= 1U << i;
        if (found_s < 0.0) found_s = time_s;
      }
      if (rotor(i).transition == Transition::kClear) cleared |= 1U << i;
      if (rotor(i).transition == Transition::kUpdate) ++updates;
    }
    if (monitor.ambiguity() == Transition::kRaise) {
      is_ambiguous = true;
      candidates = monitor.candidates();
    }
  }

  void change_errors() {
    constexpr double kLasts_s = 0.3;
    for (double& error : error_) {
      error += -dt_s / kLasts_s * error + std::sqrt(2.0 * dt_s / kLasts_s) * normal_(random_);
    }
  }

  double next_command_s_ = 0.0;
  std::array<double, kN> commanded_rad_s_{};
  std::array<double, kN> error_{};
  std::array<double, kN> speed_rad_s_{};
  std::array<double, kN> phase_rad_{2.0, 2.0, 2.0, 2.0};
  std::mt19937 random_{9};
  std::normal_distribution<double> normal_;
};

}  // namespace airworthy::test
