#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
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

/// How often an input comes and how late, by the stamps of what it says and of the inertial samples.
class InputPace {
 public:
  /// `now`: the newest inertial sample.
  void hear(TimePoint time, const std::optional<TimePoint>& now) noexcept {
    if (at_ && time > *at_ && time - *at_ <= kGap) {
      const double since_s = to_seconds(time - *at_);
      interval_s_ += (interval_s_ > 0.0 ? kShare : 1.0) * (since_s - interval_s_);
    }
    if (now) late_s_ += kShare * (std::clamp(to_seconds(*now - time), 0.0, kLatest_s) - late_s_);
    at_ = time;
  }
  /// How old it is just before it comes again: mean interval and mean lateness. Of a single one nothing is known: 0.
  [[nodiscard]] double delay_s() const noexcept { return interval_s_ + late_s_; }
  /// Whether it came within `age`, before now or after it.
  [[nodiscard]] bool is_fresh(TimePoint now, Duration age) const noexcept {
    return at_ && now - *at_ <= age && *at_ - now <= age;
  }
  [[nodiscard]] const std::optional<TimePoint>& at() const noexcept { return at_; }

 private:
  static constexpr double kShare = 0.05;  // of the newest in a running mean
  static constexpr double kLatest_s = 0.2;
  static constexpr Duration kGap{500'000};  // no interval

  std::optional<TimePoint> at_;
  double interval_s_ = 0.0;
  double late_s_ = 0.0;
};

/// What each rotor should give now.
///   ω̂ ← ω̂ + (ω_cmd − ω̂)·(1 − exp(−Δt/τ))     the motor follows its command, first order                   (1)
///   ρⱼ ← ρⱼ + (ω_meas/ω̂ − ρⱼ)·(1 − exp(−Δt/2 s))   battery, motors that are not alike; within 20 %           (2)
///   sⱼ = κ·(ρⱼ·ω̂ⱼ)²/m                           specific thrust of rotor j, m/s²                          (3)
///   h = J·Σ spinⱼ·ρⱼ·ω̂ⱼ                         angular momentum of the rotors about z                    (4)
/// Commands tell the torque of this moment; telemetry arrives late, which a feedback loop turns into a loss that is
/// none, so it only corrects slowly. The limit of ρ keeps a motor that does not follow visible as a loss. With speeds
/// alone, ω̂ is what was measured last, and ρ is 1. Inputs more than 0.5 s old, or as far in the future, are no inputs. One
/// that is more than 0.5 s older than the last shows that the stamp of the last was wrong: it is taken.
///
/// What the loop does between two inputs, or before one arrives, looks like a loss. So the input is prompt only if commands
/// come every 30 ms, or the speeds of every rotor every 15 ms, lateness included; prompt commands come before speeds. Up to
/// four times as slow, how far the thrust may have gone meanwhile can be told, for noise; beyond, nothing can be judged.
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
      speed_pace_[i].hear(time, now_);
      any = true;
    }
    if (!any) return;
    if (follows_speeds_) note_jump(before, measured_, measured_at_, time);
    measured_at_ = time;
  }

  /// A message with a command that is not finite, for another number of rotors or (up to 0.5 s) older than the last is
  /// refused.
  void on_commands(TimePoint time, std::span<const double> command_ratio) noexcept {
    if (command_ratio.size() != vehicle_.rotor_count || is_older(time, command_pace_.at())) return refuse();
    for (const double ratio : command_ratio) {
      if (!std::isfinite(ratio)) return refuse();
    }
    const double span = vehicle_.speed_max_rad_s - vehicle_.speed_min_rad_s;
    const Speeds before = commanded_;
    for (std::size_t i = 0; i < command_ratio.size(); ++i) {
      commanded_[i] = vehicle_.speed_min_rad_s + std::clamp(command_ratio[i], 0.0, 1.0) * span;
    }
    if (!command_pace_.at()) modelled_ = commanded_;
    if (!follows_speeds_) note_jump(before, commanded_, command_pace_.at(), time);
    command_pace_.hear(time, now_);
  }

  void advance(TimePoint now, double dt_s) noexcept {
    now_ = now;
    const bool commands = choose_source(now);
    const double share = 1.0 - std::exp(-dt_s / vehicle_.motor_time_constant_s);
    const double correction = 1.0 - std::exp(-dt_s / kCorrection_s);
    const double momentum = angular_momentum_N_m_s();
    for (std::size_t i = 0; i < vehicle_.rotor_count; ++i) {
      if (!commands) {
        modelled_[i] = measured_[i];
        ratio_[i] = 1.0;
        continue;
      }
      modelled_[i] += share * (commanded_[i] - modelled_[i]);  // (1)
      if (modelled_[i] > 0.0 && source_ != InputSource::kCommand && speed_pace_[i].is_fresh(now, kFresh))
        ratio_[i] += correction * (measured_[i] / modelled_[i] - ratio_[i]);  // (2)
      ratio_[i] = std::clamp(ratio_[i], 1.0 - kMostCorrection, 1.0 + kMostCorrection);
    }
    torque_N_m_ = dt_s > 0.0 ? (angular_momentum_N_m_s() - momentum) / dt_s : 0.0;
  }

  /// What the inputs since the last call may have missed between their samples.
  struct Missed {
    Speeds
        impulse_m_s{};  ///< of rotor j: half of what its change of thrust does in the time since the input before
    double period_s = 0.0;  ///< that time; 0 = no input came
  };
  [[nodiscard]] Missed take_missed() noexcept { return std::exchange(missed_, {}); }
  /// By how much the square of the input's delay exceeds that of one that is just prompt; 0 if it is.
  [[nodiscard]] double unknown_s2() const noexcept { return unknown_s2_; }

  [[nodiscard]] bool is_known() const noexcept { return is_known_; }
  /// There is an input, but it comes too seldom or too late.
  [[nodiscard]] bool is_prompt() const noexcept { return is_prompt_; }
  [[nodiscard]] bool is_too_slow() const noexcept { return is_too_slow_; }
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
  static constexpr double kPromptCommand_s = 0.03;
  static constexpr double kPromptSpeed_s = 0.015;
  static constexpr double kMostSlowness = 4.0;
  static constexpr double kSilent = std::numeric_limits<double>::infinity();
  static constexpr Duration kHolds{250'000};
  static bool is_older(TimePoint time, const std::optional<TimePoint>& last) noexcept {
    return last && time < *last && *last - time <= kFresh;
  }
  void refuse() noexcept { ++refused_messages_; }

  // How late and rare a source is, in units of what is prompt.
  static double slowness(const InputPace& pace, TimePoint now, double prompt_s) noexcept {
    const bool holds = pace.at() && now - *pace.at() <= kHolds && *pace.at() - now <= kFresh;
    return holds ? pace.delay_s() / prompt_s : kSilent;
  }

  // Whether commands drive the model.
  bool choose_source(TimePoint now) noexcept {
    const auto rotors = std::span{speed_pace_}.first(vehicle_.rotor_count);
    const bool has_commands = source_ != InputSource::kSpeed && command_pace_.is_fresh(now, kFresh);
    const bool has_speeds = source_ != InputSource::kCommand &&
                            std::any_of(rotors.begin(), rotors.end(),
                                        [&](const InputPace& r) { return r.is_fresh(now, kFresh); });
    const double of_commands = has_commands ? slowness(command_pace_, now, kPromptCommand_s) : kSilent;
    double of_speeds = has_speeds ? 0.0 : kSilent;
    for (const InputPace& rotor : rotors)
      of_speeds = std::max(of_speeds, slowness(rotor, now, kPromptSpeed_s));
    const bool commands = of_commands <= 1.0 || of_commands <= of_speeds;
    const double best = commands ? of_commands : of_speeds;
    const double prompt_s = commands ? kPromptCommand_s : kPromptSpeed_s;
    is_known_ = best <= kMostSlowness;
    is_too_slow_ = !is_known_ && (has_commands || has_speeds);
    is_prompt_ = best <= 1.0;
    unknown_s2_ = is_known_ && !is_prompt_ ? (best * best - 1.0) * prompt_s * prompt_s : 0.0;
    follows_speeds_ = commands ? !has_commands && has_speeds : true;
    return !follows_speeds_;
  }

  void note_jump(const Speeds& before, const Speeds& after, const std::optional<TimePoint>& last,
                 TimePoint time) noexcept {
    if (!last) return;
    const double period_s = std::clamp(to_seconds(time - *last), 0.0, kLongestPeriod_s);
    const double thrust = vehicle_.thrust_coefficient_N_s2 / vehicle_.mass_kg;
    missed_.period_s += period_s;
    for (std::size_t i = 0; i < vehicle_.rotor_count; ++i) {
      missed_.impulse_m_s[i] += 0.5 * period_s * thrust * (after[i] * after[i] - before[i] * before[i]);
    }
  }

  Multirotor vehicle_;
  InputSource source_;
  Missed missed_;
  Speeds measured_{};
  Speeds commanded_{};
  Speeds modelled_{};
  std::optional<TimePoint> measured_at_;
  std::array<InputPace, kMaxRotors> speed_pace_{};
  InputPace command_pace_;
  std::optional<TimePoint> now_;
  Speeds ratio_ = [] {
    Speeds ones{};
    ones.fill(1.0);
    return ones;
  }();
  double torque_N_m_ = 0.0;
  double unknown_s2_ = 0.0;
  std::int64_t refused_messages_ = 0;
  std::int64_t refused_speeds_ = 0;
  bool is_known_ = false;
  bool is_too_slow_ = false;
  bool is_prompt_ = false;
  bool follows_speeds_ = false;
};

}  // namespace airworthy::actuator
