#pragma once

#include "core/detectors/unbalance/power_fallback.h"
#include "core/detectors/unbalance/rotor_hypotheses.h"
#include "core/detectors/unbalance/steady_amplitude.h"
#include "core/detectors/unbalance/unbalance_monitor.h"
#include "core/estimators/unbalance/order_tracker.h"

namespace airworthy {

/// UnbalanceMonitor for N rotors.
template <std::size_t N>
class RotorUnbalanceMonitor final : public UnbalanceMonitor {
 public:
  explicit RotorUnbalanceMonitor(const UnbalanceParams& params) noexcept;

  void on_phase(Phase phase) noexcept override;
  void on_speeds(TimePoint time, std::span<const double> speed_rad_s) noexcept override;
  void on_commands(TimePoint time, std::span<const double> command_ratio) noexcept override;
  bool on_accel(TimePoint time, double a_x_m_s2, double a_y_m_s2, double window_s) noexcept override;
  bool on_clock(TimePoint now) noexcept override;

  [[nodiscard]] DetectorState state() const noexcept override { return state_; }
  [[nodiscard]] TimePoint judged_at() const noexcept override { return judged_at_; }
  [[nodiscard]] std::span<const RotorUnbalance> rotors() const noexcept override { return rotor_; }
  [[nodiscard]] FaultLifeCycle::Transition ambiguity() const noexcept override { return ambiguity_; }
  [[nodiscard]] std::uint32_t candidates() const noexcept override { return candidates_; }
  [[nodiscard]] TimePoint ambiguous_since() const noexcept override { return ambiguous_since_; }
  [[nodiscard]] UnbalanceInnovation innovation() const noexcept override;
  [[nodiscard]] UnbalancePowers powers() const noexcept override;

 private:
  using Tracker = OrderTracker<double, N>;
  using Hypotheses = RotorHypotheses<double, N>;
  // Since when a condition holds.
  struct Held {
    bool holds = false;
    TimePoint since{};
    void step(bool now_holds, TimePoint now) noexcept {
      if (now_holds && !holds) since = now;
      holds = now_holds;
    }
    [[nodiscard]] bool for_s(double seconds, TimePoint now) const noexcept {
      return holds && to_seconds(now - since) >= seconds;
    }
  };

  void judge(TimePoint now) noexcept;
  void estimate(double dt_s) noexcept;
  /// RotorUnbalance::reading of a growth in m/s² and its sigma without that of the response.
  void read_mass(std::size_t rotor, double growth_m_s2, double sigma_m_s2) noexcept;
  void note_leader(const std::optional<typename Hypotheses::Verdict>& verdict) noexcept;
  void test_rotors(TimePoint now) noexcept;
  void note_speeds(double dt_s) noexcept;
  void test_ambiguity(TimePoint now, double log_odds_faulty) noexcept;
  void judge_by_power(TimePoint now, double dt_s) noexcept;
  void mute(UnbalanceNotJudged reason, TimePoint now) noexcept;
  [[nodiscard]] UnbalanceNotJudged reason_for_all(TimePoint now) const noexcept;
  [[nodiscard]] std::uint32_t confounded_with(std::size_t rotor, bool is_informed) const noexcept;
  /// The most that another rotor's amplitude may add to this one's.
  [[nodiscard]] double leaked_m_s2(std::size_t rotor) const noexcept;
  /// Of the errors of two rotors' amplitudes, 0 to 1.
  [[nodiscard]] double correlation(std::size_t i, std::size_t j) const noexcept;
  /// Growth of a rotor together with those it cannot be told from.
  [[nodiscard]] double shared_growth_m_s2(std::size_t rotor) const noexcept;
  /// The rotors of one sense, among those that cannot be told from `rotor`, that make more together than they could as
  /// calibrated; 0 if none do.
  [[nodiscard]] std::uint32_t grown_together(std::size_t rotor) const noexcept;
  [[nodiscard]] bool speeds_carry_the_vehicle() const noexcept;
  /// What the sensors leave of a vibration, 1 = all; the high-pass is not theirs.
  [[nodiscard]] double sensor_gain(double speed_rad_s) const noexcept;

  UnbalanceParams params_;
  Tracker tracker_;
  PowerFallback<N> fallback_;
  UnbalancePrior<double, N> prior_;
  std::array<RotorUnbalance, N> rotor_{};
  std::array<double, N> power_m2_s4_{};  ///< smoothed |A₊|² less its variance
  std::array<double, N> against_power_m2_s4_{};
  double estimated_s_ = 0.0;
  std::array<SteadyAmplitude, N> steady_{};
  std::array<FaultLifeCycle, N> life_;
  std::array<Held, N> grown_{};
  std::array<std::array<double, N>, N> apart2_rad2_s2_{};  ///< mean square difference of speeds
  std::array<bool, N> leads_{};      ///< explains what is felt better than any other rotor, by log_lead
  bool somebody_has_grown_ = false;  ///< that does not lead
  std::array<bool, N> is_known_{};
  FaultLifeCycle ambiguity_life_;
  FaultLifeCycle::Transition ambiguity_ = FaultLifeCycle::Transition::kNone;
  Held ambiguous_;
  TimePoint ambiguous_since_{};
  std::uint32_t candidates_ = 0;

  DetectorState state_ = DetectorState::kInitialising;
  Phase phase_ = Phase::kUnknown;
  TimePoint judged_at_{};
  TimePoint accel_at_{};
  bool has_accel_ = false;
  TimePoint tracking_since_{};
  bool is_tracking_ = false;
  bool has_judged_ = false;
  double window_s_ = 0.0;
  double nis_ = 2.0;
  std::int64_t fused_at_judgement_ = 0;
  std::array<double, N> last_speed_rad_s_{};
  std::array<TimePoint, N> speed_changed_at_{};
  std::array<int, N> changes_of_others_{};  ///< reports that changed since this rotor's last did
};

extern template class RotorUnbalanceMonitor<3>;
extern template class RotorUnbalanceMonitor<4>;
extern template class RotorUnbalanceMonitor<5>;
extern template class RotorUnbalanceMonitor<6>;
extern template class RotorUnbalanceMonitor<7>;
extern template class RotorUnbalanceMonitor<8>;

}  // namespace airworthy
