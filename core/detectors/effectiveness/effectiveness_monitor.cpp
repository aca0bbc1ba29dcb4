#include "core/detectors/effectiveness/effectiveness_monitor.h"

#include <algorithm>
#include <cmath>

#include "core/estimators/inertial_range.h"
#include "core/vehicle/gravity.h"

namespace airworthy::effectiveness {
namespace {

constexpr double kLongestStep_s = 0.03;  // a longer gap starts the prediction over ...
constexpr double kGapSteps = 3.0;        // ... where samples come seldom, one of so many steps ...
constexpr double kMostStep_s = 0.05;     // ... as long as the filters of the axes are valid
constexpr double kSpeedStep_s = 0.005;   // speeds are followed at least so finely
constexpr double kFullLoss = 1.1;        // the largest share looked for: the model may be 10 % wrong
constexpr double kLeastFullLoss = 0.5;   // and the smallest that counts towards a quick decision
constexpr double kQuickMemory_s = 0.2;
constexpr double kSlowMemory_s = 3.0;
constexpr double kVarianceTime_s = 2.0;
constexpr double kLeastVarianceRatio = 0.1;  // of the first guess
constexpr double kMostVarianceRatio = 1000.0;
constexpr double kMeanTime_s = 0.5;
constexpr double kMostLateness_s = 0.25;       // a rotor whose reports are later is a silent one
constexpr double kLatenessShare = 0.05;        // of the newest report in the mean
constexpr double kMostExtrapolated_s = 0.008;  // beyond the newest report, without commands
constexpr double kFirstDisturbance = 0.5;      // standard deviation at first, in shares of one rotor
constexpr double kTiltInterval_s = 0.05;
constexpr double kArrivalError = 0.5;  // of a step, standard deviation of stamps of arrival
constexpr double kMappingPeriod_s = 1.0;
constexpr Duration kDelayChange{3'000};  // smaller ones are not worth a new start
constexpr double kMappingKeep = 0.98;    // a second: a mapping is learned within a minute
constexpr double kLeastLift =
    0.15;  // of the weight: less, and a lost rotor is within what the model never explains
constexpr double kHardlyLifts_s = 0.05;
constexpr double kBlow = 1.5;  // times all that all rotors give: no loss changes so much within a sample
constexpr double kBlowSigmas = 8.0;
constexpr double kLateralSlow_s = 0.5;
constexpr double kLateralFast_s = 0.006;
constexpr double kLateralVariance_s = 2.0;
constexpr double kPush_m_s2 = 3.0;
constexpr double kPushSigmas = 5.0;
constexpr Duration kStruck{150'000};    // and what follows
constexpr double kLeastRate_Hz = 50.0;  // below, usual gaps exceed what the filters of the axes hold for
constexpr Duration kLeastAge{4'000};    // of the evidence: a blow shows within a sample, a loss builds up
constexpr double kSurelyPartial = 0.5;  // effectiveness that no lost propeller shows ...
constexpr Duration kEarliestPartial{15'000};  // ... after so long
constexpr double kLeastLeft = 0.1;            // of a rotor that may yet come back
constexpr Duration kRepair{10'000'000};
constexpr double kCautious = 2.0;  // times the threshold near the ground

std::array<LossRange<double>, kLossRanges> ranges_of(const EffectivenessParams& params) {
  return {LossRange<double>{kLeastFullLoss, kFullLoss, kQuickMemory_s},
          LossRange<double>{params.least_loss_ratio, kFullLoss, kSlowMemory_s},
          LossRange<double>{-params.least_loss_ratio, -kFullLoss, kSlowMemory_s}};
}

RotorLossParams<double> test_params_of(const EffectivenessParams& params) {
  RotorLossParams<double> result;
  result.threshold = loss_threshold(params.false_alarms_per_hour, params.samples_per_s,
                                    kLossRanges * params.vehicle.rotor_count);
  return result;
}

SlowEvidenceParams slow_params_of(const EffectivenessParams& params) {
  SlowEvidenceParams result;
  result.vehicle = params.vehicle;
  result.effectiveness = params.effectiveness;
  result.speeds = params.speeds;
  result.false_alarms_per_hour = params.false_alarms_per_hour;
  result.propeller_spread_ratio = params.propeller_spread_ratio;
  result.offset_ratio = params.offset_ratio;
  result.gain_ratio = params.noise.gain_error_ratio;
  result.least_excess_ratio = params.least_loss_ratio;
  return result;
}

}  // namespace

bool LateralForce::step(double accel_m_s2, double dt_s) noexcept {
  const auto share = [dt_s](double time_s) { return dt_s / (time_s + dt_s); };
  fast_m_s2_ += share(kLateralFast_s) * (accel_m_s2 - fast_m_s2_);
  slow_m_s2_ += share(kLateralSlow_s) * (accel_m_s2 - slow_m_s2_);
  const double push2 = (fast_m_s2_ - slow_m_s2_) * (fast_m_s2_ - slow_m_s2_);
  const bool is_push = push2 > std::max(kPush_m_s2 * kPush_m_s2, kPushSigmas * kPushSigmas * variance_m2_s4_);
  variance_m2_s4_ += share(kLateralVariance_s) * (std::min(push2, 9.0 * variance_m2_s4_) - variance_m2_s4_);
  return is_push;
}

EffectivenessMonitor::EffectivenessMonitor(const EffectivenessParams& params) noexcept
    : params_{params},
      speeds_{params.speeds},
      test_{params.vehicle.rotor_count, test_params_of(params), ranges_of(params)},
      tilt_{params.vehicle.rotor_count, std::max(kTiltInterval_s, 2.0 * params.speeds.time_constant_s)},
      delay_{std::max(kTiltInterval_s, 2.0 * params.speeds.time_constant_s)},
      slow_{slow_params_of(params)} {
  mapping_threshold_ =
      loss_threshold(params.false_alarms_per_hour, 2.0 * (1.0 - kMappingKeep) / kMappingPeriod_s,
                     RotorMapping<double>::hypotheses(params.vehicle.rotor_count));
  effectiveness_.fill(1.0);
  const std::size_t n = params_.vehicle.rotor_count;
  constexpr std::array kRows{kRollRow, kPitchRow, kVerticalRow};
  double lift = 0.0;
  for (std::size_t i = 0; i < n; ++i) lift -= params_.effectiveness.per_speed2[kVerticalRow][i];
  const double hover_speed2 = kGravity_m_s2 / lift;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < n; ++i) {
      authority_[axis] +=
          std::abs(params_.effectiveness.per_speed2[kRows[axis]][i]) * hover_speed2 / static_cast<double>(n);
    }
  }
  const Multirotor& vehicle = params_.vehicle;
  for (std::size_t i = 0; i < n; ++i) {
    inflow_per_rate_[i] = inflow_per_rate(vehicle, i);
    vertical_at_imu_[i] = params_.effectiveness.per_speed2[kVerticalRow][i] +
                          params_.effectiveness.per_speed2[kRollRow][i] * vehicle.imu_position_m[1] -
                          params_.effectiveness.per_speed2[kPitchRow][i] * vehicle.imu_position_m[0];
  }
  hover_speed_sum_ = std::sqrt(hover_speed2) * static_cast<double>(n);
  timing_error_s_ =
      params_.noise.latency_error_s + params_.noise.lag_error_ratio * params_.speeds.time_constant_s;
  unheard_timing_error_s_ = params_.noise.unheard_latency_error_s +
                            params_.noise.unheard_lag_error_ratio * params_.speeds.time_constant_s;
  const auto adaptive = [](double sigma) {
    const double guess = sigma * sigma;
    return AdaptiveVariance<double>{guess, kLeastVarianceRatio * guess, kMostVarianceRatio * guess,
                                    kVarianceTime_s};
  };
  for (auto& variance : gyro_variance_) variance = adaptive(params_.noise.gyro_rad_s);
  accel_variance_ = adaptive(params_.noise.accel_m_s2);
}

double EffectivenessMonitor::gyro_sigma(std::size_t axis) const noexcept {
  return std::sqrt(gyro_variance_[axis].value);
}

double EffectivenessMonitor::accel_sigma() const noexcept { return std::sqrt(accel_variance_.value); }

std::optional<LossEvent> EffectivenessMonitor::on_imu(TimePoint time, const std::array<double, 3>& accel_m_s2,
                                                      const std::array<double, 3>& gyro_rad_s,
                                                      Phase phase) noexcept {
  if (inertial_status(accel_m_s2, gyro_rad_s) != UpdateStatus::kFused) {
    ++dropped_;
    return std::nullopt;
  }
  const StampGate::Stamp stamp = stamps_.judge(time);
  if (stamp == StampGate::Stamp::kSame || stamp == StampGate::Stamp::kOlder) {
    ++times_gone_back_;
    return std::nullopt;
  }
  if (stamp == StampGate::Stamp::kRestart) start_over(time);
  if (repeats(time, accel_m_s2, gyro_rad_s)) return process(time);
  // From here on, times are those of the rotor speeds.
  const TimePoint moved = time - inertial_delay_;
  if (params_.learns_inertial_delay)
    learn_delay({time, time, accel_m_s2, gyro_rad_s, phase}, phase == Phase::kInFlight);
  if (last_moved_ && moved <= *last_moved_) {  // the delay has just grown
    ++dropped_;
    return std::nullopt;
  }
  last_moved_ = moved;
  if (waiting_count_ == kWaiting) {
    waiting_first_ = (waiting_first_ + 1) % kWaiting;
    --waiting_count_;
    ++dropped_;
  }
  waiting_[(waiting_first_ + waiting_count_) % kWaiting] = {time, moved, accel_m_s2, gyro_rad_s, phase};
  ++waiting_count_;
  return process(time);
}

// A sensor has noise: what is the same to the last digit was not measured anew.
bool EffectivenessMonitor::repeats(TimePoint time, const std::array<double, 3>& accel_m_s2,
                                   const std::array<double, 3>& gyro_rad_s) noexcept {
  const bool is_same_rate = gyro_rad_s == gyro_before_;
  const bool is_same_force = accel_m_s2 == accel_before_;
  gyro_before_ = gyro_rad_s;
  accel_before_ = accel_m_s2;
  if (!is_same_rate) gyro_changed_ = time;
  if (!is_same_force) accel_changed_ = time;
  const TimePoint changed = std::min(gyro_changed_, accel_changed_);
  const bool is_frozen = to_seconds(time - changed) > longest_step_s();
  if (is_same_rate) ++repeated_;
  if (is_frozen && muted_ != Muted::kRotorLost) muted_ = Muted::kFrozen;
  return is_same_rate || is_frozen;
}

/// The stamps so far were wrong.
void EffectivenessMonitor::start_over(TimePoint time) noexcept {
  last_moved_.reset();
  last_processed_.reset();
  waiting_count_ = 0;
  delayed_count_ = 0;
  delay_added_.reset();
  delay_.interrupt();
  for (std::optional<TimePoint>* since : {&in_flight_since_, &source_since_, &struck_, &on_ground_since_}) {
    if (*since && **since > time) *since = time;
  }
  gyro_changed_ = accel_changed_ = time;
  needs_start_ = true;
}

// Reports keep the stamp of the measurement however long they took: until the next one comes, nobody is silent.
void EffectivenessMonitor::note_lateness(TimePoint report) noexcept {
  if (!stamps_.newest()) return;
  const double late_s =
      std::clamp(to_seconds(*stamps_.newest() - inertial_delay_ - report), 0.0, kMostLateness_s);
  lateness_s_ += kLatenessShare * (late_s - lateness_s_);
}

bool EffectivenessMonitor::come_too_late() const noexcept {
  if (source_ != SpeedSource::kTelemetry) return false;
  const double behind_s =
      speeds_.report_interval_s() + lateness_s_ + to_seconds(params_.speeds.telemetry_latency);
  return behind_s > to_seconds(params_.most_wait) + kMostExtrapolated_s;
}

void EffectivenessMonitor::on_report(LandedReport report) noexcept {
  reported_in_air_ = report == LandedReport::kInAir;
}

std::optional<LossEvent> EffectivenessMonitor::on_speeds(TimePoint time,
                                                         std::span<const double> speed_rad_s) noexcept {
  note_lateness(time);
  speeds_.on_speed(time, speed_rad_s);
  slow_.on_speeds(time, speed_rad_s);
  return process(time);
}

std::optional<LossEvent> EffectivenessMonitor::on_commands(TimePoint time,
                                                           std::span<const double> command_ratio) noexcept {
  speeds_.on_command(time, command_ratio);
  return process(time);
}

std::optional<LossEvent> EffectivenessMonitor::process(TimePoint now) noexcept {
  std::optional<LossEvent> event;
  const TimePoint known = std::max(speeds_.known_until(), now - params_.most_wait);
  while (waiting_count_ > 0 && !event) {
    const Inertial& sample = waiting_[waiting_first_];
    if (sample.time > known) break;
    event = step(sample, now);
    const auto excess = watch_slowly(sample);
    if (excess && (excess->is_first || excess->is_over)) {
      set_effectiveness(excess->rotor, excess->effectiveness);
      needs_start_ = true;
    }
    // Never both: what the fast test has found is believed at once, and the slow evidence starts over.
    if (!event && excess) event = event_of(*excess, now);
    waiting_first_ = (waiting_first_ + 1) % kWaiting;
    --waiting_count_;
  }
  return event;
}

void EffectivenessMonitor::watch_input(const Inertial& sample, double dt_s) noexcept {
  mean_step_s_ += 0.01 * (std::min(dt_s, kMostStep_s) - mean_step_s_);
  double lift_m_s2 = 0.0;
  for (std::size_t i = 0; i < params_.vehicle.rotor_count; ++i)
    lift_m_s2 -= params_.effectiveness.per_speed2[kVerticalRow][i] * mean_speed2_[i];
  hardly_lifts_s_ = lift_m_s2 < kLeastLift * kGravity_m_s2 ? hardly_lifts_s_ + dt_s : 0.0;
  // A body that begins to turn pushes the accelerometer beside its centre of mass.
  std::array<double, 2> turning{};
  if (dt_s > 0.0) {
    const auto& arm = params_.vehicle.imu_position_m;
    const auto& w = sample.gyro_rad_s;
    std::array<double, 3> change{};
    for (std::size_t k = 0; k < 3; ++k) change[k] = (w[k] - gyro_watched_[k]) / dt_s;
    turning = {change[1] * arm[2] - change[2] * arm[1], change[2] * arm[0] - change[0] * arm[2]};
  }
  gyro_watched_ = sample.gyro_rad_s;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (lateral_[axis].step(sample.accel_m_s2[axis] - turning[axis], dt_s)) struck_ = sample.time;
  }
}

double EffectivenessMonitor::longest_step_s() const noexcept {
  return std::clamp(kGapSteps * mean_step_s_, kLongestStep_s, kMostStep_s);
}

void EffectivenessMonitor::watch_source(TimePoint time) noexcept {
  const SpeedSource source = speeds_.source();
  const bool was_heard = source_ == SpeedSource::kTelemetry || source_ == SpeedSource::kTelemetryAndCommands;
  const bool is_heard = source == SpeedSource::kTelemetry || source == SpeedSource::kTelemetryAndCommands;
  if (source_ != SpeedSource::kNone && was_heard != is_heard) {
    source_since_ = time;
    needs_start_ = true;
  }
  source_ = source;
}

bool EffectivenessMonitor::advance_speeds(TimePoint time) noexcept {
  const std::size_t n = params_.vehicle.rotor_count;
  const Duration whole = last_processed_ ? time - *last_processed_ : Duration{0};
  const bool is_long = to_seconds(whole) > longest_step_s();
  const int parts = is_long ? 1 : 1 + static_cast<int>(to_seconds(whole) / kSpeedStep_s);
  std::array<double, kMaxRotors> sum{};
  for (int k = 1; k <= parts; ++k) {
    std::array<double, kMaxRotors> before{};
    for (std::size_t i = 0; i < n; ++i) before[i] = speeds_.speed(i);
    if (!speeds_.advance(time - whole + whole * k / parts)) return false;
    for (std::size_t i = 0; i < n; ++i) {
      const double now = speeds_.speed(i);
      sum[i] += 0.5 * (now * now + before[i] * before[i]);
    }
  }
  for (std::size_t i = 0; i < n; ++i) mean_speed2_[i] = sum[i] / parts;
  watch_source(time);
  return true;
}

bool EffectivenessMonitor::is_blow(const MotionSample<double>& motion) const noexcept {
  const auto exceeds = [](const AxisInnovation<double>& axis, double most) {
    return std::abs(axis.innovation) > most + kBlowSigmas * std::sqrt(axis.variance);
  };
  std::array<double, 3> all{};
  for (std::size_t i = 0; i < params_.vehicle.rotor_count; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) all[axis] += std::abs(motion.contribution[i][axis]);
  }
  return exceeds(motion.rate[0], kBlow * motion.rate[0].dt_s * all[0]) ||
         exceeds(motion.rate[1], kBlow * motion.rate[1].dt_s * all[1]) ||
         exceeds(motion.vertical, kBlow * all[2]);
}

// After so long on the ground the rotor may have been repaired: the next flight begins without what was found.
void EffectivenessMonitor::watch_ground(const Inertial& sample) noexcept {
  if (sample.phase != Phase::kOnGround) {
    on_ground_since_.reset();
    return;
  }
  if (!on_ground_since_) on_ground_since_ = sample.time;
  if (sample.time - *on_ground_since_ < kRepair) return;
  lost_.reset();
  for (std::size_t i = 0; i < params_.vehicle.rotor_count; ++i) {
    if (!has_lost(i)) continue;
    set_effectiveness(i, 1.0);
    slow_.believe(i, 1.0);
  }
}

Muted EffectivenessMonitor::reason(const Inertial& sample) noexcept {
  watch_ground(sample);
  if (lost_) return Muted::kRotorLost;
  // Where the autopilot is sure to be in the air, signs of the ground may be an updraught: a lost rotor is
  // still looked for.
  const bool may_land = sample.phase == Phase::kLanding;
  cautious_ = may_land && reported_in_air_ && in_flight_since_;
  if (sample.phase != Phase::kInFlight && !may_land) {
    in_flight_since_.reset();
    slow_.end_flight();
    for (std::size_t i = 0; i < params_.vehicle.rotor_count; ++i)
      set_effectiveness(i, std::min(effectiveness_[i], 1.0));  // it may have been changed
  }
  if (sample.phase != Phase::kInFlight && !cautious_) return Muted::kPhase;
  if (mean_step_s_ > 1.0 / kLeastRate_Hz) return Muted::kTooSlow;
  if (struck_ && sample.time - *struck_ < kStruck) return Muted::kStruck;
  using Telemetry = RotorSpeedPredictor<double>::Telemetry;
  const bool reports = source_ != SpeedSource::kCommands;
  for (std::size_t i = 0; reports && i < params_.vehicle.rotor_count; ++i) {
    const Telemetry state = speeds_.telemetry(i, sample.time);
    if (state == Telemetry::kGood) continue;
    muted_rotor_ = i;
    return Muted::kTelemetry;
  }
  if (come_too_late()) return Muted::kSpeedsLate;
  if (!in_flight_since_) in_flight_since_ = sample.time;
  if (params_.learns_inertial_delay && !delay_is_known_) return Muted::kDelayUnknown;
  if (mapping_ == Mapping::kWrongNumbers) return Muted::kRotorMapping;
  if (sample.time - *in_flight_since_ < params_.settle) return Muted::kSettling;
  if (hardly_lifts_s_ > kHardlyLifts_s) return Muted::kNoThrust;
  // What was lost together with the reports is taken into the disturbance, and overturns within seconds what cannot
  // fly without it: the reports are missing, not a propeller.
  const Duration settle = source_ == SpeedSource::kCommands ? params_.settle_partial : params_.settle;
  if (source_since_ && sample.time - *source_since_ < settle) return Muted::kSettling;
  return mapping_was_plausible_ || params_.mapping_is_known ? Muted::kNot : Muted::kMappingUnknown;
}

void EffectivenessMonitor::learn_delay(const Inertial& sample, bool in_flight) noexcept {
  if (!in_flight || lost_) {
    delay_.interrupt();
    delay_added_.reset();
    delayed_count_ = 0;
    return;
  }
  if (delayed_count_ == kWaiting) {
    delayed_first_ = (delayed_first_ + 1) % kWaiting;
    --delayed_count_;
  }
  delayed_[(delayed_first_ + delayed_count_) % kWaiting] = sample;
  ++delayed_count_;
  while (delayed_count_ > 0 && delayed_[delayed_first_].time <= speeds_.now()) {
    add_to_delay(delayed_[delayed_first_]);
    delayed_first_ = (delayed_first_ + 1) % kWaiting;
    --delayed_count_;
  }
  const auto learned = delay_.delay();
  if (!learned || (delay_is_known_ && std::chrono::abs(*learned - inertial_delay_) < kDelayChange)) return;
  delay_is_known_ = true;
  inertial_delay_ = *learned;
  needs_start_ = true;
}

void EffectivenessMonitor::add_to_delay(const Inertial& sample) noexcept {
  const double dt_s = delay_added_ ? to_seconds(sample.time - *delay_added_) : 0.0;
  delay_added_ = sample.time;
  if (dt_s > longest_step_s()) delay_.interrupt();
  StreamDelay<double>::Accelerations u{};
  for (std::size_t k = 0; k < u.size(); ++k) {
    const TimePoint then = sample.time - StreamDelay<double>::kStep * static_cast<int>(k);
    for (std::size_t i = 0; i < params_.vehicle.rotor_count; ++i) {
      const double speed = speeds_.speed_at(i, then);
      u[k][0] += params_.effectiveness.per_speed2[kRollRow][i] * speed * speed;
      u[k][1] += params_.effectiveness.per_speed2[kPitchRow][i] * speed * speed;
    }
  }
  delay_.add(dt_s, {sample.gyro_rad_s[0], sample.gyro_rad_s[1]}, u);
}

void EffectivenessMonitor::start(const Inertial& sample) noexcept {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double sigma = kFirstDisturbance * authority_[axis];
    rate_[axis].start(sample.gyro_rad_s[axis], gyro_variance_[axis].value, sigma * sigma);
  }
  const double sigma = kFirstDisturbance * authority_[2];
  vertical_.start(sigma * sigma);
  mean_vertical_m_s2_ = -kGravity_m_s2;
  for (std::size_t i = 0; i < params_.vehicle.rotor_count; ++i) {
    const double speed = speeds_.speed(i);
    usual_speed2_[i] = speed * speed;
  }
  test_.reset();
}

void EffectivenessMonitor::watch_mapping(const Inertial& sample, double dt_s) noexcept {
  if (dt_s > longest_step_s()) tilt_.interrupt();
  tilt_.add(dt_s, speeds_.speeds(), sample.gyro_rad_s, sample.accel_m_s2[2]);
  mapping_age_s_ += dt_s;
  if (mapping_age_s_ < kMappingPeriod_s) return;
  mapping_age_s_ = 0.0;
  if (mapping_ == Mapping::kWrongNumbers) return;
  numbering_ = RotorMapping<double>::judge(tilt_, params_.effectiveness, mapping_threshold_);
  mapping_ = numbering_.mapping;
  mapping_was_plausible_ = mapping_was_plausible_ || mapping_ == Mapping::kPlausible;
  tilt_.fade(kMappingKeep);
}

MotionSample<double> EffectivenessMonitor::innovate(const Inertial& sample, double dt_s) noexcept {
  const ModelNoise& noise = params_.noise;
  const auto& B = params_.effectiveness.per_speed2;
  MotionSample<double> motion;
  motion.time = sample.time;
  std::array<double, 3> u{};
  std::array<double, 3> timing_variance{};
  std::array<double, 3> gap_variance{};
  std::array<double, 3> rotor_variance{};
  // A stamp of arrival says when within a step: what turns so fast was measured elsewhere by so much.
  const double stamp_error_s = params_.learns_inertial_delay ? kArrivalError * mean_step_s_ : 0.0;
  const double timing_error_s =
      (speeds_.is_well_reported() ? timing_error_s_ : unheard_timing_error_s_) + stamp_error_s;
  double lift_change = 0.0;  // of what the rotors give, each second
  double speed_sum = 0.0;
  for (std::size_t i = 0; i < params_.vehicle.rotor_count; ++i) {
    const double speed = speeds_.speed(i);
    const double before = speed_before_[i];
    speed_before_[i] = speed;
    speed_sum += speed;
    // A rotor that the turning body moves along its axis meets air that much faster.
    const double inflow = inflow_per_rate_[i][0] * rate_[0].rate() + inflow_per_rate_[i][1] * rate_[1].rate();
    // A rate answers to the mean over the step, a force to its end.
    const double mean = std::max(0.0, mean_speed2_[i] - speed * inflow);
    const double now = std::max(0.0, speed * (speed - inflow));
    const double late = std::abs(speed * speed - before * before) / dt_s * timing_error_s;
    const double gap = 2.0 * speed * speeds_.gap_sigma(i);
    const std::array b{effectiveness_[i] * B[kRollRow][i], effectiveness_[i] * B[kPitchRow][i],
                       effectiveness_[i] * vertical_at_imu_[i]};
    motion.contribution[i] = {b[0] * mean, b[1] * mean, b[2] * now};
    // What it usually gives is in the disturbance already.
    usual_speed2_[i] += dt_s / (kMeanTime_s + dt_s) * (speed * speed - usual_speed2_[i]);
    const double unusual = noise.rotor_error_ratio * (speed * speed - usual_speed2_[i]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      rotor_variance[axis] += b[axis] * b[axis] * unusual * unusual;
      u[axis] += motion.contribution[i][axis];
      timing_variance[axis] += b[axis] * b[axis] * late * late;
      gap_variance[axis] += b[axis] * b[axis] * gap * gap;
    }
    lift_change += b[2] * (speed * speed - before * before) / dt_s;
  }
  const auto& inertia = params_.vehicle.inertia_kg_m2;
  const auto& w = sample.gyro_rad_s;
  if (inertia[0] > 0.0 && inertia[1] > 0.0) {
    u[0] += (inertia[1] - inertia[2]) / inertia[0] * w[1] * w[2];
    u[1] += (inertia[2] - inertia[0]) / inertia[1] * w[0] * w[2];
  }
  const auto square = [](double value) { return value * value; };
  const double gap_s = 0.5 * speeds_.command_interval_s();  // over which what gaps hide is correlated
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double net = u[axis] + rate_[axis].disturbance();
    const double variance = square(noise.acceleration_ratio * authority_[axis]) +
                            square(noise.gain_error_ratio * net) + timing_variance[axis];
    motion.rate[axis] = rate_[axis].step(dt_s, u[axis], sample.gyro_rad_s[axis],
                                         {2.0 * (variance * noise.correlation_s + gap_variance[axis] * gap_s +
                                                 rotor_variance[axis] * noise.rotor_correlation_s),
                                          square(noise.disturbance_ratio_per_sqrt_s * authority_[axis])},
                                         gyro_variance_[axis].value + square(stamp_error_s * net));
    gyro_variance_[axis].step(motion.rate[axis].innovation, motion.rate[axis].variance, dt_s);
  }
  // The accelerometer beside the centre of mass also feels the body turn faster.
  const auto& arm = params_.vehicle.imu_position_m;
  u[2] += rate_[0].disturbance() * arm[1] - rate_[1].disturbance() * arm[0] +
          w[2] * (w[0] * arm[0] + w[1] * arm[1]) - (w[0] * w[0] + w[1] * w[1]) * arm[2];
  // What the air takes from the thrust grows with the speed of the rotors, not with its square.
  const double speed_ratio = speed_sum / hover_speed_sum_;
  mean_vertical_m_s2_ += dt_s / (kMeanTime_s + dt_s) * (u[2] - mean_vertical_m_s2_);
  const double change = noise.gain_error_ratio * (u[2] - mean_vertical_m_s2_);
  const double density = square(noise.vertical_ratio_per_sqrt_s * authority_[2]) +
                         2.0 * (timing_variance[2] + square(change)) / noise.vertical_correlation_s +
                         2.0 * gap_variance[2] / std::max(gap_s, noise.vertical_correlation_s) +
                         2.0 * rotor_variance[2] / noise.rotor_correlation_s;
  motion.vertical =
      vertical_.step(dt_s, u[2] + (speed_ratio - 1.0) * vertical_.disturbance(), sample.accel_m_s2[2],
                     density, accel_variance_.value + square(stamp_error_s * lift_change));
  accel_variance_.step(motion.vertical.innovation, motion.vertical.variance, dt_s);
  return motion;
}

std::optional<LossEvent> EffectivenessMonitor::step(const Inertial& sample, TimePoint now) noexcept {
  const TimePoint before = last_processed_.value_or(sample.time);
  std::optional<LossEvent> event;
  if (advance_speeds(sample.time)) {
    event = judge(sample, to_seconds(sample.time - before), now);
  } else {
    muted_ = Muted::kNoSpeeds;
  }
  const TimePoint stamp_before = last_processed_ ? last_stamp_ : sample.stamp;
  last_processed_ = sample.time;
  last_stamp_ = sample.stamp;
  if (judgement_observer_ != nullptr) {
    judgement_observer_(judgement_context_,
                        {stamp_before, sample.stamp, event ? Muted::kNot : muted_, sample.phase});
  }
  return event;
}

std::optional<LossEvent> EffectivenessMonitor::judge(const Inertial& sample, double dt_s,
                                                     TimePoint now) noexcept {
  const Muted before = muted_;
  watch_input(sample, dt_s);
  muted_ = reason(sample);
  const auto runs = [](Muted muted) {
    return muted == Muted::kNot || muted == Muted::kSettling || muted == Muted::kNoThrust ||
           muted == Muted::kMappingUnknown;
  };
  if (runs(muted_) || muted_ == Muted::kRotorMapping) {
    watch_mapping(sample, dt_s);
  } else {
    tilt_.interrupt();
  }
  if (!runs(muted_)) return std::nullopt;
  const bool starts = !runs(before) || needs_start_;
  if (starts || dt_s > longest_step_s()) {
    needs_start_ = false;
    if (starts) {
      start(sample);
    } else {
      for (std::size_t axis = 0; axis < 2; ++axis)
        rate_[axis].resume(sample.gyro_rad_s[axis], gyro_variance_[axis].value);
      test_.reset();
    }
    for (std::size_t i = 0; i < params_.vehicle.rotor_count; ++i) speed_before_[i] = speeds_.speed(i);
    return std::nullopt;
  }
  const MotionSample<double> motion = innovate(sample, dt_s);
  if (is_blow(motion)) {
    struck_ = sample.time;
    muted_ = Muted::kStruck;
    test_.reset();
    return std::nullopt;
  }
  if (muted_ != Muted::kNot) {
    test_.reset();
    return std::nullopt;
  }
  judged_s_ += dt_s;
  if (observer_ != nullptr) observer_(observer_context_, motion, now);
  test_.step(motion);
  return decide(motion, now);
}

bool EffectivenessMonitor::is_silent(std::size_t rotor, TimePoint now) const noexcept {
  return source_ != SpeedSource::kCommands && speeds_.is_overdue(rotor, now - from_seconds(lateness_s_));
}

bool EffectivenessMonitor::is_any_silent(TimePoint now) const noexcept {
  for (std::size_t i = 0; i < params_.vehicle.rotor_count; ++i) {
    if (is_silent(i, now)) return true;
  }
  return false;
}

bool EffectivenessMonitor::is_beyond_ground(const Test::Finding& finding) const noexcept {
  return finding.range == 0 && finding.evidence >= kCautious * test_.threshold();
}

std::optional<LossEvent> EffectivenessMonitor::decide(const MotionSample<double>& sample,
                                                      TimePoint now) noexcept {
  const auto finding = test_.finding();
  if (!finding || (cautious_ && !is_beyond_ground(*finding))) return std::nullopt;
  // Leaving the ground, thrust and drag change as if a little were lost.
  if (finding->range != 0 && sample.time - *in_flight_since_ < params_.settle_partial) {
    test_.reset();
    return std::nullopt;
  }
  const Duration age = sample.time - finding->onset;
  if (age < kLeastAge) return std::nullopt;
  // A rotor that falls silent may stand still: that is for its next report to say. A gain of another looks like it.
  const bool is_return = finding->loss < 0.0;
  if (is_silent(finding->rotor, now) || (is_return && is_any_silent(now))) return std::nullopt;
  // No propeller grows in flight: what fits the gain of a rotor that had lost nothing is something else.
  if (is_return && !has_lost(finding->rotor)) {
    ++impossible_gains_;
    test_.reset();
    return std::nullopt;
  }
  LossEvent event;
  event.rotor = finding->rotor;
  event.effectiveness = effectiveness_[event.rotor] * (1.0 - finding->loss);
  event.sigma = effectiveness_[event.rotor] * std::sqrt(finding->loss_variance);
  const auto probability_below = [&event](double effectiveness) {
    return LossOfEffectivenessFilter<double>::probability_below(effectiveness, event.effectiveness,
                                                                event.sigma * event.sigma);
  };
  event.probability = probability_below(params_.lost_below_ratio);
  const bool is_lost = event.probability > params_.lost_probability;
  // The first milliseconds show less than is lost: filters of the sensor hold back what has just begun.
  const bool is_partial = event.effectiveness > kSurelyPartial && age >= kEarliestPartial;
  if (!is_lost && !is_partial && age < params_.most_classifying) return std::nullopt;
  const auto kind = kind_of(event);
  if (!kind) {
    follow(event.rotor, event.effectiveness, *finding);
    return std::nullopt;
  }
  event.kind = *kind;
  if (event.kind == LossKind::kOverEffective) {
    event.is_over = event.effectiveness <= 1.0 + dead_ratio();
    event.probability = 1.0 - probability_below(1.0);
  }
  event.evidence = finding->evidence;
  event.threshold = test_.threshold();
  event.second = finding->second;
  event.unexplained = finding->unexplained;
  event.onset = finding->onset;
  event.sample = sample.time;
  event.decided = now;
  believe(event, *finding);
  return event;
}

double EffectivenessMonitor::dead_ratio() const noexcept { return params_.least_loss_ratio / 2.0; }

// By what was believed before: an excess that goes is over and no loss of what never was described; a loss that comes back
// is no excess, for nobody mounts a larger propeller in flight.
std::optional<LossKind> EffectivenessMonitor::kind_of(const LossEvent& event) const noexcept {
  const double dead = dead_ratio();
  const double believed = effectiveness_[event.rotor];
  const bool was_over = believed > 1.0 + dead;
  if (event.probability > 0.5) return LossKind::kPropellerLost;
  if (has_lost(event.rotor) || event.effectiveness <= 1.0 - dead) return LossKind::kPartialLoss;
  if (was_over || event.effectiveness > 1.0 + dead) return LossKind::kOverEffective;
  return std::nullopt;
}

void EffectivenessMonitor::believe(const LossEvent& event, const Test::Finding& finding) noexcept {
  follow(event.rotor, event.effectiveness, finding);
  slow_.note(event.rotor, event.kind == LossKind::kOverEffective && !event.is_over);
  if (event.kind == LossKind::kPropellerLost) {
    lost_ = event.rotor;
    muted_ = Muted::kRotorLost;
  }
}

void EffectivenessMonitor::follow(std::size_t rotor, double effectiveness,
                                  const Test::Finding& finding) noexcept {
  set_effectiveness(rotor, effectiveness);
  slow_.believe(rotor, effectiveness_[rotor]);
  for (std::size_t axis = 0; axis < 2; ++axis)
    rate_[axis].shift(finding.rate_shift[axis], finding.disturbance_shift[axis]);
  vertical_.shift(finding.disturbance_shift[2]);
  test_.reset();
}

void EffectivenessMonitor::set_effectiveness(std::size_t rotor, double effectiveness) noexcept {
  effectiveness_[rotor] = std::max(0.0, effectiveness);
  const double whole = (1.0 + dead_ratio()) / std::max(effectiveness_[rotor], kLeastLeft);
  test_.may_return(rotor, has_lost(rotor) ? whole - 1.0 : 0.0);
}

bool EffectivenessMonitor::has_lost(std::size_t rotor) const noexcept {
  return effectiveness_[rotor] < 1.0 - dead_ratio();
}

std::optional<SlowEvidence::Excess> EffectivenessMonitor::watch_slowly(const Inertial& sample) noexcept {
  const bool is_flying = (muted_ == Muted::kNot || muted_ == Muted::kMappingUnknown) && in_flight_since_ &&
                         sample.time - *in_flight_since_ >= params_.settle_partial && !cautious_ &&
                         source_ != SpeedSource::kCommands;
  return slow_.on_imu({sample.time, sample.accel_m_s2, sample.gyro_rad_s, is_flying, muted_ == Muted::kNot});
}

LossEvent EffectivenessMonitor::event_of(const SlowEvidence::Excess& excess, TimePoint now) noexcept {
  LossEvent event;
  event.kind = LossKind::kOverEffective;
  event.rotor = excess.rotor;
  event.effectiveness = excess.effectiveness;
  event.sigma = excess.sigma;
  event.probability = excess.probability;
  event.evidence = excess.evidence;
  event.threshold = slow_.excess_threshold();
  event.second = excess.second;
  event.is_over = excess.is_over;
  event.onset = excess.since;
  event.sample = excess.sample;
  event.decided = now;
  return event;
}

}  // namespace airworthy::effectiveness
