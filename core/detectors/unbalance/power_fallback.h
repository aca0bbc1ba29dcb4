#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "core/detectors/unbalance/power_policy.h"
#include "core/estimators/unbalance/motor_lag.h"
#include "core/estimators/unbalance/rotor_bands.h"
#include "core/estimators/unbalance/signal_power_ekf.h"
#include "core/vehicle/multirotor.h"

namespace airworthy {

/// Who is out of balance where nobody tells the speeds of the rotors: the signal-power filter in bands that follow the
/// commanded speeds behind the lag of the motors. Takes seconds to a minute, as the rotors turn apart.
template <std::size_t N>
class PowerFallback {
 public:
  static constexpr double kCommandsFresh_s = 0.5;
  using Rotors = std::array<double, N>;

  /// `baseline`, `smallest`: unbalance of the healthy vehicle and growth that is reported, kg·m.
  PowerFallback(const Multirotor& vehicle, const SignalPowerParams& params, const Rotors& baseline_kg_m,
                double smallest_kg_m) noexcept
      : vehicle_{vehicle},
        params_{params},
        policy_{params.reference_kg_m(), baseline_kg_m, smallest_kg_m},
        lag_{vehicle.motor_time_constant_s},
        ekf_{params} {}

  struct Verdict {
    typename PowerPolicy<N>::Verdict rotors;
    std::array<Rotors, N>
        correlation{};  ///< of the errors of two powers; near −1: one can stand for the other
  };

  /// A new flight; each sample is the mean over `averaging_window_s`.
  void restart(double averaging_window_s) noexcept {
    params_.sensor.averaging_window_s = averaging_window_s;
    ekf_ = Ekf{params_};
    policy_.restart();
  }

  /// Something else is judged meanwhile: how long a rotor has led before does not count.
  void pause() noexcept { policy_.restart(); }

  /// Ignores what is older than the last command, or far ahead of the inertial data.
  void on_commands(TimePoint time, std::span<const double, N> command_ratio) noexcept {
    if (is_far_ahead(time)) return;
    if (has_commands_ && time < commanded_at_ && !is_far_ahead(commanded_at_)) return;
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
    typename Ekf::Innovation innovation;
    static_cast<void>(ekf_.update({time, a_x_m_s2, a_y_m_s2, speeds}, innovation));
  }

  [[nodiscard]] bool has_fresh_commands(TimePoint now) const noexcept {
    return has_commands_ && std::abs(to_seconds(now - commanded_at_)) < kCommandsFresh_s;
  }
  [[nodiscard]] bool is_ready() const noexcept { return ekf_.learned_s() >= PowerPolicy<N>::kLeast_s; }

  /// To be asked every `dt_s`.
  [[nodiscard]] Verdict judge(double dt_s) noexcept {
    const auto told = ekf_.isolation();
    return {policy_.judge(told.power, told.information, ekf_.learned_s(), dt_s), told.correlation};
  }

  /// (Uᵢ/U₀)², for a calibration.
  [[nodiscard]] Rotors powers() const noexcept { return ekf_.isolation().power; }
  /// What they rest upon.
  [[nodiscard]] double learned_s() const noexcept { return ekf_.learned_s(); }

 private:
  /// Of the inertial data, if there are any yet.
  [[nodiscard]] bool is_far_ahead(TimePoint time) const noexcept {
    return has_sample_ && to_seconds(time - sampled_at_) > kCommandsFresh_s;
  }

  using Ekf = SignalPowerEkf<double, N, RotorBands<double, N>>;

  Multirotor vehicle_;
  SignalPowerParams params_;
  PowerPolicy<N> policy_;
  MotorLag<double, N> lag_;
  Ekf ekf_;
  Rotors commanded_rad_s_{};
  TimePoint commanded_at_{};
  TimePoint sampled_at_{};
  bool has_commands_ = false;
  bool has_sample_ = false;
};

}  // namespace airworthy
