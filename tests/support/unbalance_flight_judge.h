#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "core/detectors/flight_phase.h"
#include "core/detectors/unbalance/rotor_unbalance_monitor.h"
#include "sim/simulation.h"

namespace airworthy::sim {

inline TimePoint vehicle_time(double time_s) {
  return TimePoint{Duration{std::llround((100.0 + time_s) * 1e6)}};
}

/// Feeds a simulated flight into the flight phase and the unbalance monitor, as the service does, and keeps what
/// came of it.
template <std::size_t N>
class UnbalanceFlightJudge final : public Output {
 public:
  explicit UnbalanceFlightJudge(const UnbalanceParams& params, bool has_speeds = true)
      : phase_{params.vehicle},
        monitor_{std::make_unique<RotorUnbalanceMonitor<N>>(params)},
        has_speeds_{has_speeds} {
    raised_s.fill(std::numeric_limits<double>::quiet_NaN());
  }

  void on_truth(const Truth&) override {}
  void on_attitude(const AutopilotSample&) override {}
  void on_esc(const EscSample& sample) override {
    if (!has_speeds_) return;
    std::array<double, N> speeds{};
    for (std::size_t i = 0; i < N; ++i) speeds[i] = sample.speed_rpm[i] * std::numbers::pi / 30.0;
    phase_.on_rotor_speeds(vehicle_time(sample.time_s), speeds);
    monitor_->on_speeds(vehicle_time(sample.time_s), speeds);
  }
  void on_commands(const AutopilotSample& sample) override {
    const auto commands = std::span{sample.control.command_ratio}.first(N);
    phase_.on_rotor_commands(vehicle_time(sample.time_s), commands);
    monitor_->on_commands(vehicle_time(sample.time_s), commands);
  }
  void on_flight_state(const AutopilotSample& sample, LandedState landed) override {
    phase_.on_report(vehicle_time(sample.time_s), static_cast<LandedReport>(landed),
                     -sample.estimate.velocity_N_m_s.z());
  }
  void on_imu(const ImuSample& sample) override {
    const TimePoint time = vehicle_time(sample.time_s);
    phase_.on_imu(time, {sample.accel_m_s2.x(), sample.accel_m_s2.y(), sample.accel_m_s2.z()},
                  {sample.gyro_rad_s.x(), sample.gyro_rad_s.y(), sample.gyro_rad_s.z()});
    if (std::isnan(airborne_s) && phase_.phase() == Phase::kInFlight) airborne_s = sample.time_s;
    monitor_->on_phase(phase_.phase());
    if (monitor_->on_accel(time, sample.accel_m_s2.x(), sample.accel_m_s2.y(), sample.averaging_window_s)) {
      note(sample.time_s);
    }
  }

  /// Mean amplitude of a rotor over its judgements, and their spread.
  [[nodiscard]] double mean_m_s2(std::size_t rotor) const { return sum_[rotor] / count_[rotor]; }
  [[nodiscard]] double sigma_m_s2(std::size_t rotor) const {
    return std::sqrt(std::max(0.0, squares_[rotor] / count_[rotor] - mean_m_s2(rotor) * mean_m_s2(rotor)));
  }
  /// Of the rotor that was judged least.
  [[nodiscard]] double least_judged_s() const {
    return to_seconds(UnbalanceMonitor::kPeriod) * *std::min_element(count_.begin(), count_.end());
  }
  /// Of what turns against the rotors to what turns with them, as the calibration command learns it.
  [[nodiscard]] double against_ratio() const {
    double with = 0.0;
    for (const double square : squares_) with += square;
    return with > 0.0 ? std::clamp(std::sqrt(against_squares_ / with), 0.05, 1.0) : 0.3;
  }
  [[nodiscard]] const RotorUnbalanceMonitor<N>& monitor() const { return *monitor_; }

  std::array<double, N> raised_s{};  ///< first time each rotor was reported; NaN = never
  std::uint32_t candidates = 0;      ///< of an unbalance that was nobody's
  double ambiguous_s = std::numeric_limits<double>::quiet_NaN();
  double airborne_s = std::numeric_limits<double>::quiet_NaN();
  double judged_s = 0.0;
  double confounded_s = 0.0;                  ///< of those, with a rotor that could not be told from another
  std::array<UnbalanceReading, N> reading{};  ///< newest

 private:
  void note(double time_s) {
    const double period_s = to_seconds(UnbalanceMonitor::kPeriod);
    const auto rotors = monitor_->rotors();
    if (monitor_->ambiguity() == FaultLifeCycle::Transition::kRaise) {
      ambiguous_s = time_s;
      candidates |= monitor_->candidates();
    }
    const bool judges = monitor_->state() == DetectorState::kMonitoring;
    if (judges) judged_s += period_s;
    bool confounded = false;
    for (std::size_t i = 0; i < N; ++i) {
      if (rotors[i].transition == FaultLifeCycle::Transition::kRaise && std::isnan(raised_s[i]))
        raised_s[i] = time_s;
      confounded = confounded || rotors[i].reason == UnbalanceNotJudged::kConfounded;
      if (!judges || rotors[i].reason != UnbalanceNotJudged::kJudged) continue;
      reading[i] = rotors[i].reading;
      sum_[i] += rotors[i].amplitude_m_s2;
      squares_[i] += rotors[i].amplitude_m_s2 * rotors[i].amplitude_m_s2;
      against_squares_ += rotors[i].against_m_s2 * rotors[i].against_m_s2;
      count_[i] += 1.0;
    }
    if (judges && confounded) confounded_s += period_s;
  }

  FlightPhase phase_;
  std::unique_ptr<RotorUnbalanceMonitor<N>> monitor_;
  bool has_speeds_;
  std::array<double, N> sum_{};
  std::array<double, N> squares_{};
  std::array<double, N> count_{};
  double against_squares_ = 0.0;
};

}  // namespace airworthy::sim
