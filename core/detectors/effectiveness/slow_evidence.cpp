#include "core/detectors/effectiveness/slow_evidence.h"

#include <algorithm>
#include <cmath>

#include "core/detectors/effectiveness/rotor_loss_test.h"
#include "core/estimators/effectiveness/loss_of_effectiveness_filter.h"
#include "core/vehicle/gravity.h"

namespace airworthy::effectiveness {
namespace {

constexpr double kLongestStep_s = 0.03;  // a longer gap interrupts
constexpr double kLook_s = 1.0;
constexpr Duration kDoubtful{
    1'000'000};  // after a speed that was refused: where one is wrong, others are too
constexpr double kTumbling_rad_s =
    3.0;  // where the body tumbles, inertia and air that nobody described decide
constexpr double kMostTelemetryInterval_s = 0.025;  // between two, speeds are taken as straight lines
constexpr double kMostGap_s =
    2.0 * kMostTelemetryInterval_s;    // of a rotor: after a longer one all is doubtful
constexpr double kTellingSigma = 2.0;  // times the smallest excess: known worse, an update would say nothing

double hover_speed2(const EffectivenessMatrix<double>& matrix) {
  double lift = 0.0;
  for (std::size_t i = 0; i < matrix.rotor_count; ++i) lift -= matrix.per_speed2[kVerticalRow][i];
  return kGravity_m_s2 / lift;
}

ThrustRegressionParams<double> thrust_params(const SlowEvidenceParams& params) {
  ThrustRegressionParams<double> result;
  const std::size_t n = params.vehicle.rotor_count;
  result.rotor_count = n;
  constexpr std::array kRows{kRollRow, kPitchRow, kVerticalRow};
  const double speed2 = hover_speed2(params.effectiveness);
  double arm_m = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto& hub = params.vehicle.rotor[i].position_m;
    arm_m += std::hypot(hub[0], hub[1]) / static_cast<double>(n);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      result.authority[axis] +=
          std::abs(params.effectiveness.per_speed2[kRows[axis]][i]) * speed2 / static_cast<double>(n);
    }
  }
  for (std::size_t axis = 0; axis < 2; ++axis) {
    result.offset_rad_s2_per_m_s2[axis] = params.vehicle.mass_kg * arm_m / params.vehicle.inertia_kg_m2[axis];
  }
  result.spread = params.propeller_spread_ratio;
  result.offset = params.offset_ratio;
  result.gain = params.gain_ratio;
  return result;
}

RotorSpeedParams<double> without_commands(RotorSpeedParams<double> speeds) {
  speeds.command_latency = Duration{0};
  return speeds;
}

double threshold(const SlowEvidenceParams& params, std::size_t hypotheses) {
  return loss_threshold(params.false_alarms_per_hour, 2.0 / SlowEvidence::kMemory_s, hypotheses);
}

}  // namespace

SlowEvidence::SlowEvidence(const SlowEvidenceParams& params) noexcept
    : params_{params},
      n_{params.vehicle.rotor_count},
      speeds_{without_commands(params.speeds)},
      thrust_{thrust_params(params)},
      spin_{params.vehicle, hover_speed2(params.effectiveness), {}},
      excess_threshold_{threshold(params, n_)},
      spin_threshold_{threshold(params, (std::size_t{1} << n_) - 1)} {
  believed_.fill(1.0);
  const auto& B = params.effectiveness.per_speed2;
  const Multirotor& vehicle = params.vehicle;
  for (std::size_t i = 0; i < n_; ++i) {
    inflow_per_rate_[i] = inflow_per_rate(vehicle, i);
    vertical_at_imu_[i] = B[kVerticalRow][i] + B[kRollRow][i] * vehicle.imu_position_m[1] -
                          B[kPitchRow][i] * vehicle.imu_position_m[0];
  }
}

void SlowEvidence::on_speeds(TimePoint time, std::span<const double> speed_rad_s) noexcept {
  const std::int64_t refused = speeds_.refused_speeds();
  speeds_.on_speed(time, speed_rad_s);
  if (speeds_.refused_speeds() != refused) doubtful_until_ = time + kDoubtful;
  watch_reports(time);
}

void SlowEvidence::watch_reports(TimePoint time) noexcept {
  constexpr double kShare = 0.05;
  for (std::size_t i = 0; i < n_; ++i) {
    const auto at = speeds_.accepted_at(i);
    if (!at || at == reported_at_[i]) continue;
    const double gap_s = reported_at_[i] ? to_seconds(*at - *reported_at_[i]) : 0.0;
    reported_at_[i] = at;
    if (gap_s > kMostGap_s) {
      doubtful_until_ = time + kDoubtful;
      continue;
    }
    double& mean_s = report_interval_s_[i];
    mean_s += (mean_s > 0.0 ? kShare : 1.0) * (gap_s - mean_s);
  }
}

/// Whether all rotors report so often that their speeds between reports are known.
bool SlowEvidence::is_reported_often(TimePoint time) const noexcept {
  for (std::size_t i = 0; i < n_; ++i) {
    const bool is_known = reported_at_[i] && report_interval_s_[i] > 0.0;
    if (!is_known || report_interval_s_[i] > kMostTelemetryInterval_s) return false;
    if (to_seconds(time - *reported_at_[i]) > kMostGap_s) return false;
  }
  return true;
}

void SlowEvidence::end_flight() noexcept {
  for (std::size_t i = 0; i < n_; ++i) {
    if (believed_[i] > 1.0) {
      believed_[i] = 1.0;
      deviation_[i] = {};
    }
    if (claim_[i] == Claim::kFound) claim_[i] = Claim::kCarried;
  }
  starts_over_ = true;
}

void SlowEvidence::believe(std::size_t rotor, double effectiveness) noexcept {
  believed_[rotor] = effectiveness;
  deviation_ = {};
  starts_over_ = true;
}

void SlowEvidence::note(std::size_t rotor, bool is_excess) noexcept {
  claim_[rotor] = is_excess ? Claim::kFound : Claim::kNone;
  healthy_since_[rotor].reset();
}

std::optional<SlowEvidence::Excess> SlowEvidence::on_imu(const SlowSample& sample) noexcept {
  if (count_ == kWaiting) {  // telemetry is too late: what it would explain is given up
    first_ = (first_ + 1) % kWaiting;
    --count_;
  }
  waiting_[(first_ + count_) % kWaiting] = sample;
  ++count_;
  std::optional<Excess> found;
  while (count_ > 0 && !found && waiting_[first_].time <= speeds_.known_until()) {
    found = process(waiting_[first_]);
    first_ = (first_ + 1) % kWaiting;
    --count_;
  }
  return found;
}

std::optional<SlowEvidence::Excess> SlowEvidence::process(const SlowSample& sample) noexcept {
  if (!speeds_.advance(sample.time)) return std::nullopt;
  const double dt_s = last_ ? to_seconds(sample.time - *last_) : 0.0;
  last_ = sample.time;
  const bool goes_on = is_running_ && !starts_over_ && dt_s <= kLongestStep_s;
  const auto& w = sample.gyro_rad_s;
  if (w[0] * w[0] + w[1] * w[1] + w[2] * w[2] > kTumbling_rad_s * kTumbling_rad_s)
    doubtful_until_ = sample.time + kDoubtful;
  const bool is_doubtful = doubtful_until_ && sample.time < *doubtful_until_;
  is_running_ = sample.is_judged && !is_doubtful && is_reported_often(sample.time);
  if (!is_running_) return std::nullopt;
  if (!goes_on) {
    begin(sample);
    return std::nullopt;
  }
  step(sample, dt_s);
  for (std::size_t i = 0; i < n_; ++i) before_[i] = speeds_.speed(i);
  age_s_ += dt_s;
  if (age_s_ < kLook_s) return std::nullopt;
  const double keep = 1.0 - age_s_ / kMemory_s;
  age_s_ = 0.0;
  auto found = judge(sample);
  thrust_.fade(keep);
  spin_.fade(keep);
  return found;
}

void SlowEvidence::begin(const SlowSample& sample) noexcept {
  const std::array rate{sample.gyro_rad_s[0], sample.gyro_rad_s[1]};
  if (starts_over_) {
    thrust_.start(rate);
    spin_.start(sample.gyro_rad_s[2]);
    deviation_ = {};
    since_ = sample.time;
    age_s_ = 0.0;
    healthy_since_ = {};
    excess_since_ = {};
    starts_over_ = false;
  } else {
    thrust_.resume(rate);
    spin_.resume(sample.gyro_rad_s[2]);
  }
  for (std::size_t i = 0; i < n_; ++i) before_[i] = speeds_.speed(i);
}

void SlowEvidence::step(const SlowSample& sample, double dt_s) noexcept {
  const auto& B = params_.effectiveness.per_speed2;
  const auto& inertia = params_.vehicle.inertia_kg_m2;
  const auto& arm = params_.vehicle.imu_position_m;
  const auto& w = sample.gyro_rad_s;
  ThrustSample<double> seen;
  seen.dt_s = dt_s;
  seen.rate_rad_s = {w[0], w[1]};
  std::array<double, 3> gyroscopic{};
  if (inertia[0] > 0.0 && inertia[1] > 0.0 && inertia[2] > 0.0) {
    gyroscopic = {(inertia[1] - inertia[2]) / inertia[0] * w[1] * w[2],
                  (inertia[2] - inertia[0]) / inertia[1] * w[0] * w[2],
                  (inertia[0] - inertia[1]) / inertia[2] * w[0] * w[1]};
  }
  seen.gyroscopic_rad_s2 = {gyroscopic[0], gyroscopic[1]};
  seen.vertical_m_s2 =
      sample.accel_m_s2[2] - w[2] * (w[0] * arm[0] + w[1] * arm[1]) + (w[0] * w[0] + w[1] * w[1]) * arm[2];
  for (std::size_t i = 0; i < n_; ++i) {
    const double speed = speeds_.speed(i);
    const double inflow = inflow_per_rate_[i][0] * w[0] + inflow_per_rate_[i][1] * w[1];
    const double mean =
        std::max(0.0, 0.5 * (speed * speed + before_[i] * before_[i]) - speed * inflow) * believed_[i];
    const double now = std::max(0.0, speed * (speed - inflow)) * believed_[i];
    seen.contribution[i] = {B[kRollRow][i] * mean, B[kPitchRow][i] * mean, vertical_at_imu_[i] * now};
    seen.lift_m_s2 += B[kVerticalRow][i] * now;
  }
  thrust_.step(seen);
  std::array<double, 2> tilting{};
  for (std::size_t i = 0; i < n_; ++i) {
    for (std::size_t axis = 0; axis < 2; ++axis) tilting[axis] += seen.contribution[i][axis];
  }
  spin_.step(dt_s, speeds_.speeds(), std::span{before_}.first(n_), w[2], tilting, gyroscopic[2]);
}

SlowEvidence::Excess SlowEvidence::excess_of(std::size_t rotor, const SlowSample& sample) const noexcept {
  const auto& deviation = deviation_[rotor];
  Excess excess;
  excess.rotor = rotor;
  excess.effectiveness = effectiveness(rotor);
  excess.sigma = believed_[rotor] * std::sqrt(deviation.variance);
  excess.probability = 1.0 - LossOfEffectivenessFilter<double>::probability_below(
                                 1.0, excess.effectiveness, excess.sigma * excess.sigma);
  excess.evidence = deviation.evidence;
  excess.second = best_other(rotor);
  excess.since = since_;
  excess.sample = sample.time;
  return excess;
}

double SlowEvidence::best_other(std::size_t rotor) const noexcept {
  double best = 0.0;
  for (std::size_t i = 0; i < n_; ++i) {
    if (i == rotor) continue;
    if (std::isnan(deviation_[i].evidence)) return deviation_[i].evidence;
    best = std::max(best, deviation_[i].evidence);
  }
  return best;
}

std::optional<SlowEvidence::Excess> SlowEvidence::judge(const SlowSample& sample) noexcept {
  judge_spin();
  const auto deviations = thrust_.deviations();
  if (!deviations) return std::nullopt;
  deviation_ = *deviations;
  if (const auto over = clear(sample)) return over;
  if (const auto excess = accuse(sample)) return excess;
  return follow(sample);
}

bool SlowEvidence::is_excess(std::size_t rotor) const noexcept {
  const auto& deviation = deviation_[rotor];
  if (!(deviation.evidence >= excess_threshold_ && deviation.mean > 0.0)) return false;
  if (!(effectiveness(rotor) >= 1.0 + params_.least_excess_ratio)) return false;
  return deviation.evidence - best_other(rotor) >= kMargin;
}

std::optional<SlowEvidence::Excess> SlowEvidence::accuse(const SlowSample& sample) noexcept {
  const bool has_found = std::find(claim_.begin(), claim_.end(), Claim::kFound) != claim_.end();
  if (has_found || !sample.may_accuse) return std::nullopt;
  for (std::size_t i = 0; i < n_; ++i) {
    if (!is_excess(i)) {
      excess_since_[i].reset();
      continue;
    }
    if (!excess_since_[i]) excess_since_[i] = sample.time;
    if (sample.time - *excess_since_[i] < kLasting) continue;
    claim_[i] = Claim::kFound;
    healthy_since_[i].reset();
    Excess excess = excess_of(i, sample);
    excess.is_first = true;
    return excess;
  }
  return std::nullopt;
}

std::optional<SlowEvidence::Excess> SlowEvidence::clear(const SlowSample& sample) noexcept {
  std::optional<Excess> cleared;
  for (std::size_t i = 0; i < n_; ++i) {
    if (claim_[i] == Claim::kNone) continue;
    const Excess excess = excess_of(i, sample);
    if (!(excess.effectiveness + 2.0 * excess.sigma < 1.0 + params_.least_excess_ratio / 2.0)) {
      healthy_since_[i].reset();
      continue;
    }
    if (!healthy_since_[i]) healthy_since_[i] = sample.time;
    if (cleared || sample.time - *healthy_since_[i] < kClearAfter) continue;
    claim_[i] = Claim::kNone;
    cleared = excess;
    cleared->is_over = true;
  }
  return cleared;
}

std::optional<SlowEvidence::Excess> SlowEvidence::follow(const SlowSample& sample) noexcept {
  for (std::size_t step = 1; step <= n_; ++step) {
    const std::size_t i = (followed_ + step) % n_;
    if (claim_[i] == Claim::kNone) continue;
    const Excess excess = excess_of(i, sample);
    if (!(excess.sigma <= kTellingSigma * params_.least_excess_ratio)) continue;
    followed_ = i;
    return excess;
  }
  return std::nullopt;
}

void SlowEvidence::judge_spin() noexcept {
  const auto verdict = spin_.judge();
  if (!verdict) return;
  spin_evidence_ = verdict->over_described;
  if (!(verdict->over_described >= spin_threshold_)) return;
  const bool is_named = verdict->over_second >= kMargin;
  if (wrong_spin_ && spin_is_named_ && !is_named) return;
  wrong_spin_ = verdict->best;
  spin_is_named_ = is_named;
}

}  // namespace airworthy::effectiveness
