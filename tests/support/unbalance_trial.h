#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "core/estimators/unbalance/motor_lag.h"
#include "core/estimators/unbalance/signal_power_ekf.h"
#include "sim/simulation.h"

namespace airworthy::sim {

/// What the filter is given for the speeds of the rotors, and what of the sensor.
enum class SpeedSource {
  kCommand,        ///< commands as the autopilot reports them, through the motor lag of the vehicle file
  kTelemetry,      ///< measured speeds as they arrive
  kTelemetryGain,  ///< the same, and the configuration knows the low-pass of the accelerometer
};
inline constexpr std::array kSources{SpeedSource::kCommand, SpeedSource::kTelemetry,
                                     SpeedSource::kTelemetryGain};

struct TrialParams {
  double initial_tip_mass_mg = 20.0;
  double filter_cutoff_Hz = 0.0;  ///< what an integrator writes of the accelerometer; for kTelemetryGain
  double begin_s = 6.0;           ///< in the air from here on
  double memory_s = 60.0;
};

/// What the filter says at one moment.
template <std::size_t N>
struct TrialMoment {
  std::array<double, N> ekf_mg{};
  std::array<double, N> evidence{};
  std::array<double, N> culprit_mg{};
};

/// A simulated flight as the signal-power filter sees it, once for each source of speeds.
template <std::size_t N>
class SignalPowerTrial final : public Output {
 public:
  using Ekf = SignalPowerEkf<double, N>;
  using Rotors = std::array<double, N>;

  /// `baseline`: powers() of a healthy flight for each source, or zeros.
  SignalPowerTrial(const Multirotor& vehicle, const TrialParams& params,
                   const std::array<Rotors, kSources.size()>& baseline)
      : baseline_{baseline}, vehicle_{vehicle}, params_{params}, lag_{vehicle.motor_time_constant_s} {
    for (const SpeedSource source : kSources) {
      SignalPowerParams filter;
      filter.mass_kg = vehicle.mass_kg;
      filter.propeller_radius_m = vehicle.propeller_radius_m;
      filter.initial_tip_mass_mg = params.initial_tip_mass_mg;
      filter.information_memory_s = params.memory_s;
      if (source == SpeedSource::kTelemetryGain) filter.sensor.filter_cutoff_Hz = params.filter_cutoff_Hz;
      ekf_.emplace_back(filter);
      trace_.emplace_back();
    }
    measured_rad_s_.fill(std::numeric_limits<double>::quiet_NaN());
    commanded_rad_s_ = measured_rad_s_;
  }

  void on_truth(const Truth&) override {}
  void on_attitude(const AutopilotSample&) override {}
  void on_flight_state(const AutopilotSample&, LandedState) override {}
  void on_esc(const EscSample& sample) override {
    for (std::size_t i = 0; i < N; ++i) {
      if (std::isfinite(sample.speed_rpm[i]))
        measured_rad_s_[i] = sample.speed_rpm[i] * std::numbers::pi / 30.0;
    }
  }
  void on_commands(const AutopilotSample& sample) override {
    for (std::size_t i = 0; i < N; ++i) {
      commanded_rad_s_[i] =
          vehicle_.speed_min_rad_s +
          sample.control.command_ratio[i] * (vehicle_.speed_max_rad_s - vehicle_.speed_min_rad_s);
    }
  }
  void on_imu(const ImuSample& sample) override {
    const Rotors& lagged = lag_.step(commanded_rad_s_, sample.time_s - last_s_);
    last_s_ = sample.time_s;
    if (sample.time_s < params_.begin_s) return;
    typename Ekf::Sample input;
    input.time = from_us(std::llround(sample.time_s * 1e6));
    input.ax_m_s2 = sample.accel_m_s2.x();
    input.ay_m_s2 = sample.accel_m_s2.y();
    const bool is_due =
        sample.time_s >= params_.begin_s + static_cast<double>(trace_[0].size()) * kTracePeriod_s;
    for (std::size_t k = 0; k < kSources.size(); ++k) {
      input.speed_rad_s = kSources[k] == SpeedSource::kCommand ? lagged : measured_rad_s_;
      typename Ekf::Innovation innovation;
      if (ekf_[k].update(input, innovation) == UpdateStatus::kFused) {
        nis_sum_[k] += innovation.nis;
      }
      if (is_due) trace_[k].push_back(moment(k));
    }
  }

  static constexpr double kTracePeriod_s = 0.5;
  [[nodiscard]] const std::vector<TrialMoment<N>>& trace(std::size_t source) const { return trace_[source]; }
  [[nodiscard]] const Ekf& filter(std::size_t source) const { return ekf_[source]; }
  [[nodiscard]] double mean_nis(std::size_t source) const {
    return nis_sum_[source] / static_cast<double>(ekf_[source].fused());
  }
  [[nodiscard]] TrialMoment<N> moment(std::size_t source) const {
    TrialMoment<N> result;
    const auto culprits = ekf_[source].culprits(baseline_[source]);
    for (std::size_t i = 0; i < N; ++i) {
      result.ekf_mg[i] = ekf_[source].tip_mass_mg(i);
      result.evidence[i] = culprits.evidence[i];
      result.culprit_mg[i] = 1e6 * culprits.unbalance_kg_m[i] / vehicle_.propeller_radius_m;
    }
    return result;
  }

 private:
  std::array<Rotors, kSources.size()> baseline_;
  Multirotor vehicle_;
  TrialParams params_;
  MotorLag<double, N> lag_;
  std::vector<Ekf> ekf_;
  std::vector<std::vector<TrialMoment<N>>> trace_;
  std::array<double, kSources.size()> nis_sum_{};
  Rotors measured_rad_s_{};
  Rotors commanded_rad_s_{};
  double last_s_ = 0.0;
};

/// Which rotor is named, counted from 0, and when after the filter's start; -1: none.
struct Verdict {
  int rotor = -1;
  double time_s = std::numeric_limits<double>::quiet_NaN();
  double most_lasting_lead = 0.0;  ///< of any rotor over all others, for kPersistence moments
};

inline constexpr std::size_t kPersistence = 4;  ///< moments that must agree: 2 s
// Ahead of every other rotor; in healthy flights of seeds 101 to 110 it was 17.6 at most.
inline constexpr double kEvidenceToName = 20.0;
// A few seconds hold one or two manoeuvres, and a thousand samples of one manoeuvre are no thousand observations.
inline constexpr double kLeastTime_s = 15.0;

/// The rotor with the highest score at one moment, and how far it is ahead of every other.
template <std::size_t N>
std::pair<int, double> lead_of(const std::array<double, N>& score) {
  const auto best = std::max_element(score.begin(), score.end());
  double second = 0.0;
  for (auto other = score.begin(); other != score.end(); ++other) {
    if (other != best) second = std::max(second, *other);
  }
  return {static_cast<int>(best - score.begin()), *best - second};
}

template <std::size_t N, class Score>
Verdict first_lasting(std::size_t first, std::size_t moments, double lead_to_name, Score score_of) {
  Verdict verdict;
  int leader = -1;
  std::size_t named_for = 0;
  std::array<double, kPersistence> leads{};
  for (std::size_t at = first; at < moments; ++at) {
    const auto [rotor, lead] = lead_of<N>(score_of(at));
    if (rotor != leader) leads.fill(0.0);
    leads[at % kPersistence] = lead;
    named_for = rotor == leader && lead >= lead_to_name ? named_for + 1 : (lead >= lead_to_name ? 1 : 0);
    leader = rotor;
    verdict.most_lasting_lead =
        std::max(verdict.most_lasting_lead, *std::min_element(leads.begin(), leads.end()));
    if (verdict.rotor < 0 && named_for >= kPersistence) {
      verdict.rotor = rotor;
      verdict.time_s = static_cast<double>(at) * SignalPowerTrial<N>::kTracePeriod_s;
    }
  }
  return verdict;
}

/// By the filter's own estimates: growth against a healthy flight at the same age of the filter, half of U₀ ahead of
/// every other rotor.
template <std::size_t N>
Verdict ekf_verdict(const std::vector<TrialMoment<N>>& trace, const std::vector<TrialMoment<N>>& healthy,
                    double initial_mg) {
  return first_lasting<N>(0, std::min(trace.size(), healthy.size()), 0.5 * initial_mg, [&](std::size_t at) {
    std::array<double, N> growth_mg{};
    for (std::size_t i = 0; i < N; ++i) growth_mg[i] = trace[at].ekf_mg[i] - healthy[at].ekf_mg[i];
    return growth_mg;
  });
}

/// By the evidence of its least squares.
template <std::size_t N>
Verdict evidence_verdict(const std::vector<TrialMoment<N>>& trace) {
  constexpr auto kFirst =
      static_cast<std::size_t>(kLeastTime_s / SignalPowerTrial<N>::kTracePeriod_s) - kPersistence + 1;
  return first_lasting<N>(kFirst, trace.size(), kEvidenceToName,
                          [&](std::size_t at) { return trace[at].evidence; });
}

}  // namespace airworthy::sim
