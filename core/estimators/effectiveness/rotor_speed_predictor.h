#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/time/time.h"
#include "core/vehicle/multirotor.h"

namespace airworthy {

template <class Scalar>
struct RotorSpeedParams {
  std::size_t rotor_count = 0;
  Scalar time_constant_s = Scalar(0.02);
  Scalar speed_min_rad_s = 0;               ///< at command 0
  Scalar speed_max_rad_s = 0;               ///< at command 1
  Duration command_latency{0};              ///< from the stamp of a command until the motor begins to follow
  Duration telemetry_latency{0};            ///< from the measurement of a speed to its stamp
  Scalar correction_time_s = Scalar(0.05);  ///< within which telemetry corrects the predicted speed
  Scalar scale_time_s = Scalar(0.5);        ///< and the speed that a command gives
};

/// Rotor speeds at the moment of an inertial sample, from commands that come before their effect and telemetry
/// that comes late, slow and noisy.
///   Motor       ω̇ = (s·ω*(t − t_c) − ω)/τ,  ω* between two commands linear; trapezoidal rule                (1)
///   Telemetry   e = ω_tel − ω(t − t_t);  ω ← ω + K·e,  s ← s + K_s·e/ω*,  K = 1 − Δt-weighted forgetting       (2)
///   Without commands  ω = telemetry, linear between two, the newest held                                 (3)
///   Symbols     τ → time_constant_s; t_c, t_t → latencies; s → scale: battery sag and command curve
///   Plausible   a reported speed is refused beyond 1.6 full speeds, or if it jumps by more than a third of
///               full speed from the last one less than 50 ms ago, until three in a row agree               (4)
/// Times of a kind must not go back; what does is refused and counted. No heap.
template <class Scalar, std::size_t kMost = kMaxRotors>
class RotorSpeedPredictor {
 public:
  enum class Telemetry : std::uint8_t { kGood, kMissing, kImplausible, kFrozen };

  explicit RotorSpeedPredictor(const RotorSpeedParams<Scalar>& params) noexcept : params_{params} {
    scale_.fill(Scalar{1});
  }

  void on_command(TimePoint time, std::span<const Scalar> command_ratio) noexcept {
    if (command_ratio.size() != params_.rotor_count || !newer(commands_, time)) return refuse();
    Sample sample{time, {}};
    for (std::size_t i = 0; i < params_.rotor_count; ++i) {
      if (!std::isfinite(command_ratio[i])) return refuse();
      sample.value[i] = params_.speed_min_rad_s + std::clamp(command_ratio[i], Scalar{0}, Scalar{1}) *
                                                      (params_.speed_max_rad_s - params_.speed_min_rad_s);
    }
    commands_.push(sample);
  }

  /// NaN = not in this message. Links that report the rotors in groups may stamp all groups alike: what a message of the
  /// newest time adds is joined to it.
  void on_speed(TimePoint time, std::span<const Scalar> speed_rad_s) noexcept {
    if (speed_rad_s.size() != params_.rotor_count) return refuse();
    if (speeds_.size > 0 && time == speeds_.newest().time) return join_newest(time, speed_rad_s);
    if (!newer(speeds_, time)) return refuse();
    Sample sample{time, {}};
    bool any = false;
    for (std::size_t i = 0; i < params_.rotor_count; ++i) {
      sample.value[i] = accept(i, time, std::abs(speed_rad_s[i])) ? std::abs(speed_rad_s[i])
                                                                  : std::numeric_limits<Scalar>::quiet_NaN();
      any = any || std::isfinite(sample.value[i]);
    }
    if (!any) return;
    speeds_.push(sample);
  }

  /// Up to when the speeds follow from what has been received.
  [[nodiscard]] TimePoint known_until() const noexcept {
    TimePoint known = TimePoint::min();
    if (commands_.size > 0) known = std::max(known, commands_.newest().time + params_.command_latency);
    if (speeds_.size > 0) known = std::max(known, speeds_.newest().time - params_.telemetry_latency);
    return known;
  }

  /// Moves to `time`, not before the last; false while no speed is known.
  [[nodiscard]] bool advance(TimePoint time) noexcept {
    if (speeds_.size == 0 && commands_.size == 0) return false;
    const bool by_commands =
        commands_.size > 0 && time - commands_.newest().time < kCommandsFresh && speeds_.size > 0;
    if (!by_commands && speeds_.size == 0) return false;
    if (!started_ || time - now_ > kLongestStep || by_commands != by_commands_) restart(time, by_commands);
    const Scalar dt_s = static_cast<Scalar>(to_seconds(time - now_));
    if (by_commands) {
      follow_commands(time, dt_s);
      correct(time);
    } else {
      for (std::size_t i = 0; i < params_.rotor_count; ++i) speed_[i] = reported(i, time);
    }
    now_ = time;
    history_.push({time, speed_});
    return true;
  }

  [[nodiscard]] Scalar speed(std::size_t i) const noexcept { return speed_[i]; }
  [[nodiscard]] std::span<const Scalar> speeds() const noexcept {
    return std::span{speed_}.first(params_.rotor_count);
  }
  /// s of (2).
  [[nodiscard]] Scalar scale(std::size_t i) const noexcept { return scale_[i]; }
  /// How far the prediction reaches beyond what is known.
  [[nodiscard]] Duration staleness() const noexcept { return std::max(Duration{0}, now_ - known_until()); }
  [[nodiscard]] bool uses_commands() const noexcept { return by_commands_; }
  [[nodiscard]] Telemetry telemetry(std::size_t i, TimePoint now) const noexcept {
    const Report& report = report_[i];
    if (report.refused_share > kMostRefused) return Telemetry::kImplausible;
    if (report.same >= kFrozenMessages && report.time - report.same_since >= kFrozenTime)
      return Telemetry::kFrozen;
    return report.accepted && now - report.time < kMissingAfter ? Telemetry::kGood : Telemetry::kMissing;
  }
  [[nodiscard]] std::int64_t refused_messages() const noexcept { return refused_; }
  [[nodiscard]] std::int64_t refused_speeds() const noexcept { return refused_speeds_; }

 private:
  static constexpr std::size_t kHistory = 32;
  static constexpr Duration kCommandsFresh{100'000};
  static constexpr Duration kLongestStep{100'000};
  static constexpr Duration kJumpWithin{50'000};
  static constexpr Duration kMissingAfter{250'000};
  static constexpr Duration kFrozenTime{300'000};
  static constexpr int kFrozenMessages = 25;
  static constexpr Scalar kMostRatio = Scalar(1.6);
  static constexpr Scalar kMostJump = Scalar(0.35);
  static constexpr Scalar kAgree = Scalar(0.08);
  static constexpr Scalar kMostRefused = Scalar(0.4);
  static constexpr Scalar kRefusedShare = Scalar(0.05);  // of the newest message in its running mean

  struct Sample {
    TimePoint time;
    std::array<Scalar, kMost> value{};
  };
  struct Ring {
    std::array<Sample, kHistory> samples{};
    std::size_t size = 0;
    std::size_t next = 0;

    void push(const Sample& sample) noexcept {
      samples[next] = sample;
      next = (next + 1) % kHistory;
      size = std::min(size + 1, kHistory);
    }
    /// 0 = newest.
    [[nodiscard]] const Sample& back(std::size_t age) const noexcept {
      return samples[(next + 2 * kHistory - 1 - age) % kHistory];
    }
    [[nodiscard]] const Sample& newest() const noexcept { return back(0); }
    [[nodiscard]] Sample& newest() noexcept { return samples[(next + kHistory - 1) % kHistory]; }

    /// Linear between the samples around `time`, held beyond them; NaN values are skipped.
    [[nodiscard]] Scalar at(std::size_t i, TimePoint time) const noexcept {
      Scalar later = std::numeric_limits<Scalar>::quiet_NaN();
      TimePoint later_time{};
      for (std::size_t age = 0; age < size; ++age) {
        const Sample& sample = back(age);
        if (!std::isfinite(sample.value[i])) continue;
        if (sample.time <= time) {
          if (!std::isfinite(later)) return sample.value[i];
          const Scalar share = static_cast<Scalar>(to_seconds(time - sample.time)) /
                               static_cast<Scalar>(to_seconds(later_time - sample.time));
          return sample.value[i] + share * (later - sample.value[i]);
        }
        later = sample.value[i];
        later_time = sample.time;
      }
      return later;
    }
  };
  struct Report {
    Scalar last = 0;
    TimePoint time{};
    TimePoint same_since{};
    bool accepted = false;
    int same = 0;
    int disagreeing = 0;
    Scalar candidate = 0;
    Scalar refused_share = 0;
  };

  void join_newest(TimePoint time, std::span<const Scalar> speed_rad_s) noexcept {
    Sample& newest = speeds_.newest();
    bool repeats = false;
    for (std::size_t i = 0; i < params_.rotor_count; ++i) {
      if (!std::isfinite(speed_rad_s[i])) continue;
      if (std::isfinite(newest.value[i])) {
        repeats = true;
      } else if (accept(i, time, std::abs(speed_rad_s[i]))) {
        newest.value[i] = std::abs(speed_rad_s[i]);
      }
    }
    if (repeats) refuse();
  }

  static bool newer(const Ring& ring, TimePoint time) noexcept {
    return ring.size == 0 || time > ring.newest().time;
  }
  void refuse() noexcept { ++refused_; }

  [[nodiscard]] bool accept(std::size_t i, TimePoint time, Scalar speed) noexcept {  // (4)
    Report& report = report_[i];
    if (!std::isfinite(speed)) return false;
    const bool in_range = speed <= kMostRatio * params_.speed_max_rad_s;
    const bool jumps = report.accepted && time - report.time < kJumpWithin &&
                       std::abs(speed - report.last) > kMostJump * params_.speed_max_rad_s;
    bool good = in_range && !jumps;
    if (in_range && jumps) {
      const bool agrees =
          report.disagreeing > 0 && std::abs(speed - report.candidate) <= kAgree * params_.speed_max_rad_s;
      report.disagreeing = agrees ? report.disagreeing + 1 : 1;
      report.candidate = speed;
      good = report.disagreeing >= 3;
    }
    report.refused_share += kRefusedShare * ((good ? Scalar{0} : Scalar{1}) - report.refused_share);
    if (!good) {
      ++refused_speeds_;
      return false;
    }
    report.disagreeing = 0;
    if (!report.accepted || speed != report.last) {
      report.same = 0;
      report.same_since = time;
    }
    ++report.same;
    report.last = speed;
    report.time = time;
    report.accepted = true;
    return true;
  }

  /// Telemetry at `time`, by (3).
  [[nodiscard]] Scalar reported(std::size_t i, TimePoint time) const noexcept {
    const Scalar value = speeds_.at(i, time + params_.telemetry_latency);
    return std::isfinite(value) ? value : report_[i].last;
  }

  void restart(TimePoint time, bool by_commands) noexcept {
    by_commands_ = by_commands;
    started_ = true;
    now_ = time;
    history_.size = history_.next = 0;
    corrected_until_.fill(speeds_.newest().time);
    for (std::size_t i = 0; i < params_.rotor_count; ++i) speed_[i] = reported(i, time);
  }

  void follow_commands(TimePoint time, Scalar dt_s) noexcept {  // (1)
    const Scalar share = dt_s / (params_.time_constant_s + dt_s / Scalar{2});
    const TimePoint middle = now_ + (time - now_) / 2 - params_.command_latency;
    for (std::size_t i = 0; i < params_.rotor_count; ++i) {
      speed_[i] += share * (scale_[i] * commands_.at(i, middle) - speed_[i]);
    }
  }

  void correct(TimePoint time) noexcept {  // (2)
    for (std::size_t age = speeds_.size; age-- > 0;) {
      const Sample& sample = speeds_.back(age);
      const TimePoint measured = sample.time - params_.telemetry_latency;
      if (measured > time || history_.size == 0) continue;
      for (std::size_t i = 0; i < params_.rotor_count; ++i) {
        if (!std::isfinite(sample.value[i]) || sample.time <= corrected_until_[i]) continue;
        const Scalar since_s = static_cast<Scalar>(to_seconds(sample.time - corrected_until_[i]));
        corrected_until_[i] = sample.time;
        const Scalar gain = since_s / (params_.correction_time_s + since_s);
        const Scalar scale_gain = since_s / (params_.scale_time_s + since_s);
        const Scalar error = sample.value[i] - history_.at(i, measured);
        const Scalar wanted = std::max(commands_.at(i, measured), params_.speed_max_rad_s / Scalar{10});
        speed_[i] = std::max(Scalar{0}, speed_[i] + gain * error);
        scale_[i] = std::clamp(scale_[i] + scale_gain * error / wanted, Scalar(0.5), Scalar{2});
      }
    }
  }

  RotorSpeedParams<Scalar> params_;
  Ring commands_;
  Ring speeds_;
  Ring history_;
  std::array<Report, kMost> report_{};
  std::array<Scalar, kMost> speed_{};
  std::array<Scalar, kMost> scale_{};
  TimePoint now_{};
  std::array<TimePoint, kMost> corrected_until_{};
  bool started_ = false;
  bool by_commands_ = false;
  std::int64_t refused_ = 0;
  std::int64_t refused_speeds_ = 0;
};

}  // namespace airworthy
