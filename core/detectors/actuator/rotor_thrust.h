#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "core/time/time.h"
#include "core/vehicle/multirotor.h"

namespace airworthy::actuator {

enum class InputSource : std::uint8_t {
  kAuto,  ///< commands, corrected by measured speeds where there are any; speeds alone where there are no commands
  kSpeed,    ///< measured speeds alone
  kCommand,  ///< commands alone
};

/// What each rotor should give now.
///   ω̂ ← ω̂ + (ω_cmd − ω̂)·(1 − exp(−Δt/τ))     the motor follows its command, first order                   (1)
///   ρⱼ ← ρⱼ + (ω_meas/ω̂ − ρⱼ)·(1 − exp(−Δt/2 s))   battery, motors that are not alike; within 20 %           (2)
///   sⱼ = κ·(ρⱼ·ω̂ⱼ)²/m                           specific thrust of rotor j, m/s²                          (3)
///   h = J·Σ spinⱼ·ρⱼ·ω̂ⱼ                         angular momentum of the rotors about z                    (4)
/// Commands tell the torque of this moment; telemetry arrives late, which a feedback loop turns into a loss that is
/// none, so it only corrects slowly. The limit of ρ keeps a motor that does not follow visible as a loss. With speeds
/// alone, ω̂ follows them by (1) too, and ρ is 1. Inputs more than 0.5 s old, or as far in the future, are no inputs. One
/// that is more than 0.5 s older than the last shows that the stamp of the last was wrong: it is taken.
class RotorThrust {
 public:
  using Speeds = std::array<double, kMaxRotors>;

  RotorThrust(const Multirotor& vehicle, InputSource source) noexcept : vehicle_{vehicle}, source_{source} {}

  /// NaN = this rotor did not report: its last speed holds. Beyond twice full speed it is no speed, and refused. So is a
  /// message for another number of rotors, or (up to 0.5 s) older than the last.
  void on_speeds(TimePoint time, std::span<const double> speed_rad_s) noexcept {
    if (speed_rad_s.size() != vehicle_.rotor_count || is_older(time, measured_at_)) return refuse();
    bool any = false;
    const Speeds before = measured_;
    for (std::size_t i = 0; i < speed_rad_s.size(); ++i) {
      const double speed = std::abs(speed_rad_s[i]);
      if (std::isnan(speed)) continue;
      if (!(speed < 2.0 * vehicle_.speed_max_rad_s)) {
        ++refused_speeds_;
        continue;
      }
      measured_[i] = speed;
      any = true;
    }
    if (any && !measured_at_ && !commanded_at_) modelled_ = measured_;
    if (any && !commanded_at_) note_jump(before, measured_, measured_at_, time);
    if (any) measured_at_ = time;
  }

  /// A message with a command that is not finite, for another number of rotors or (up to 0.5 s) older than the last is
  /// refused.
  void on_commands(TimePoint time, std::span<const double> command_ratio) noexcept {
    if (command_ratio.size() != vehicle_.rotor_count || is_older(time, commanded_at_)) return refuse();
    for (const double ratio : command_ratio) {
      if (!std::isfinite(ratio)) return refuse();
    }
    const double span = vehicle_.speed_max_rad_s - vehicle_.speed_min_rad_s;
    const Speeds before = commanded_;
    for (std::size_t i = 0; i < command_ratio.size(); ++i) {
      commanded_[i] = vehicle_.speed_min_rad_s + std::clamp(command_ratio[i], 0.0, 1.0) * span;
    }
    if (!commanded_at_) modelled_ = commanded_;
    note_jump(before, commanded_, commanded_at_, time);
    commanded_at_ = time;
  }

  void advance(TimePoint now, double dt_s) noexcept {
    const bool speeds = is_fresh(measured_at_, now) && source_ != InputSource::kCommand;
    const bool commands = is_fresh(commanded_at_, now) && source_ != InputSource::kSpeed;
    is_known_ = speeds || commands;
    const double share = 1.0 - std::exp(-dt_s / vehicle_.motor_time_constant_s);
    const double correction = speeds && commands ? 1.0 - std::exp(-dt_s / kCorrection_s) : 0.0;
    const double momentum = angular_momentum_N_m_s();
    for (std::size_t i = 0; i < vehicle_.rotor_count; ++i) {
      modelled_[i] += share * ((commands ? commanded_[i] : measured_[i]) - modelled_[i]);  // (1)
      if (!commands) ratio_[i] = 1.0;
      if (modelled_[i] > 0.0) ratio_[i] += correction * (measured_[i] / modelled_[i] - ratio_[i]);  // (2)
      ratio_[i] = std::clamp(ratio_[i], 1.0 - kMostCorrection, 1.0 + kMostCorrection);
    }
    torque_N_m_ = dt_s > 0.0 ? (angular_momentum_N_m_s() - momentum) / dt_s : 0.0;
  }

  /// What the inputs since the last call may have missed between their samples: the impulse of rotor j, m/s, is uncertain
  /// by half of what its change of thrust does in the time since the input before.
  [[nodiscard]] Speeds take_missed_m_s() noexcept { return std::exchange(missed_m_s_, {}); }

  [[nodiscard]] bool is_known() const noexcept { return is_known_; }
  [[nodiscard]] std::int64_t refused_messages() const noexcept { return refused_messages_; }
  [[nodiscard]] std::int64_t refused_speeds() const noexcept { return refused_speeds_; }
  [[nodiscard]] double speed_rad_s(std::size_t rotor) const noexcept {
    return ratio_[rotor] * modelled_[rotor];
  }
  [[nodiscard]] double specific_thrust_m_s2(std::size_t rotor) const noexcept {  // (3)
    const double speed = speed_rad_s(rotor);
    return vehicle_.thrust_coefficient_N_s2 * speed * speed / vehicle_.mass_kg;
  }
  [[nodiscard]] double angular_momentum_N_m_s() const noexcept {  // (4)
    double sum = 0.0;
    for (std::size_t i = 0; i < vehicle_.rotor_count; ++i) sum += vehicle_.rotor[i].spin * speed_rad_s(i);
    return vehicle_.propeller_inertia_kg_m2 * sum;
  }
  /// What spinning the rotors up takes, about z: the change of (4).
  [[nodiscard]] double spin_up_torque_N_m() const noexcept { return torque_N_m_; }

 private:
  static constexpr Duration kFresh{500'000};
  static constexpr double kLongestPeriod_s = 0.2;
  static constexpr double kCorrection_s = 2.0;
  static constexpr double kMostCorrection = 0.2;
  static bool is_fresh(const std::optional<TimePoint>& since, TimePoint now) noexcept {
    return since && now - *since <= kFresh && *since - now <= kFresh;
  }
  static bool is_older(TimePoint time, const std::optional<TimePoint>& last) noexcept {
    return last && time < *last && *last - time <= kFresh;
  }
  void refuse() noexcept { ++refused_messages_; }

  void note_jump(const Speeds& before, const Speeds& after, const std::optional<TimePoint>& last,
                 TimePoint time) noexcept {
    if (!last) return;
    const double period_s = std::clamp(to_seconds(time - *last), 0.0, kLongestPeriod_s);
    const double thrust = vehicle_.thrust_coefficient_N_s2 / vehicle_.mass_kg;
    for (std::size_t i = 0; i < vehicle_.rotor_count; ++i) {
      missed_m_s_[i] += 0.5 * period_s * thrust * (after[i] * after[i] - before[i] * before[i]);
    }
  }

  Multirotor vehicle_;
  InputSource source_;
  Speeds missed_m_s_{};
  Speeds measured_{};
  Speeds commanded_{};
  Speeds modelled_{};
  std::optional<TimePoint> measured_at_;
  std::optional<TimePoint> commanded_at_;
  Speeds ratio_ = [] {
    Speeds ones{};
    ones.fill(1.0);
    return ones;
  }();
  double torque_N_m_ = 0.0;
  std::int64_t refused_messages_ = 0;
  std::int64_t refused_speeds_ = 0;
  bool is_known_ = false;
};

}  // namespace airworthy::actuator
