#include "core/detectors/unbalance/rotor_unbalance_monitor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "core/detectors/unbalance/rigid_body_response.h"
#include "core/detectors/unbalance/rotors_together.h"
#include "core/vehicle/gravity.h"

namespace airworthy {
namespace {

using Transition = FaultLifeCycle::Transition;

constexpr double kConverging_s = 0.5;
constexpr double kSmoothing_s = 0.5;
constexpr double kSigmas = 2.0;
constexpr double kFrozen_s = 0.5;  // without a change ...
constexpr int kFrozenChanges =
    10;  // while each of the others changed so often, on average: a coarse scale is not frozen
constexpr double kInertialStale_s = 1.0;
constexpr double kLeastInformation = 0.5;  // 1σ of an amplitude over the smallest that is reported
constexpr double kLeastGain = 0.25;        // of the sensors at hover speed, below which they are to blame
constexpr double kLeak = 0.05;             // of another rotor's amplitude, that no sigma knows of
// The growth of a rotor that turns apart by d rad/s leaks through a tracker of this time constant by 1/√(1 + (d·T)²).
constexpr double kTrackerTime_s = 0.3;
constexpr double kSpeedsSmoothed_s = 1.0;
constexpr double kConfounded = 0.5;          // correlation of two rotors' amplitudes
constexpr double kMostResponseSigma = 0.45;  // beyond which the upper end of a reading is anywhere
constexpr double kMostLoad = 2.5;            // thrust by rotor speeds over weight, and its inverse

SignalPowerParams power_params(const UnbalanceParams& params) {
  SignalPowerParams power;
  power.mass_kg = params.vehicle.mass_kg / params.response;
  power.propeller_radius_m = params.vehicle.propeller_radius_m;
  // The paper starts from what makes about half a m/s² at hover, 20 mg on its larger vehicles.
  power.initial_tip_mass_mg =
      1e6 * params.usual_m_s2 * UnbalanceMonitor::kg_m_per_m_s2(params) / params.vehicle.propeller_radius_m;
  power.sensor.filter_cutoff_Hz = params.low_pass_Hz;
  power.expect_nothing();
  for (std::size_t i = 0; i < params.vehicle.rotor_count; ++i)
    power.bands.spin[i] = params.vehicle.rotor[i].spin;
  return power;
}

// What the power is compared with: the same reading of the healthy vehicle, else what order tracking has measured of
// it, else what is usual. kg·m.
template <std::size_t N>
std::array<double, N> power_baseline(const UnbalanceParams& params) {
  const auto& power = params.baseline_power_m2_s4;
  const bool is_learned = std::any_of(power.begin(), power.end(), [](double value) { return value != 0.0; });
  std::array<double, N> result{};
  for (std::size_t i = 0; i < N; ++i) {
    double amplitude_m_s2 = params.has_baseline ? params.baseline_m_s2[i] : params.usual_m_s2;
    if (is_learned) amplitude_m_s2 = std::sqrt(std::max(0.0, power[i]));
    result[i] = amplitude_m_s2 * UnbalanceMonitor::kg_m_per_m_s2(params);
  }
  return result;
}

bool tells_enough(const RotorUnbalance& rotor, const UnbalanceParams& params) {
  return rotor.sigma_m_s2 < kLeastInformation * params.smallest_m_s2 ||
         rotor.amplitude_m_s2 > 4.0 * rotor.sigma_m_s2;
}

// What was found stays found while nobody looks, and there is nothing new to say of it.
Transition hold(FaultLifeCycle& life, TimePoint now) noexcept {
  if (life.active()) static_cast<void>(life.step(1.0, now));
  return Transition::kNone;
}

template <std::size_t... kIndex>
std::array<FaultLifeCycle, sizeof...(kIndex)> life_cycles(const FaultLifeCycleParams& params,
                                                          std::index_sequence<kIndex...>) {
  return {(static_cast<void>(kIndex), FaultLifeCycle{params})...};
}

}  // namespace

double UnbalanceMonitor::hover_speed_rad_s(const Multirotor& vehicle) noexcept {
  return std::sqrt(vehicle.mass_kg * kGravity_m_s2 /
                   (static_cast<double>(vehicle.rotor_count) * vehicle.thrust_coefficient_N_s2));
}

double UnbalanceMonitor::kg_m_per_m_s2(const UnbalanceParams& params) noexcept {
  const double speed = hover_speed_rad_s(params.vehicle);
  return params.vehicle.mass_kg / (params.response * speed * speed);
}

double UnbalanceMonitor::kg_m_per_m_s2(const UnbalanceParams& params, std::size_t rotor) noexcept {
  return kg_m_per_m_s2(params) / rigid_body_response(params.vehicle, rotor);
}

template <std::size_t N>
RotorUnbalanceMonitor<N>::RotorUnbalanceMonitor(const UnbalanceParams& params) noexcept
    : params_{params},
      tracker_{{.reference_speed_rad_s = hover_speed_rad_s(params.vehicle),
                .smallest_m_s2 = params.smallest_m_s2,
                .speed_latency_s = params.speed_latency_s,
                .speed_noise_ratio = params.speed_noise_ratio,
                .most_speed_error_ratio = params.most_speed_error_ratio,
                .low_pass_Hz = params.low_pass_Hz}},
      fallback_{params.vehicle, power_params(params), power_baseline<N>(params),
                params.smallest_m_s2 * kg_m_per_m_s2(params)},
      life_{life_cycles(params.life_cycle, std::make_index_sequence<N>{})},
      ambiguity_life_{params.life_cycle} {
  for (std::size_t i = 0; i < N; ++i) {
    tracker_.start_speed_error(i, params.speed_error_ratio[i]);
    prior_.spin[i] = params.vehicle.rotor[i].spin;
    prior_.amplitude_m_s2[i] = params.has_baseline ? params.baseline_m_s2[i] : params.usual_m_s2;
    prior_.sigma_m_s2[i] = std::hypot(params.baseline_sigma_m_s2[i], 0.25 * params.smallest_m_s2);
  }
  prior_.is_calibrated = params.has_baseline;
  prior_.against_ratio = params.against_ratio;
}

template <std::size_t N>
void RotorUnbalanceMonitor<N>::on_phase(Phase phase) noexcept {
  phase_ = phase;
}

template <std::size_t N>
void RotorUnbalanceMonitor<N>::on_speeds(TimePoint time, std::span<const double> speed_rad_s) noexcept {
  if (speed_rad_s.size() != N) return;
  for (std::size_t i = 0; i < N; ++i) {
    if (!std::isfinite(speed_rad_s[i])) continue;
    if (speed_rad_s[i] == last_speed_rad_s_[i]) continue;
    last_speed_rad_s_[i] = speed_rad_s[i];
    speed_changed_at_[i] = time;
    for (int& changes : changes_of_others_) ++changes;
    changes_of_others_[i] = 0;
  }
  tracker_.on_speeds(time, std::span<const double, N>{speed_rad_s});
}

template <std::size_t N>
void RotorUnbalanceMonitor<N>::on_commands(TimePoint time, std::span<const double> command_ratio) noexcept {
  if (command_ratio.size() == N) fallback_.on_commands(time, std::span<const double, N>{command_ratio});
}

template <std::size_t N>
bool RotorUnbalanceMonitor<N>::on_accel(TimePoint time, double a_x_m_s2, double a_y_m_s2,
                                        double window_s) noexcept {
  accel_at_ = time;
  has_accel_ = true;
  // A hard gust may look like a touch-down for a moment: what was learned before is not lost by that.
  const bool flies = phase_ == Phase::kInFlight || (is_tracking_ && phase_ == Phase::kLanding);
  if (flies) window_s_ = std::isfinite(window_s) ? window_s : 0.0;
  if (flies && !is_tracking_) {
    tracker_.forget();
    estimated_s_ = 0.0;
    power_m2_s4_.fill(0.0);
    against_power_m2_s4_.fill(0.0);
    steady_ = {};
    fallback_.restart(window_s_);
    tracking_since_ = time;
  }
  is_tracking_ = flies;
  if (flies) {
    fallback_.on_accel(time, a_x_m_s2, a_y_m_s2);
    if (tracker_.on_accel(time, a_x_m_s2, a_y_m_s2, window_s_) == UpdateStatus::kFused) {
      nis_ += 0.002 * (tracker_.innovation().nis() - nis_);
    }
  }
  if (has_judged_ && time - judged_at_ < kPeriod) return false;
  judge(time);
  return true;
}

template <std::size_t N>
bool RotorUnbalanceMonitor<N>::on_clock(TimePoint now) noexcept {
  if (!has_accel_ || to_seconds(now - accel_at_) <= kInertialStale_s || now - judged_at_ < kPeriod)
    return false;
  is_tracking_ = false;
  judge(now);
  return true;
}

template <std::size_t N>
bool RotorUnbalanceMonitor<N>::speeds_carry_the_vehicle() const noexcept {
  double sum = 0.0;
  for (const double speed : tracker_.speed_rad_s()) sum += speed * speed;
  const double load =
      params_.vehicle.thrust_coefficient_N_s2 * sum / (params_.vehicle.mass_kg * kGravity_m_s2);
  return load > 1.0 / kMostLoad && load < kMostLoad;
}

template <std::size_t N>
UnbalanceNotJudged RotorUnbalanceMonitor<N>::reason_for_all(TimePoint now) const noexcept {
  if (to_seconds(now - accel_at_) > kInertialStale_s) return UnbalanceNotJudged::kInertialStale;
  if (phase_ != Phase::kInFlight) return UnbalanceNotJudged::kNotFlying;
  const bool fuses = tracker_.counters().fused > fused_at_judgement_;
  if (to_seconds(now - tracking_since_) < kConverging_s) return UnbalanceNotJudged::kConverging;
  if (!fuses) return UnbalanceNotJudged::kSpeedUnknown;
  bool is_frozen = false;
  for (std::size_t i = 0; i < N; ++i) {
    is_frozen = is_frozen || (to_seconds(now - speed_changed_at_[i]) > kFrozen_s &&
                              changes_of_others_[i] > kFrozenChanges * static_cast<int>(N - 1));
  }
  if (is_frozen || !speeds_carry_the_vehicle()) return UnbalanceNotJudged::kSpeedImplausible;
  return UnbalanceNotJudged::kJudged;
}

template <std::size_t N>
double RotorUnbalanceMonitor<N>::correlation(std::size_t i, std::size_t j) const noexcept {
  const auto power = [this](std::size_t row, std::size_t column) {
    double sum = 0.0;
    for (std::size_t a = 0; a < 2; ++a) {
      for (std::size_t b = 0; b < 2; ++b) {
        const double element = tracker_.covariance_m2_s4(2 * row + a, 2 * column + b);
        sum += element * element;
      }
    }
    return sum;
  };
  return std::sqrt(power(i, j) / std::sqrt(power(i, i) * power(j, j)));
}

template <std::size_t N>
std::uint32_t RotorUnbalanceMonitor<N>::confounded_with(std::size_t rotor, bool is_informed) const noexcept {
  std::uint32_t mask = 0;
  for (std::size_t j = 0; j < N; ++j) {
    if (j == rotor) continue;
    const bool correlates = correlation(rotor, j) > kConfounded;
    if (!tracker_.are_apart(rotor, j) || (!is_informed && correlates)) mask |= 1U << j;
  }
  return mask;
}

template <std::size_t N>
double RotorUnbalanceMonitor<N>::sensor_gain(double speed_rad_s) const noexcept {
  return SensorResponse<double>{0.0, params_.low_pass_Hz}.sensor(speed_rad_s, window_s_).magnitude();
}

template <std::size_t N>
void RotorUnbalanceMonitor<N>::estimate(double dt_s) noexcept {
  double mean_speed = 0.0;
  for (const double speed : tracker_.speed_rad_s()) mean_speed += speed / static_cast<double>(N);
  const double gain = sensor_gain(mean_speed);
  // A running mean at first, so that the start at zero leaves no trace.
  estimated_s_ += dt_s;
  note_speeds(dt_s);
  // What was seen while the tracker was at a loss must not linger.
  const double share = tracker_.explains() ? std::min(1.0, dt_s / std::min(estimated_s_, kSmoothing_s)) : 1.0;
  for (std::size_t k = 0; k < N; ++k) {
    RotorUnbalance& rotor = rotor_[k];
    rotor.by_power = false;
    const double variance = tracker_.turning_variance_m2_s4(k);
    const auto smoothed = [&](double& power, int spin) {
      // Bounded below, or one moment without any knowledge would hide what is seen after it.
      const double seen = std::max(tracker_.turning_m_s2(k, spin).squared() - 2.0 * variance,
                                   -params_.smallest_m_s2 * params_.smallest_m_s2);
      power += share * (seen - power);
      return std::sqrt(std::max(0.0, power));
    };
    rotor.amplitude_m_s2 = smoothed(power_m2_s4_[k], prior_.spin[k]);
    rotor.against_m_s2 = smoothed(against_power_m2_s4_[k], -prior_.spin[k]);
    rotor.sigma_m_s2 = std::sqrt(variance);
    rotor.growth_m_s2 = rotor.amplitude_m_s2 - (params_.has_baseline ? params_.baseline_m_s2[k] : 0.0);
    rotor.growth_sigma_m_s2 = params_.has_baseline
                                  ? std::hypot(rotor.sigma_m_s2, params_.baseline_sigma_m_s2[k])
                                  : rotor.sigma_m_s2;
    const bool is_informed = tells_enough(rotor, params_);
    rotor.confounded_with = confounded_with(k, is_informed);
    rotor.reason = is_informed && rotor.confounded_with == 0U ? UnbalanceNotJudged::kJudged
                   : !is_informed && gain < kLeastGain        ? UnbalanceNotJudged::kUnfitInertialData
                   : rotor.confounded_with != 0U              ? UnbalanceNotJudged::kConfounded
                                                              : UnbalanceNotJudged::kConverging;
    if (!tracker_.explains()) steady_[k].restart();
    if (rotor.reason == UnbalanceNotJudged::kJudged) {
      const double power = tracker_.turning_m_s2(k, prior_.spin[k]).squared() - 2.0 * variance;
      steady_[k].add(power, rotor.sigma_m_s2, rotor.amplitude_m_s2, dt_s);
    }
    const double baseline = rotor.amplitude_m_s2 - rotor.growth_m_s2;
    const double baseline_sigma = params_.has_baseline ? params_.baseline_sigma_m_s2[k] : 0.0;
    const bool is_steady = steady_[k].has_value();
    const double amplitude = is_steady ? steady_[k].amplitude_m_s2() : rotor.amplitude_m_s2;
    const double sigma = is_steady ? steady_[k].sigma_m_s2() : rotor.sigma_m_s2;
    read_mass(k, amplitude - baseline, std::hypot(sigma, baseline_sigma));
  }
}

template <std::size_t N>
void RotorUnbalanceMonitor<N>::read_mass(std::size_t rotor, double growth_m_s2, double sigma_m_s2) noexcept {
  const double kg_m = kg_m_per_m_s2(params_, rotor);
  const double ratio = params_.response_sigma_ratio[rotor];
  const double low = growth_m_s2 - kSigmas * sigma_m_s2;
  const double high = growth_m_s2 + kSigmas * sigma_m_s2;
  // The response may be more than was assumed, so that the mass is less, or less, next to nothing even.
  const auto by_more = [&](double growth) { return growth / (1.0 + kSigmas * ratio); };
  const auto by_less = [&](double growth) {
    constexpr double kAnything = std::numeric_limits<double>::infinity();
    return ratio > kMostResponseSigma ? std::copysign(kAnything, growth) : growth / (1.0 - kSigmas * ratio);
  };
  UnbalanceReading& reading = rotor_[rotor].reading;
  reading = {.growth_kg_m = kg_m * growth_m_s2,
             .sigma_kg_m = kg_m * std::hypot(sigma_m_s2, ratio * growth_m_s2)};
  if (rotor_[rotor].reason != UnbalanceNotJudged::kJudged) return;  // no interval
  reading.low_kg_m = kg_m * (low < 0.0 ? by_less(low) : by_more(low));
  reading.high_kg_m = kg_m * (high > 0.0 ? by_less(high) : by_more(high));
}

template <std::size_t N>
double RotorUnbalanceMonitor<N>::leaked_m_s2(std::size_t rotor) const noexcept {
  double most = 0.0;
  for (std::size_t j = 0; j < N; ++j) {
    if (j == rotor) continue;
    const double apart2 = apart2_rad2_s2_[rotor][j] * kTrackerTime_s * kTrackerTime_s;
    const double grown = std::abs(rotor_[j].growth_m_s2) / std::sqrt(1.0 + apart2);
    most = std::max({most, kLeak * rotor_[j].amplitude_m_s2, grown});
  }
  return most;
}

template <std::size_t N>
void RotorUnbalanceMonitor<N>::note_speeds(double dt_s) noexcept {
  const auto& speed = tracker_.speed_rad_s();
  const double share = std::min(1.0, dt_s / std::min(estimated_s_, kSpeedsSmoothed_s));
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < N; ++j) {
      const double apart = speed[i] - speed[j];
      apart2_rad2_s2_[i][j] += share * (apart * apart - apart2_rad2_s2_[i][j]);
    }
  }
}

template <std::size_t N>
void RotorUnbalanceMonitor<N>::note_leader(
    const std::optional<typename Hypotheses::Verdict>& verdict) noexcept {
  const double lead = params_.log_lead * (1.0 + 4.0 * params_.against_ratio * params_.against_ratio);
  for (std::size_t i = 0; i < N; ++i) {
    leads_[i] = verdict.has_value();
    for (std::size_t j = 0; j < N && leads_[i]; ++j) {
      if (j == i || is_known_[j]) continue;
      leads_[i] = verdict->log_likelihood_ratio[i] - verdict->log_likelihood_ratio[j] > lead;
    }
  }
}

template <std::size_t N>
void RotorUnbalanceMonitor<N>::test_rotors(TimePoint now) noexcept {
  somebody_has_grown_ = false;
  for (std::size_t i = 0; i < N; ++i) {
    RotorUnbalance& rotor = rotor_[i];
    const double doubt = kSigmas * rotor.growth_sigma_m_s2;
    const double surely_grown = rotor.growth_m_s2 - doubt - leaked_m_s2(i);
    // A usual unbalance that nobody has measured is no growth.
    const double least =
        params_.has_baseline ? params_.smallest_m_s2 : params_.usual_m_s2 + params_.smallest_m_s2;
    const bool is_judged = rotor.reason == UnbalanceNotJudged::kJudged;
    const bool has_grown = !is_known_[i] && is_judged && tracker_.explains() && surely_grown > least;
    somebody_has_grown_ = somebody_has_grown_ || (has_grown && !leads_[i]);
    grown_[i].step(has_grown && leads_[i], now);
    if (is_known_[i]) {
      // What was found stays found while another rotor might take its place.
      rotor.test_ratio = is_judged ? (rotor.growth_m_s2 + doubt) / least : 1.0;
    } else {
      rotor.test_ratio =
          std::min(surely_grown / least, grown_[i].for_s(params_.persistence_s, now) ? 1e9 : 0.999);
      if (rotor.test_ratio >= 1.0) rotor.onset = grown_[i].since;
    }
    rotor.transition = life_[i].step(rotor.test_ratio, now);
    is_known_[i] = life_[i].active();
  }
}

template <std::size_t N>
double RotorUnbalanceMonitor<N>::shared_growth_m_s2(std::size_t rotor) const noexcept {
  // The filter deals out evenly what rotors share, so that it is the sum of their parts.
  double sum = 0.0;
  for (std::size_t j = 0; j < N; ++j) {
    const bool shares = j == rotor || (rotor_[rotor].confounded_with >> j & 1U) != 0U;
    if (!shares) continue;
    if (is_known_[j]) return 0.0;  // it may all be of the one that is known
    sum += tracker_.turning_m_s2(j, prior_.spin[j]).magnitude();
    if (params_.has_baseline) sum -= params_.baseline_m_s2[j];
  }
  return sum;
}

template <std::size_t N>
std::uint32_t RotorUnbalanceMonitor<N>::grown_together(std::size_t rotor) const noexcept {
  if (!params_.has_baseline || rotor_[rotor].confounded_with == 0U || !tracker_.explains()) return 0;
  // And those that these cannot be told from, and so on.
  std::uint32_t alike = 1U << rotor;
  for (std::size_t pass = 0; pass < N; ++pass) {
    for (std::size_t i = 0; i < N; ++i) {
      if ((alike >> i & 1U) != 0U) alike |= rotor_[i].confounded_with;
    }
  }
  const int spin = prior_.spin[rotor];
  std::uint32_t suspects = 0;
  double baseline = 0.0;
  double variance = 0.0;
  for (std::size_t i = 0; i < N; ++i) {
    if ((alike >> i & 1U) == 0U) continue;
    if (is_known_[i]) return 0;  // it may all be of the one that is known
    if (prior_.spin[i] != spin) continue;
    suspects |= 1U << i;
    baseline += params_.baseline_m_s2[i];
    variance += params_.baseline_sigma_m_s2[i] * params_.baseline_sigma_m_s2[i];
  }
  const auto with = rotors_together<double>(tracker_, alike, spin);
  // An uneven airframe turns a part of the other sense into this one.
  const auto against = rotors_together<double>(tracker_, alike, -spin);
  const double doubt = kSigmas * std::sqrt(variance + with.sigma_m_s2 * with.sigma_m_s2);
  const double growth =
      with.amplitude_m_s2 - params_.against_ratio * against.amplitude_m_s2 - baseline - doubt;
  if (growth <= params_.smallest_m_s2) return 0;
  const bool is_alone = suspects == 1U << rotor;  // among rotors of the other sense: of them all, then
  return is_alone ? alike : suspects;
}

template <std::size_t N>
void RotorUnbalanceMonitor<N>::test_ambiguity(TimePoint now, double log_odds_faulty) noexcept {
  bool is_pinned = false;
  double most_growth = 0.0;
  std::uint32_t suspects = 0;
  std::uint32_t grown = 0;
  for (std::size_t i = 0; i < N; ++i) {
    if (is_known_[i]) continue;
    grown |= grown_together(i);
    const RotorUnbalance& rotor = rotor_[i];
    is_pinned = is_pinned || (rotor.log_odds >= params_.log_odds && rotor.confounded_with == 0U);
    most_growth = std::max(most_growth, shared_growth_m_s2(i));
    if (rotor.log_odds > -params_.log_odds) suspects |= 1U << i;
  }
  const bool nobody_is_known =
      std::none_of(is_known_.begin(), is_known_.end(), [](bool known) { return known; });
  const bool is_nobodys =
      (log_odds_faulty > params_.log_odds && !is_pinned && most_growth > params_.smallest_m_s2) ||
      (somebody_has_grown_ && nobody_is_known) || grown != 0U;
  ambiguous_.step(is_nobodys, now);
  if (is_nobodys && !ambiguity_life_.active()) {
    candidates_ = grown != 0U ? grown : suspects;
    for (std::size_t i = 0; i < N; ++i) {
      if (grown == 0U && (suspects >> i & 1U) != 0U) candidates_ |= rotor_[i].confounded_with;
    }
    ambiguous_since_ = ambiguous_.since;
  }
  const bool is_due = ambiguous_.for_s(params_.ambiguous_after_s, now);
  ambiguity_ =
      ambiguity_life_.step(ambiguity_life_.active() ? (is_nobodys ? 1.0 : 0.0) : (is_due ? 1.0 : 0.0), now);
}

template <std::size_t N>
void RotorUnbalanceMonitor<N>::judge_by_power(TimePoint now, double dt_s) noexcept {
  const double m_s2_per_kg_m = 1.0 / kg_m_per_m_s2(params_);
  const auto [verdict, correlation] = fallback_.judge(dt_s);
  for (std::size_t i = 0; i < N; ++i) {
    RotorUnbalance& rotor = rotor_[i];
    rotor.by_power = true;
    rotor.amplitude_m_s2 = m_s2_per_kg_m * verdict.unbalance_kg_m[i];
    rotor.against_m_s2 = 0.0;
    rotor.sigma_m_s2 = rotor.growth_sigma_m_s2 = m_s2_per_kg_m * verdict.sigma_kg_m[i];
    rotor.growth_m_s2 = params_.has_baseline ? m_s2_per_kg_m * verdict.growth_kg_m[i] : rotor.amplitude_m_s2;
    rotor.log_odds = 0.0;  // of hypotheses that are not tested here
    const bool is_informed = tells_enough(rotor, params_);
    rotor.confounded_with = 0;
    for (std::size_t j = 0; j < N && !is_informed; ++j) {
      if (j != i && correlation[i][j] < -kConfounded) rotor.confounded_with |= 1U << j;
    }
    rotor.reason = rotor.confounded_with != 0U ? UnbalanceNotJudged::kConfounded
                   : is_informed               ? UnbalanceNotJudged::kJudged
                                               : UnbalanceNotJudged::kConverging;
    const bool is_grown = verdict.is_named[i] && is_informed;
    grown_[i].step(is_grown, now);
    rotor.test_ratio = is_grown || is_known_[i] ? 1.0 : 0.0;
    if (is_grown && !is_known_[i]) rotor.onset = now;
    rotor.transition = life_[i].step(rotor.test_ratio, now);
    is_known_[i] = life_[i].active();
  }
  ambiguous_.step(false, now);
  ambiguity_ = ambiguity_life_.active() ? ambiguity_life_.step(1.0, now) : Transition::kNone;
}

template <std::size_t N>
void RotorUnbalanceMonitor<N>::mute(UnbalanceNotJudged reason, TimePoint now) noexcept {
  for (std::size_t i = 0; i < N; ++i) {
    rotor_[i].reason = reason;
    rotor_[i].reading.low_kg_m = rotor_[i].reading.high_kg_m = std::numeric_limits<double>::quiet_NaN();
    rotor_[i].test_ratio = 0.0;
    rotor_[i].log_odds = 0.0;
    grown_[i].step(false, now);
    rotor_[i].transition = hold(life_[i], now);
  }
  ambiguous_.step(false, now);
  ambiguity_ = hold(ambiguity_life_, now);
}

template <std::size_t N>
void RotorUnbalanceMonitor<N>::judge(TimePoint now) noexcept {
  const double dt_s = has_judged_ ? to_seconds(now - judged_at_) : to_seconds(kPeriod);
  judged_at_ = now;
  has_judged_ = true;
  const UnbalanceNotJudged reason = reason_for_all(now);
  fused_at_judgement_ = tracker_.counters().fused;
  const bool speeds_fail =
      reason == UnbalanceNotJudged::kSpeedUnknown || reason == UnbalanceNotJudged::kSpeedImplausible;
  // Where the sensors leave nothing of the vibration its power is that of the noise.
  const bool power_is_felt = sensor_gain(hover_speed_rad_s(params_.vehicle)) >= kLeastGain;
  if (speeds_fail && power_is_felt && fallback_.is_ready() && fallback_.has_fresh_commands(now)) {
    state_ = DetectorState::kMonitoring;
    judge_by_power(now, dt_s);
    for (std::size_t i = 0; i < N; ++i) read_mass(i, rotor_[i].growth_m_s2, rotor_[i].growth_sigma_m_s2);
    return;
  }
  fallback_.pause();
  state_ = reason == UnbalanceNotJudged::kJudged       ? DetectorState::kMonitoring
           : reason == UnbalanceNotJudged::kConverging ? DetectorState::kConverging
                                                       : DetectorState::kMuted;
  if (reason != UnbalanceNotJudged::kJudged) {
    mute(reason, now);
    return;
  }
  estimate(dt_s);
  const auto verdict = Hypotheses::test(tracker_, prior_, is_known_, params_.smallest_m_s2);
  for (std::size_t i = 0; i < N; ++i) rotor_[i].log_odds = verdict ? verdict->log_odds[i] : 0.0;
  note_leader(verdict);
  test_rotors(now);
  test_ambiguity(now, verdict ? verdict->log_odds_faulty : 0.0);
}

template <std::size_t N>
UnbalanceInnovation RotorUnbalanceMonitor<N>::innovation() const noexcept {
  const auto& counters = tracker_.counters();
  std::array<double, kMaxRotors> speed_error_ratio{};
  for (std::size_t i = 0; i < N; ++i) speed_error_ratio[i] = tracker_.speed_error_ratio(i);
  return {.nis = nis_,
          .noise_m_s2 = std::sqrt(tracker_.noise_variance_m2_s4()),
          .samples = counters.fused,
          .samples_refused = counters.not_finite + counters.time_backward + counters.speed_unknown,
          .speeds_refused = counters.speed_refused,
          .speed_error_ratio = speed_error_ratio};
}

template <std::size_t N>
UnbalancePowers RotorUnbalanceMonitor<N>::powers() const noexcept {
  UnbalancePowers result;
  const auto powers = fallback_.powers();
  // U₀ is what shakes with usual_m_s2.
  const double unit_m2_s4 = params_.usual_m_s2 * params_.usual_m_s2;
  for (std::size_t i = 0; i < N; ++i) result.m2_s4[i] = powers[i] * unit_m2_s4;
  result.learned_s = fallback_.learned_s();
  return result;
}

template class RotorUnbalanceMonitor<3>;
template class RotorUnbalanceMonitor<4>;
template class RotorUnbalanceMonitor<5>;
template class RotorUnbalanceMonitor<6>;
template class RotorUnbalanceMonitor<7>;
template class RotorUnbalanceMonitor<8>;

}  // namespace airworthy
