#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
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

/// What the speeds are taken from.
enum class SpeedSource : std::uint8_t {
  kNone,
  kTelemetry,             ///< reports alone
  kTelemetryAndCommands,  ///< commands between reports, corrected by them
  kCommands,              ///< no rotor reports: what was commanded, through the lag of the motors
};

/// Rotor speeds at the moment of an inertial sample, from commands that come before their effect and telemetry
/// that comes late, slow and noisy.
///   Motor       ω̇ = (s·ω*(t − t_c) − ω)/τ,  ω* between two commands linear; trapezoidal rule                (1)
///   Telemetry   e = ω_tel − ω(t − t_t);  ω ← ω + K·e,  s ← s + K_s·e/ω*,  K = 1 − Δt-weighted forgetting       (2)
///   Without commands  ω = telemetry, linear between two, the newest held                                 (3)
///   Without telemetry (1) alone, with the last s, once no rotor has reported for 0.25 s. A rotor that is silent while
///               others report is not taken for one without telemetry: its motor may stand             (5)
///   Gaps of (5), and where reports come more than 25 ms apart: commands that come every T are not known between: a random walk of their own diffusion D, estimated from
///               their changes, leaves σ² = s²·D·(T/6 + time since the newest)                          (6)
///   Symbols     τ → time_constant_s; t_c, t_t → latencies; s → scale: battery sag and command curve
///   Plausible   a reported speed is refused beyond 1.6 full speeds, or if it jumps by more than a third of
///               full speed from the last one less than 50 ms ago, until three in a row agree               (4)
/// Times of a kind must not go back; what does is refused and counted. Where that is by more than 0.5 s, and the newest is
/// as far ahead of the prediction, the stamp of the newest was wrong: it is forgotten. No heap.
template <class Scalar, std::size_t kMost = kMaxRotors>
class RotorSpeedPredictor {
 public:
  enum class Telemetry : std::uint8_t { kGood, kMissing, kImplausible, kFrozen };

  explicit RotorSpeedPredictor(const RotorSpeedParams<Scalar>& params) noexcept : params_{params} {
    scale_.fill(Scalar{1});
  }

  void on_command(TimePoint time, std::span<const Scalar> command_ratio) noexcept {
    if (command_ratio.size() != params_.rotor_count) return refuse();
    Sample sample{time, {}};
    for (std::size_t i = 0; i < params_.rotor_count; ++i) {
      if (!std::isfinite(command_ratio[i])) return refuse();
      sample.value[i] = params_.speed_min_rad_s + std::clamp(command_ratio[i], Scalar{0}, Scalar{1}) *
                                                      (params_.speed_max_rad_s - params_.speed_min_rad_s);
    }
    if (is_wrong_future(commands_, time)) commands_.forget_from(time);
    if (!newer(commands_, time)) return refuse();
    watch_changes(sample);
    commands_.push(sample);
  }

  /// NaN = not in this message. Links that report the rotors in groups may stamp all groups alike: what a message of the
  /// newest time adds is joined to it.
  void on_speed(TimePoint time, std::span<const Scalar> speed_rad_s) noexcept {
    if (speed_rad_s.size() != params_.rotor_count) return refuse();
    if (speeds_.size > 0 && time == speeds_.newest().time) return join_newest(time, speed_rad_s);
    if (is_wrong_future(speeds_, time)) forget_reports_from(time);
    if (!newer(speeds_, time)) return refuse();
    for (std::size_t i = 0; i < params_.rotor_count; ++i) hear(i, time, speed_rad_s[i]);
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

  /// Moves to `time`; before the last or long after it starts anew. False while no speed is known.
  [[nodiscard]] bool advance(TimePoint time) noexcept {
    const SpeedSource source = source_at(time);
    if (source == SpeedSource::kNone) return false;
    if (source_ == SpeedSource::kNone || time < now_ || time - now_ > kLongestStep || source != source_)
      restart(time, source);
    const Scalar dt_s = static_cast<Scalar>(to_seconds(time - now_));
    if (uses_commands()) {
      follow_commands(time, dt_s);
      if (source_ == SpeedSource::kTelemetryAndCommands) correct(time);
    } else {
      for (std::size_t i = 0; i < params_.rotor_count; ++i) speed_[i] = reported(i, time);
    }
    now_ = time;
    remember({time, speed_});
    return true;
  }

  [[nodiscard]] Scalar speed(std::size_t i) const noexcept { return speed_[i]; }
  [[nodiscard]] std::span<const Scalar> speeds() const noexcept {
    return std::span{speed_}.first(params_.rotor_count);
  }
  /// What the speed was at a time not long ago: 0.128 s, however often it is asked.
  [[nodiscard]] Scalar speed_at(std::size_t i, TimePoint time) const noexcept { return history_.at(i, time); }
  [[nodiscard]] TimePoint now() const noexcept { return now_; }
  /// s of (2).
  [[nodiscard]] Scalar scale(std::size_t i) const noexcept { return scale_[i]; }
  /// How far the prediction reaches beyond what is known.
  [[nodiscard]] Duration staleness() const noexcept { return std::max(Duration{0}, now_ - known_until()); }
  [[nodiscard]] SpeedSource source() const noexcept { return source_; }
  [[nodiscard]] bool uses_commands() const noexcept {
    return source_ == SpeedSource::kTelemetryAndCommands || source_ == SpeedSource::kCommands;
  }
  /// Whether reports come often enough to correct what follows from the commands within their gaps.
  [[nodiscard]] bool is_well_reported() const noexcept {
    return source_ == SpeedSource::kTelemetry ||
           (source_ == SpeedSource::kTelemetryAndCommands && report_interval_s() <= kOften_s);
  }
  /// σ of (6) now, rad/s; 0 unless the speeds follow from commands.
  [[nodiscard]] Scalar gap_sigma(std::size_t i) const noexcept {
    if (is_well_reported()) return Scalar{0};
    const Scalar beyond_s = static_cast<Scalar>(to_seconds(staleness()));
    return scale_[i] * std::sqrt(change_[i] * (command_interval_s_ / Scalar{6} + beyond_s));
  }
  /// T of (6).
  [[nodiscard]] Scalar command_interval_s() const noexcept { return command_interval_s_; }
  /// Mean interval of the reports, of the rotor that reports most seldom; 0 before the second.
  [[nodiscard]] Scalar report_interval_s() const noexcept {
    Scalar most{0};
    for (std::size_t i = 0; i < params_.rotor_count; ++i) most = std::max(most, report_[i].interval_s);
    return most;
  }
  /// Whether a report of rotor i should have come since the last one, by its own mean interval.
  [[nodiscard]] bool is_overdue(std::size_t i, TimePoint now) const noexcept {
    const Report& report = report_[i];
    return report.heard &&
           to_seconds(now - report.heard_at) > static_cast<double>(kOverdue * report.interval_s);
  }
  /// Stamp of the newest report of rotor i that was not refused.
  [[nodiscard]] std::optional<TimePoint> accepted_at(std::size_t i) const noexcept {
    return report_[i].accepted ? std::optional{report_[i].time} : std::nullopt;
  }
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
  static constexpr std::size_t kReceived = 32;
  static constexpr std::size_t kHistory = 64;
  static constexpr Duration kHistoryStep{
      4'000};  // every second sample of the history is at least so much later
  static constexpr Duration kWrongStamp{500'000};
  static constexpr Duration kCommandsFresh{100'000};
  static constexpr Duration kCommandsLast{250'000};  // without telemetry
  static constexpr Scalar kChangeTime_s = Scalar(1);
  static constexpr Scalar kIntervalShare = Scalar(0.05);  // of the newest in its running mean
  static constexpr Scalar kOverdue = Scalar(2);           // intervals
  static constexpr Scalar kOften_s = Scalar(0.025);       // the mean interval of reports
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
  template <std::size_t kSamples>
  struct Ring {
    std::array<Sample, kSamples> samples{};
    std::size_t size = 0;
    std::size_t next = 0;

    void push(const Sample& sample) noexcept {
      samples[next] = sample;
      next = (next + 1) % kSamples;
      size = std::min(size + 1, kSamples);
    }
    /// 0 = newest.
    [[nodiscard]] const Sample& back(std::size_t age) const noexcept {
      return samples[(next + 2 * kSamples - 1 - age) % kSamples];
    }
    [[nodiscard]] const Sample& newest() const noexcept { return back(0); }
    [[nodiscard]] Sample& newest() noexcept { return samples[(next + kSamples - 1) % kSamples]; }

    /// Takes out what is not before `time`.
    void forget_from(TimePoint time) noexcept {
      for (; size > 0 && newest().time >= time; --size) next = (next + kSamples - 1) % kSamples;
    }

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
    bool heard = false;  // accepted or not
    TimePoint heard_at{};
    Scalar interval_s = 0;
  };

  void hear(std::size_t i, TimePoint time, Scalar speed) noexcept {
    if (!std::isfinite(speed)) return;
    Report& report = report_[i];
    if (report.heard && time - report.heard_at < kMissingAfter) {
      const Scalar since_s = static_cast<Scalar>(to_seconds(time - report.heard_at));
      const bool is_first = !(report.interval_s > Scalar{0});
      report.interval_s += (is_first ? Scalar{1} : kIntervalShare) * (since_s - report.interval_s);
    }
    report.heard = true;
    report.heard_at = time;
  }

  void watch_changes(const Sample& sample) noexcept {  // D and T of (6)
    if (commands_.size == 0) return;
    const Sample& before = commands_.newest();
    const Scalar dt_s = static_cast<Scalar>(to_seconds(sample.time - before.time));
    if (sample.time - before.time > kCommandsLast) return;
    const bool is_first = !(command_interval_s_ > Scalar{0});
    command_interval_s_ += (is_first ? Scalar{1} : kIntervalShare) * (dt_s - command_interval_s_);
    const Scalar share = dt_s / (kChangeTime_s + dt_s);
    for (std::size_t i = 0; i < params_.rotor_count; ++i) {
      const Scalar change = sample.value[i] - before.value[i];
      change_[i] += share * (change * change / dt_s - change_[i]);
    }
  }

  [[nodiscard]] SpeedSource source_at(TimePoint time) const noexcept {
    const auto within = [&](Duration age) {
      return commands_.size > 0 && time - commands_.newest().time < age;
    };
    bool reports = false;
    for (std::size_t i = 0; i < params_.rotor_count; ++i)
      reports = reports || (report_[i].heard && time - report_[i].heard_at < kMissingAfter);
    if (!reports && within(kCommandsLast)) return SpeedSource::kCommands;  // (5)
    if (speeds_.size == 0) return SpeedSource::kNone;
    return within(kCommandsFresh) ? SpeedSource::kTelemetryAndCommands : SpeedSource::kTelemetry;
  }

  void join_newest(TimePoint time, std::span<const Scalar> speed_rad_s) noexcept {
    Sample& newest = speeds_.newest();
    bool repeats = false;
    for (std::size_t i = 0; i < params_.rotor_count; ++i) {
      if (!std::isfinite(speed_rad_s[i])) continue;
      if (std::isfinite(newest.value[i])) {
        repeats = true;
        continue;
      }
      hear(i, time, speed_rad_s[i]);
      if (accept(i, time, std::abs(speed_rad_s[i]))) newest.value[i] = std::abs(speed_rad_s[i]);
    }
    if (repeats) refuse();
  }

  using Received = Ring<kReceived>;
  static bool newer(const Received& ring, TimePoint time) noexcept {
    return ring.size == 0 || time > ring.newest().time;
  }
  /// Whether a message of `time` shows that the newest was stamped in the future.
  [[nodiscard]] bool is_wrong_future(const Received& ring, TimePoint time) const noexcept {
    return ring.size > 0 && ring.newest().time - time > kWrongStamp &&
           ring.newest().time - now_ > kWrongStamp;
  }
  void forget_reports_from(TimePoint time) noexcept {
    speeds_.forget_from(time);
    for (std::size_t i = 0; i < params_.rotor_count; ++i) {
      Report& report = report_[i];
      report.heard_at = std::min(report.heard_at, time);
      report.time = std::min(report.time, time);
      report.same_since = std::min(report.same_since, time);
      corrected_until_[i] = std::min(corrected_until_[i], time - Duration{1});
    }
  }
  /// The newest always; those before it as far apart as kHistory of them need to reach back far enough.
  void remember(const Sample& sample) noexcept {
    if (history_.size > 1 && sample.time - history_.back(1).time < kHistoryStep) {
      history_.newest() = sample;
    } else {
      history_.push(sample);
    }
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

  void restart(TimePoint time, SpeedSource source) noexcept {
    const bool goes_on = source_ != SpeedSource::kNone && time >= now_ && time - now_ <= kLongestStep;
    source_ = source;
    history_.size = history_.next = 0;
    if (source == SpeedSource::kCommands) {
      const TimePoint middle = time - params_.command_latency;
      for (std::size_t i = 0; i < params_.rotor_count && !goes_on; ++i)
        speed_[i] = scale_[i] * commands_.at(i, middle);
      if (!goes_on) now_ = time;
      return;
    }
    now_ = time;
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
  Ring<kReceived> commands_;
  Ring<kReceived> speeds_;
  Ring<kHistory> history_;
  std::array<Report, kMost> report_{};
  std::array<Scalar, kMost> speed_{};
  std::array<Scalar, kMost> scale_{};
  TimePoint now_{};
  std::array<TimePoint, kMost> corrected_until_{};
  SpeedSource source_ = SpeedSource::kNone;
  std::array<Scalar, kMost> change_{};  ///< D of (6), (rad/s)²/s
  Scalar command_interval_s_ = 0;
  std::int64_t refused_ = 0;
  std::int64_t refused_speeds_ = 0;
};

}  // namespace airworthy
