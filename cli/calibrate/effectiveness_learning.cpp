#include "cli/calibrate/effectiveness_learning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "airworthy/esc_status_t.hpp"
#include "airworthy/imu_t.hpp"
#include "airworthy/rotor_command_t.hpp"
#include "cli/calibrate/learning.h"
#include "cli/eval/flight_run.h"
#include "core/estimators/effectiveness/control_regression.h"
#include "core/vehicle/gravity.h"
#include "runtime/bus/channels.h"
#include "runtime/phase/flight_phase_input.h"

namespace airworthy::calibrate {
namespace {

using effectiveness::Calibration;
using effectiveness::EffectivenessConfig;
using effectiveness::EffectivenessMonitor;
using effectiveness::EffectivenessParams;
using Recording = EffectivenessRecording;
using Regression = ControlRegression<double>;

constexpr std::array kRows{kRollRow, kPitchRow, kVerticalRow};
constexpr std::array kAxisNames{"roll", "pitch", "vertical"};
constexpr double kRadPerS_per_rpm = std::numbers::pi / 30.0;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr Duration kBeforeOnset{500'000};
constexpr Duration kSettle{1'000'000};
constexpr Duration kInertialDelayStep{2'500};
constexpr double kLatencyStep_s = 0.002;
constexpr int kLatencies = 21;
constexpr int kLags = 26;
constexpr double kLeastLag_s = 0.004;
constexpr double kLagRatio = 1.15;
constexpr int kDelays = 17;
constexpr double kDelayStep_s = 0.003;
constexpr double kBlock_s = 5.0;
constexpr double kMostCommandInterval_s = 0.025;  // the order of the motors' lag
constexpr double kLongestStep_s = 0.03;           // a longer one is a gap ...
constexpr double kGapSteps = 3.0;                 // ... or one of so many usual steps ...
constexpr double kMostStep_s = 0.05;              // ... of seldom samples
constexpr double kLeastExplained = 0.1;
constexpr double kAsMuch = 0.9;
constexpr double kMostRelativeError = 0.15;

std::array<double, kMaxRotors> values_of(const std::vector<double>& from, double scale) {
  std::array<double, kMaxRotors> to{};
  to.fill(kNaN);
  for (std::size_t i = 0; i < std::min(from.size(), kMaxRotors); ++i) to[i] = std::abs(scale * from[i]);
  return to;
}

/// A series of one rotor at any time: linear between its samples, held beyond; NaN without any. Ask in order of time.
class Series {
 public:
  Series(const std::vector<Recording::PerRotor>& samples, std::size_t rotor) {
    for (const auto& sample : samples) {
      if (!std::isfinite(sample.value[rotor])) continue;
      times_.push_back(sample.time);
      values_.push_back(sample.value[rotor]);
    }
  }

  [[nodiscard]] double at(TimePoint time) {
    if (times_.empty()) return kNaN;
    while (next_ > 0 && times_[next_ - 1] > time) --next_;
    while (next_ < times_.size() && times_[next_] <= time) ++next_;
    if (next_ == 0) return values_.front();
    if (next_ == times_.size()) return values_.back();
    const double share = to_seconds(time - times_[next_ - 1]) / to_seconds(times_[next_] - times_[next_ - 1]);
    return values_[next_ - 1] + share * (values_[next_] - values_[next_ - 1]);
  }

  [[nodiscard]] const std::vector<TimePoint>& times() const { return times_; }
  [[nodiscard]] const std::vector<double>& values() const { return values_; }

 private:
  std::vector<TimePoint> times_;
  std::vector<double> values_;
  std::size_t next_ = 0;
};

double longest_step_s(const Recording& flight) {
  std::vector<double> steps_s;
  for (std::size_t k = 1; k < flight.in_flight.size(); ++k)
    steps_s.push_back(to_seconds(flight.in_flight[k].time - flight.in_flight[k - 1].time));
  if (steps_s.empty()) return kLongestStep_s;
  const auto middle = steps_s.begin() + static_cast<std::ptrdiff_t>(steps_s.size() / 2);
  std::nth_element(steps_s.begin(), middle, steps_s.end());
  return std::clamp(kGapSteps * *middle, kLongestStep_s, kMostStep_s);
}

double command_interval_s(const Recording& flight) {
  std::vector<double> steps_s;
  for (std::size_t k = 1; k < flight.commands.size(); ++k)
    steps_s.push_back(to_seconds(flight.commands[k].time - flight.commands[k - 1].time));
  if (steps_s.empty()) return std::numeric_limits<double>::infinity();
  const auto middle = steps_s.begin() + static_cast<std::ptrdiff_t>(steps_s.size() / 2);
  std::nth_element(steps_s.begin(), middle, steps_s.end());
  return *middle;
}

double flown_s(const Recording& flight) {
  const double longest_s = longest_step_s(flight);
  double seconds = 0.0;
  for (std::size_t k = 1; k < flight.in_flight.size(); ++k) {
    const double dt_s = to_seconds(flight.in_flight[k].time - flight.in_flight[k - 1].time);
    if (dt_s < longest_s) seconds += dt_s;
  }
  return seconds;
}

/// Rotor speeds, rad/s, at every inertial sample of one flight.
using Speeds = std::vector<std::array<double, kMaxRotors>>;

/// As reported, `latency` late.
std::vector<Speeds> reported_speeds(const std::vector<Recording>& flights, const EffectivenessParams& params,
                                    Duration latency) {
  std::vector<Speeds> result;
  for (const Recording& flight : flights) {
    Speeds speeds(flight.in_flight.size());
    for (std::size_t i = 0; i < params.vehicle.rotor_count; ++i) {
      Series series{flight.speeds, i};
      for (std::size_t k = 0; k < speeds.size(); ++k)
        speeds[k][i] = series.at(flight.in_flight[k].time + latency);
    }
    result.push_back(std::move(speeds));
  }
  return result;
}

/// As commanded, through lag and delay.
std::vector<Speeds> commanded_speeds(const std::vector<Recording>& flights, const EffectivenessParams& params,
                                     double lag_s, double delay_s) {
  const double low = params.vehicle.speed_min_rad_s;
  const double span = params.vehicle.speed_max_rad_s - low;
  std::vector<Speeds> result;
  for (const Recording& flight : flights) {
    const double longest_s = longest_step_s(flight);
    Speeds speeds(flight.in_flight.size());
    for (std::size_t i = 0; i < params.vehicle.rotor_count; ++i) {
      Series series{flight.commands, i};
      for (std::size_t k = 0; k < speeds.size(); ++k) {
        const TimePoint time = flight.in_flight[k].time - from_seconds(delay_s);
        const TimePoint before = k == 0 ? time : flight.in_flight[k - 1].time - from_seconds(delay_s);
        const double dt_s = to_seconds(time - before);
        if (k == 0 || dt_s > longest_s) {
          speeds[k][i] = low + span * series.at(time);
        } else {
          const double wanted = low + span * series.at(before + (time - before) / 2);
          speeds[k][i] = speeds[k - 1][i] + dt_s / (lag_s + dt_s / 2.0) * (wanted - speeds[k - 1][i]);
        }
      }
    }
    result.push_back(std::move(speeds));
  }
  return result;
}

bool is_finite(const Recording::Inertial& sample) {
  const auto finite = [](double value) { return std::isfinite(value); };
  return std::all_of(sample.accel_m_s2.begin(), sample.accel_m_s2.end(), finite) &&
         std::all_of(sample.gyro_rad_s.begin(), sample.gyro_rad_s.end(), finite);
}

/// Sums of every block of 5 s. Samples that are not finite are left out, as by the detector.
std::vector<Regression> blocks_of(const std::vector<Recording>& flights, const std::vector<Speeds>& speeds,
                                  const EffectivenessParams& params, double interval_s) {
  const std::size_t n = params.vehicle.rotor_count;
  std::vector<Regression> blocks;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    const double longest_s = longest_step_s(flights[f]);
    double block_s = kBlock_s;
    TimePoint before{};
    for (std::size_t k = 0; k < flights[f].in_flight.size(); ++k) {
      const auto& sample = flights[f].in_flight[k];
      if (!is_finite(sample)) continue;
      const double dt_s = to_seconds(sample.time - before);
      before = sample.time;
      if (block_s >= kBlock_s) {
        blocks.emplace_back(n, interval_s);
        block_s = 0.0;
      } else if (dt_s > longest_s) {
        blocks.back().interrupt();
      }
      block_s += std::min(dt_s, longest_s);
      blocks.back().add(dt_s, std::span{speeds[f][k]}.first(n), sample.gyro_rad_s, sample.accel_m_s2[2]);
    }
  }
  return blocks;
}

/// The sums of all blocks but one (or of all).
Regression::Sums total(const std::vector<Regression>& blocks, EffectivenessRow row, std::size_t but) {
  Regression::Sums sums;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    if (k == but) continue;
    const Regression::Sums& one = blocks[k].sums(row);
    sums.s += one.s;
    sums.intervals += one.intervals;
    for (std::size_t i = 0; i < kMaxRotors; ++i) {
      sums.c[i] += one.c[i];
      for (std::size_t j = 0; j < kMaxRotors; ++j) sums.m[i][j] += one.m[i][j];
    }
  }
  return sums;
}

Calibration::Axis learn_axis(const std::vector<Regression>& blocks, const EffectivenessMatrix<double>& matrix,
                             EffectivenessRow row) {
  const std::size_t n = matrix.rotor_count;
  const auto& described = matrix.per_speed2[row];
  const auto all = total(blocks, row, blocks.size());
  Calibration::Axis axis{all.gain(described, n), 0.0, all.explained(described, n)};
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const double gain = total(blocks, row, k).gain(described, n);
    sum += gain;
    squares += gain * gain;
  }
  const auto count = static_cast<double>(blocks.size());
  axis.gain_sigma =
      std::sqrt(std::max(0.0, (count - 1.0) * (squares / count - sum * sum / (count * count))));  // (2)
  return axis;
}

double shortest_interval_s(const EffectivenessParams& params) {
  return std::max(0.05, 2.0 * params.speeds.time_constant_s);
}

/// How much of roll and pitch these speeds explain.
double score_of(const std::vector<Recording>& flights, const std::vector<Speeds>& speeds,
                const EffectivenessParams& params) {
  const auto blocks = blocks_of(flights, speeds, params, shortest_interval_s(params));
  return learn_axis(blocks, params.effectiveness, kRollRow).explained +
         learn_axis(blocks, params.effectiveness, kPitchRow).explained;
}

rt::Expected<Duration> learn_latency(const std::vector<Recording>& flights,
                                     const EffectivenessParams& params) {
  Duration best{0};
  double most = -1.0;
  for (int k = 0; k < kLatencies; ++k) {  // (1)
    const Duration latency = from_seconds(k * kLatencyStep_s);
    const double score = score_of(flights, reported_speeds(flights, params, latency), params);
    if (score <= most) continue;
    most = score;
    best = latency;
  }
  if (best == from_seconds((kLatencies - 1) * kLatencyStep_s)) {
    return rt::fail_with(fmt::format(
        "rotor speeds (ESC_STATUS) fit the motion best {:.0f} ms late, the most that is looked for: "
        "the latency may be longer",
        1e3 * to_seconds(best)));
  }
  return best;
}

/// Flights whose streams are stamped on arrival: each is moved by the delay that explains most of it.
rt::Expected<std::vector<Recording>> without_inertial_delay(std::vector<Recording> flights,
                                                            const EffectivenessParams& params) {
  for (Recording& flight : flights) {
    const auto delay = inertial_delay_of(flight, params);
    if (!delay) return tl::unexpected<rt::Error>{delay.error()};
    for (auto& sample : flight.in_flight) sample.time -= *delay;
  }
  return flights;
}

/// Intervals with which the less certain of roll and pitch is most certain: longer ones hide more vibration. Of those only
/// that explain as much as any: over long ones the controller's answer to gusts looks like a weak rotor.
std::vector<Regression> best_blocks(const std::vector<Recording>& flights, const std::vector<Speeds>& speeds,
                                    const EffectivenessParams& params) {
  struct Candidate {
    std::vector<Regression> blocks;
    double certainty = std::numeric_limits<double>::infinity();
    double explained = 1.0;
  };
  std::vector<Candidate> candidates;
  double most_explained = 0.0;
  for (const double times : {1.0, 2.0, 4.0}) {
    Candidate one;
    one.blocks = blocks_of(flights, speeds, params, times * shortest_interval_s(params));
    for (const EffectivenessRow row : {kRollRow, kPitchRow}) {
      const auto axis = learn_axis(one.blocks, params.effectiveness, row);
      one.certainty = std::min(one.certainty, axis.gain_sigma > 0.0 ? axis.gain / axis.gain_sigma : 0.0);
      one.explained = std::min(one.explained, axis.explained);
    }
    most_explained = std::max(most_explained, one.explained);
    candidates.push_back(std::move(one));
  }
  Candidate best;
  best.certainty = -1.0;
  for (Candidate& one : candidates) {
    if (one.explained >= kAsMuch * most_explained && one.certainty > best.certainty) best = std::move(one);
  }
  return std::move(best.blocks);
}

struct MotorFit {
  double time_constant_s = 0.0;
  double delay_s = 0.0;  ///< from the stamp of a command to that of the speed
  double squared_error = std::numeric_limits<double>::infinity();
  bool is_at_edge = false;  ///< of the grid: the best may lie beyond
};

double lag_s(int i) { return kLeastLag_s * std::pow(kLagRatio, i); }
constexpr bool is_at_edge(int lag, int delay) { return lag == 0 || lag == kLags - 1 || delay == kDelays - 1; }
std::string edge_error(const MotorFit& motor) {
  return fmt::format(
      "the motors fit the commands (ROTOR_COMMAND) best with a lag of {:.0f} ms after {:.0f} ms, at the edge "
      "of "
      "what is looked for (lags of {:.0f} to {:.0f} ms, up to {:.0f} ms late): they may lie beyond",
      1e3 * motor.time_constant_s, 1e3 * motor.delay_s, 1e3 * lag_s(0), 1e3 * lag_s(kLags - 1),
      1e3 * (kDelays - 1) * kDelayStep_s);
}

/// Squared difference between reported speeds and commands through lag and delay, the best scale taken.
double motor_error(const Recording& flight, const EffectivenessParams& params, std::size_t rotor,
                   double lag_s, double delay_s) {
  constexpr double kStep_s = 0.002;
  Series commands{flight.commands, rotor};
  const Series speeds{flight.speeds, rotor};
  if (commands.times().empty() || speeds.times().empty() || flight.in_flight.empty()) return 0.0;
  const double low = params.vehicle.speed_min_rad_s;
  const double span = params.vehicle.speed_max_rad_s - low;
  const double share = kStep_s / (lag_s + kStep_s / 2.0);
  TimePoint now = flight.in_flight.front().time;
  double speed = low + span * commands.at(now);
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  for (std::size_t k = 0; k < speeds.times().size(); ++k) {
    if (speeds.times()[k] < now + Duration{500'000} || speeds.times()[k] > flight.in_flight.back().time)
      continue;
    for (; now + from_seconds(kStep_s / 2.0) < speeds.times()[k]; now += from_seconds(kStep_s)) {
      speed += share * (low + span * commands.at(now + from_seconds(kStep_s / 2.0 - delay_s)) - speed);
    }
    xx += speed * speed;
    xy += speed * speeds.values()[k];
    yy += speeds.values()[k] * speeds.values()[k];
  }
  return xx > 0.0 ? yy - xy * xy / xx : 0.0;
}

MotorFit learn_motor(const std::vector<Recording>& flights, const EffectivenessParams& params) {
  MotorFit best;
  for (int i = 0; i < kLags; ++i) {  // (3)
    const double lag = lag_s(i);
    for (int j = 0; j < kDelays; ++j) {
      const double delay_s = j * kDelayStep_s;
      double error = 0.0;
      for (const Recording& flight : flights) {
        for (std::size_t rotor = 0; rotor < params.vehicle.rotor_count; ++rotor)
          error += motor_error(flight, params, rotor, lag, delay_s);
      }
      if (error > 0.0 && error < best.squared_error) best = {lag, delay_s, error, is_at_edge(i, j)};
    }
  }
  return best;
}

/// Without reports: the lag and the delay for which what was commanded explains most of roll and pitch.
MotorFit learn_unheard_motor(const std::vector<Recording>& flights, const EffectivenessParams& params) {
  MotorFit best;
  double most = -1.0;
  for (int i = 0; i < kLags; ++i) {  // (6)
    const double lag = lag_s(i);
    for (int j = 0; j < kDelays; ++j) {
      const double delay_s = j * kDelayStep_s;
      const double score = score_of(flights, commanded_speeds(flights, params, lag, delay_s), params);
      if (score <= most) continue;
      most = score;
      best = {lag, delay_s, 0.0, is_at_edge(i, j)};
    }
  }
  return best;
}

/// Plays a recording through the detector, in the order of the stamps.
void learn_noise(const std::vector<Recording>& flights, const EffectivenessParams& params,
                 Calibration& calibration) {
  double gyro2 = 0.0;
  double accel2 = 0.0;
  double weight = 0.0;
  for (const Recording& flight : flights) {
    EffectivenessMonitor monitor{params};
    const std::size_t n = params.vehicle.rotor_count;
    auto speeds = flight.speeds.begin();
    auto commands = flight.commands.begin();
    for (const auto& sample : flight.in_flight) {
      for (; speeds != flight.speeds.end() && speeds->time <= sample.time; ++speeds)
        static_cast<void>(monitor.on_speeds(speeds->time, std::span{speeds->value}.first(n)));
      for (; commands != flight.commands.end() && commands->time <= sample.time; ++commands)
        static_cast<void>(monitor.on_commands(commands->time, std::span{commands->value}.first(n)));
      static_cast<void>(monitor.on_imu(sample.time, sample.accel_m_s2, sample.gyro_rad_s, Phase::kInFlight));
    }
    const auto seconds = static_cast<double>(flight.in_flight.size());
    gyro2 += seconds * std::max(monitor.gyro_sigma(0), monitor.gyro_sigma(1)) *
             std::max(monitor.gyro_sigma(0), monitor.gyro_sigma(1));
    accel2 += seconds * monitor.accel_sigma() * monitor.accel_sigma();
    weight += seconds;
  }
  calibration.gyro_noise_rad_s = std::sqrt(gyro2 / weight);
  calibration.accel_noise_m_s2 = std::sqrt(accel2 / weight);
}

/// (5) for the rotor that shows least.
double smallest_loss(const EffectivenessParams& params, double threshold) {
  const std::size_t n = params.vehicle.rotor_count;
  double lift = 0.0;
  for (std::size_t i = 0; i < n; ++i) lift -= params.effectiveness.per_speed2[kVerticalRow][i];
  const double speed2 = kGravity_m_s2 / lift;
  const double dt_s = 1.0 / params.samples_per_s;
  const auto samples = static_cast<int>(params.samples_per_s);
  const double gyro_variance = params.noise.gyro_rad_s * params.noise.gyro_rad_s;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < n; ++i) {
    double information = 0.0;
    for (const EffectivenessRow row : {kRollRow, kPitchRow}) {
      double authority = 0.0;
      for (const double one : params.effectiveness.per_speed2[row]) authority += std::abs(one);
      authority *= speed2 / static_cast<double>(n);
      const double sigma = params.noise.acceleration_ratio * authority;
      const double wander = params.noise.disturbance_ratio_per_sqrt_s * authority;
      const RateAxis<double>::Noise noise{2.0 * sigma * sigma * params.noise.correlation_s, wander * wander};
      RateAxis<double> axis;
      axis.start(0.0, gyro_variance, authority * authority);
      for (int k = 0; k < 5 * samples; ++k)
        static_cast<void>(axis.step(dt_s, 0.0, 0.0, noise, gyro_variance));
      RateAxis<double>::Signature signature;
      for (int k = 0; k < samples; ++k) {
        const auto step = axis.step(dt_s, 0.0, 0.0, noise, gyro_variance);
        const double h = signature.step(step, params.effectiveness.per_speed2[row][i] * speed2);
        information += h * h / step.variance;
      }
    }
    least = std::min(least, information);
  }
  return std::sqrt(2.0 * threshold / least);
}

tl::unexpected<rt::Error> too_short(const std::vector<Recording>& flights, double used_s) {
  double after_onset_s = 0.0;
  for (const Recording& flight : flights) after_onset_s += flight.after_onset_s;
  const std::string more =
      after_onset_s > 0.0
          ? fmt::format("; {:.1f} s more came after the onset of a fault in GROUND_TRUTH", after_onset_s)
          : "";
  return rt::fail_with(
      fmt::format("only {:.1f} s of free flight, {:g} s are needed{}", used_s, kLeastFlight_s, more));
}

}  // namespace

rt::Expected<Duration> inertial_delay_of(const EffectivenessRecording& flight,
                                         const EffectivenessParams& params) {
  if (flight.speeds.empty()) {
    return rt::fail_with(fmt::format(
        "{}: no rotor speeds (ESC_STATUS), but input.inertial_delay_learned needs them to calibrate",
        flight.log));
  }
  const std::vector<Recording> flights{flight};
  Duration best{0};
  double most = -1.0;
  for (Duration delay{0}; delay <= StreamDelay<double>::kMost; delay += kInertialDelayStep) {
    const double score = score_of(flights, reported_speeds(flights, params, -delay), params);
    if (score <= most) continue;
    most = score;
    best = delay;
  }
  if (best == StreamDelay<double>::kMost) {
    return rt::fail_with(fmt::format(
        "{}: inertial data (IMU) come {:.0f} ms or more after the rotor speeds (ESC_STATUS), longer "
        "than what input.inertial_delay_learned can tell",
        flight.log, 1e3 * to_seconds(best)));
  }
  return best;
}

rt::Expected<Calibration> learn_effectiveness(const std::vector<Recording>& recorded,
                                              const EffectivenessConfig& config, bool keeps_unexcited) {
  EffectivenessParams params = config.monitor;
  const auto in_time = params.learns_inertial_delay ? without_inertial_delay(recorded, params)
                                                    : rt::Expected<std::vector<Recording>>{recorded};
  if (!in_time) return tl::unexpected<rt::Error>{in_time.error()};
  const std::vector<Recording>& flights = *in_time;
  params.learns_inertial_delay = false;
  Calibration calibration;
  calibration.vehicle = config.vehicle;
  calibration.vehicle_hash = config.vehicle_hash;
  calibration.flights = static_cast<int>(flights.size());
  const auto lacks_speeds = [](const Recording& flight) { return flight.speeds.empty(); };
  const bool is_unheard = std::all_of(flights.begin(), flights.end(), lacks_speeds);
  bool has_commands = !flights.empty();
  for (const Recording& flight : flights) {
    calibration.used_s += flown_s(flight);
    has_commands = has_commands && !flight.commands.empty();
    if (lacks_speeds(flight) && flight.commands.empty()) {
      return rt::fail_with(
          fmt::format("{}: neither rotor speeds (ESC_STATUS) nor commands (ROTOR_COMMAND)", flight.log));
    }
    if (is_unheard && command_interval_s(flight) > kMostCommandInterval_s) {
      return rt::fail_with(
          fmt::format("{}: no rotor speeds (ESC_STATUS), and commands {:.0f} times a second: what the rotors "
                      "do between is not known; {:.0f} are needed to learn from",
                      flight.log, 1.0 / command_interval_s(flight), 1.0 / kMostCommandInterval_s));
    }
    if (lacks_speeds(flight) && !is_unheard) {
      return rt::fail_with(
          fmt::format("{}: no rotor speeds (ESC_STATUS), but other flights have them; "
                      "learn from flights of one kind",
                      flight.log));
    }
  }
  if (calibration.used_s < kLeastFlight_s) return too_short(flights, calibration.used_s);
  std::vector<Speeds> speeds;
  if (is_unheard) {
    const MotorFit motor = learn_unheard_motor(flights, params);
    if (motor.is_at_edge) return rt::fail_with(edge_error(motor));
    calibration.speeds_are_commanded = true;
    calibration.motor_time_constant_s = motor.time_constant_s;
    calibration.command_latency_s = motor.delay_s;
    speeds = commanded_speeds(flights, params, motor.time_constant_s, motor.delay_s);
  } else {
    const auto latency = learn_latency(flights, params);
    if (!latency) return tl::unexpected<rt::Error>{latency.error()};
    calibration.telemetry_latency_s = to_seconds(*latency);
    speeds = reported_speeds(flights, params, *latency);
  }
  const auto blocks = best_blocks(flights, speeds, params);
  std::string errors;
  int excited = 0;
  for (std::size_t i = 0; i < kRows.size(); ++i) {
    Calibration::Axis& axis = calibration.axis[i];
    axis = learn_axis(blocks, params.effectiveness, kRows[i]);
    const bool is_excited =
        axis.explained > kLeastExplained && axis.gain_sigma < kMostRelativeError * axis.gain;
    axis.is_excited = is_excited;
    excited += is_excited ? 1 : 0;
    if (is_excited) continue;
    errors += fmt::format(
        "{}{} axis not excited: the rotors explain {:.0f} % of its changes, gain {:.2f} ± {:.2f}; "
        "fly quick {} manoeuvres",
        errors.empty() ? "" : "\n", kAxisNames[i], 100.0 * axis.explained, axis.gain, axis.gain_sigma,
        i == 2 ? "climbing and sinking" : kAxisNames[i]);
    if (keeps_unexcited) axis = {1.0, kDescribedSigma, axis.explained, false};
  }
  if (!errors.empty() && (!keeps_unexcited || excited == 0)) return rt::fail_with(errors);
  if (has_commands && !is_unheard) {
    const MotorFit motor = learn_motor(flights, params);
    if (motor.is_at_edge) return rt::fail_with(edge_error(motor));
    calibration.motor_time_constant_s = motor.time_constant_s;
    calibration.command_latency_s = std::max(0.0, motor.delay_s - calibration.telemetry_latency_s);
  }
  calibration.gyro_noise_rad_s = params.noise.gyro_rad_s;
  calibration.accel_noise_m_s2 = params.noise.accel_m_s2;
  params = effectiveness::with_calibration(params, calibration);
  params.mapping_is_known = true;  // the noise is learned from the first sample on
  learn_noise(flights, params, calibration);
  params.noise.gyro_rad_s = calibration.gyro_noise_rad_s;
  calibration.smallest_loss_ratio = smallest_loss(params, EffectivenessMonitor{params}.test().threshold());
  return calibration;
}

rt::Expected<std::vector<Recording>> read_effectiveness_recordings(const std::vector<std::string>& logs,
                                                                   const EffectivenessConfig& config,
                                                                   unsigned jobs) {
  const auto read = [&config](const std::string& log) -> rt::Expected<Recording> {
    Recording recording;
    recording.log = log;
    const auto flight = eval::run_flight(log, "airworthy-effectiveness", [&](rt::Node& node) {
      auto phase = std::make_shared<rt::FlightPhaseInput>(node, config.monitor.vehicle);
      node.subscribe<esc_status_t>(channel::kEscStatus, [&](const esc_status_t& message) {
        recording.speeds.push_back(
            {from_us(message.header.time_us), values_of(message.speed_rpm, kRadPerS_per_rpm)});
      });
      node.subscribe<rotor_command_t>(channel::kRotorCommand, [&](const rotor_command_t& message) {
        recording.commands.push_back(
            {from_us(message.header.time_us), values_of(message.command_ratio, 1.0)});
      });
      node.subscribe<imu_t>(channel::kImu, [&recording, &config, phase](const imu_t& message) {
        if (message.sensor_id != config.imu_sensor_id) return;
        const TimePoint time = from_us(message.header.time_us);
        const FlightPhase& now = phase->advance_to(time);
        if (now.phase() != Phase::kInFlight || time - now.since() < kSettle) return;
        Recording::Inertial sample{time, {}, {}};
        for (std::size_t i = 0; i < 3; ++i) {
          sample.accel_m_s2[i] = message.accel_m_s2[i];
          sample.gyro_rad_s[i] = message.gyro_rad_s[i];
        }
        recording.in_flight.push_back(sample);
      });
      return phase;
    });
    if (!flight) return tl::unexpected<rt::Error>{flight.error()};
    if (flight->vehicle != config.vehicle) {
      return rt::fail_with(
          fmt::format("{}: of vehicle \"{}\", not of \"{}\"", log, flight->vehicle, config.vehicle));
    }
    if (flight->truth && flight->truth->onset) {
      const TimePoint until = *flight->truth->onset - kBeforeOnset;
      const double whole_s = flown_s(recording);
      std::erase_if(recording.in_flight, [until](const auto& sample) { return sample.time >= until; });
      recording.after_onset_s = whole_s - flown_s(recording);
    }
    return recording;
  };
  std::vector<rt::Expected<Recording>> results(logs.size());
  for_each_parallel(logs.size(), jobs, [&](std::size_t i) { results[i] = read(logs[i]); });
  std::vector<Recording> recordings;
  std::string errors;
  for (auto& one : results) {
    if (one) {
      recordings.push_back(std::move(*one));
    } else {
      errors += (errors.empty() ? "" : "\n") + one.error().text;
    }
  }
  if (!errors.empty()) return rt::fail_with(errors);
  return recordings;
}

}  // namespace airworthy::calibrate
