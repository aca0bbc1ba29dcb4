#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "core/detectors/unbalance/power_policy.h"
#include "core/detectors/unbalance/unbalance_monitor.h"
#include "core/estimators/unbalance/motor_lag.h"
#include "core/estimators/unbalance/rotor_bands.h"
#include "core/estimators/unbalance/signal_power_ekf.h"
#include "sim/simulation.h"

namespace airworthy::sim {

/// What the filters are given for the speeds of the rotors.
enum class SpeedSource {
  kCommand,    ///< commands as the autopilot reports them, through the motor lag of the vehicle file
  kTelemetry,  ///< measured speeds as they arrive
};
inline constexpr std::array kSources{SpeedSource::kCommand, SpeedSource::kTelemetry};

struct TrialParams {
  double initial_tip_mass_mg = 20.0;
  double filter_cutoff_Hz = 0.0;  ///< what an integrator writes of the accelerometer
  double begin_s = 6.0;           ///< in the air from here on
  double smallest_m_s2 = 0.3;     ///< growth at hover that is reported
};

/// What the filters say at one moment.
template <std::size_t N>
struct TrialMoment {
  std::array<double, N> paper_mg{};
  std::array<double, N> bands_mg{};
  std::array<bool, N> is_named{};  ///< by the bands
};

/// A simulated flight as the signal-power filter sees it, the source's and that in bands, once for each source of
/// speeds.
template <std::size_t N>
class SignalPowerTrial final : public Output {
 public:
  using Paper = SignalPowerEkf<double, N>;
  using Bands = SignalPowerEkf<double, N, RotorBands<double, N>>;
  using Rotors = std::array<double, N>;

  /// `baseline`: unbalances of a healthy flight by the bands for each source, or zeros.
  SignalPowerTrial(const Multirotor& vehicle, const TrialParams& params,
                   const std::array<Rotors, kSources.size()>& baseline_kg_m)
      : vehicle_{vehicle}, params_{params}, lag_{vehicle.motor_time_constant_s} {
    SignalPowerParams filter;
    filter.mass_kg = vehicle.mass_kg;
    filter.propeller_radius_m = vehicle.propeller_radius_m;
    filter.initial_tip_mass_mg = params.initial_tip_mass_mg;
    SignalPowerParams in_bands = filter;
    in_bands.expect_nothing();
    in_bands.sensor.filter_cutoff_Hz = params.filter_cutoff_Hz;
    for (std::size_t i = 0; i < N; ++i) in_bands.bands.spin[i] = vehicle.rotor[i].spin;
    const double smallest_kg_m =
        params.smallest_m_s2 * UnbalanceMonitor::kg_m_per_m_s2(UnbalanceParams{.vehicle = vehicle});
    for (std::size_t k = 0; k < kSources.size(); ++k) {
      paper_.emplace_back(filter);
      bands_.emplace_back(in_bands);
      policy_.emplace_back(in_bands.reference_kg_m(), baseline_kg_m[k], smallest_kg_m);
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
    const TimePoint time = from_us(std::llround(sample.time_s * 1e6));
    const bool is_due =
        sample.time_s >= params_.begin_s + static_cast<double>(trace_[0].size()) * kTracePeriod_s;
    for (std::size_t k = 0; k < kSources.size(); ++k) {
      const Rotors& speeds = kSources[k] == SpeedSource::kCommand ? lagged : measured_rad_s_;
      typename Paper::Innovation innovation;
      typename Bands::Innovation ignored;
      if (paper_[k].update({time, sample.accel_m_s2.x(), sample.accel_m_s2.y(), speeds}, innovation) ==
          UpdateStatus::kFused) {
        nis_sum_[k] += innovation.nis;
      }
      static_cast<void>(
          bands_[k].update({time, sample.accel_m_s2.x(), sample.accel_m_s2.y(), speeds}, ignored));
      if (is_due) trace_[k].push_back(moment(k));
    }
  }

  static constexpr double kTracePeriod_s = 0.1;
  [[nodiscard]] const std::vector<TrialMoment<N>>& trace(std::size_t source) const { return trace_[source]; }
  [[nodiscard]] double mean_nis(std::size_t source) const {
    return nis_sum_[source] / static_cast<double>(paper_[source].fused());
  }
  /// For the baseline of another flight.
  [[nodiscard]] Rotors unbalance_kg_m(std::size_t source) const {
    Rotors result{};
    for (std::size_t i = 0; i < N; ++i)
      result[i] = 1e-6 * trace_[source].back().bands_mg[i] * vehicle_.propeller_radius_m;
    return result;
  }

 private:
  [[nodiscard]] TrialMoment<N> moment(std::size_t source) {
    const auto told = bands_[source].isolation();
    const auto verdict =
        policy_[source].judge(told.power, told.information, bands_[source].learned_s(), kTracePeriod_s);
    TrialMoment<N> result;
    result.is_named = verdict.is_named;
    for (std::size_t i = 0; i < N; ++i) {
      result.paper_mg[i] = paper_[source].tip_mass_mg(i);
      result.bands_mg[i] = 1e6 * verdict.unbalance_kg_m[i] / vehicle_.propeller_radius_m;
    }
    return result;
  }

  Multirotor vehicle_;
  TrialParams params_;
  MotorLag<double, N> lag_;
  std::vector<Paper> paper_;
  std::vector<Bands> bands_;
  std::vector<PowerPolicy<N>> policy_;
  std::vector<std::vector<TrialMoment<N>>> trace_;
  std::array<double, kSources.size()> nis_sum_{};
  Rotors measured_rad_s_{};
  Rotors commanded_rad_s_{};
  double last_s_ = 0.0;
};

/// Which rotor is named first, counted from 0, and when after the filter's start; -1: none.
struct Verdict {
  int rotor = -1;
  double time_s = std::numeric_limits<double>::quiet_NaN();
  bool others_too = false;  ///< are named later
};

/// By the source's filter, which leaves the decision open: growth against a healthy flight at the same age of the
/// filter, half of U₀ ahead of every other rotor for 2 s.
template <std::size_t N>
Verdict paper_verdict(const std::vector<TrialMoment<N>>& trace, const std::vector<TrialMoment<N>>& healthy,
                      double initial_mg) {
  constexpr auto kMoments = static_cast<std::size_t>(2.0 / SignalPowerTrial<N>::kTracePeriod_s);
  std::size_t leader = N;
  std::size_t led = 0;
  for (std::size_t at = 0; at < std::min(trace.size(), healthy.size()); ++at) {
    std::array<double, N> growth_mg{};
    for (std::size_t i = 0; i < N; ++i) growth_mg[i] = trace[at].paper_mg[i] - healthy[at].paper_mg[i];
    const auto best = std::max_element(growth_mg.begin(), growth_mg.end());
    double second_mg = 0.0;
    for (auto other = growth_mg.begin(); other != growth_mg.end(); ++other) {
      if (other != best) second_mg = std::max(second_mg, *other);
    }
    const auto rotor = static_cast<std::size_t>(best - growth_mg.begin());
    const bool leads = *best - second_mg >= 0.5 * initial_mg;
    led = leads ? (rotor == leader ? led + 1 : 1) : 0;
    leader = rotor;
    if (led >= kMoments) {
      return {static_cast<int>(rotor), static_cast<double>(at) * SignalPowerTrial<N>::kTracePeriod_s, false};
    }
  }
  return {};
}

/// By the bands, as the policy has it.
template <std::size_t N>
Verdict bands_verdict(const std::vector<TrialMoment<N>>& trace) {
  Verdict verdict;
  for (std::size_t at = 0; at < trace.size(); ++at) {
    for (std::size_t i = 0; i < N; ++i) {
      if (!trace[at].is_named[i] || static_cast<int>(i) == verdict.rotor) continue;
      if (verdict.rotor >= 0) {
        verdict.others_too = true;
        continue;
      }
      verdict.rotor = static_cast<int>(i);
      verdict.time_s = static_cast<double>(at) * SignalPowerTrial<N>::kTracePeriod_s;
    }
  }
  return verdict;
}

}  // namespace airworthy::sim
