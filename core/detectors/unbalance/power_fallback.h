#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "core/estimators/unbalance/motor_lag.h"
#include "core/estimators/unbalance/signal_power_ekf.h"
#include "core/vehicle/multirotor.h"

namespace airworthy {

/// Who is out of balance where nobody tells the speeds of the rotors: the signal-power filter on commanded speeds
/// behind the lag of the motors. Slow: tens of seconds of manoeuvres instead of one.
///
/// A rotor is named when its evidence (a log-likelihood ratio of the filter's least squares) leads that of every other
/// by kLead for kHold_s, not before kLeast_s of flight: a few seconds hold one or two manoeuvres, and a thousand samples
/// of one manoeuvre are no thousand observations.
template <std::size_t N>
class PowerFallback {
 public:
  static constexpr double kLead = 40.0;
  static constexpr double kHold_s = 2.0;
  static constexpr double kLeast_s = 15.0;
  static constexpr double kCommandsFresh_s = 0.5;

  /// `baseline`: powers() of a healthy flight; zeros where there is none.
  PowerFallback(const Multirotor& vehicle, const SignalPowerParams& params,
                const std::array<double, N>& baseline) noexcept
      : vehicle_{vehicle},
        params_{params},
        baseline_{baseline},
        lag_{vehicle.motor_time_constant_s},
        ekf_{params} {}

  /// A new flight.
  void restart() noexcept {
    ekf_ = SignalPowerEkf<double, N>{params_};
    fused_s_ = led_s_ = 0.0;
    leader_ = N;
  }

  void on_commands(TimePoint time, std::span<const double, N> command_ratio) noexcept {
    for (std::size_t i = 0; i < N; ++i) {
      if (!std::isfinite(command_ratio[i])) return;
    }
    for (std::size_t i = 0; i < N; ++i) {
      commanded_rad_s_[i] =
          vehicle_.speed_min_rad_s +
          std::clamp(command_ratio[i], 0.0, 1.0) * (vehicle_.speed_max_rad_s - vehicle_.speed_min_rad_s);
    }
    commanded_at_ = time;
    has_commands_ = true;
  }

  void on_accel(TimePoint time, double a_x_m_s2, double a_y_m_s2) noexcept {
    const double dt_s = has_sample_ ? std::max(0.0, to_seconds(time - sampled_at_)) : 0.0;
    sampled_at_ = time;
    has_sample_ = true;
    if (!has_commands_) return;
    const auto& speeds = lag_.step(commanded_rad_s_, dt_s);
    if (!has_fresh_commands(time)) return;
    typename SignalPowerEkf<double, N>::Innovation innovation;
    const auto status = ekf_.update({time, a_x_m_s2, a_y_m_s2, speeds}, innovation);
    if (status == UpdateStatus::kFused) fused_s_ += dt_s;
  }

  [[nodiscard]] bool has_fresh_commands(TimePoint now) const noexcept {
    return has_commands_ && to_seconds(now - commanded_at_) < kCommandsFresh_s;
  }
  [[nodiscard]] bool is_ready() const noexcept { return fused_s_ >= kLeast_s; }

  struct Verdict {
    std::array<double, N> unbalance_kg_m{};
    std::array<double, N> sigma_kg_m{};
    std::array<double, N> evidence{};
    std::size_t named = N;  ///< N: nobody
  };

  /// To be asked every `dt_s`.
  [[nodiscard]] Verdict judge(double dt_s) noexcept {
    Verdict verdict;
    const auto culprits = ekf_.culprits(baseline_);
    const auto isolation = ekf_.isolation();
    std::size_t first = 0;
    double second = 0.0;
    for (std::size_t i = 0; i < N; ++i) {
      verdict.evidence[i] = culprits.evidence[i];
      verdict.unbalance_kg_m[i] =
          culprits.evidence[i] > 0.0 ? culprits.unbalance_kg_m[i] : ekf_.unbalance_kg_m(i);
      verdict.sigma_kg_m[i] = ekf_.unbalance_sigma_kg_m(isolation.information[i], verdict.unbalance_kg_m[i]);
      if (culprits.evidence[i] > culprits.evidence[first]) first = i;
    }
    for (std::size_t i = 0; i < N; ++i) {
      if (i != first) second = std::max(second, culprits.evidence[i]);
    }
    const bool leads = is_ready() && culprits.evidence[first] - second >= kLead;
    led_s_ = leads && first == leader_ ? led_s_ + dt_s : 0.0;
    leader_ = leads ? first : N;
    if (led_s_ >= kHold_s) verdict.named = first;
    return verdict;
  }

  /// For a calibration.
  [[nodiscard]] std::array<double, N> powers() const noexcept { return ekf_.powers(); }

 private:
  Multirotor vehicle_;
  SignalPowerParams params_;
  std::array<double, N> baseline_;
  MotorLag<double, N> lag_;
  SignalPowerEkf<double, N> ekf_;
  std::array<double, N> commanded_rad_s_{};
  TimePoint commanded_at_{};
  TimePoint sampled_at_{};
  bool has_commands_ = false;
  bool has_sample_ = false;
  double fused_s_ = 0.0;
  double led_s_ = 0.0;
  std::size_t leader_ = N;
};

}  // namespace airworthy
