#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "core/detectors/detector_state.h"
#include "core/detectors/fault_life_cycle.h"
#include "core/detectors/flight_phase.h"
#include "core/time/time.h"
#include "core/vehicle/multirotor.h"

namespace airworthy {

/// Amplitudes are accelerations at the accelerometer at hover speed, m/s²; a mass m·r at rotor i makes
/// response · Bᵢ · m·r·ω₀² / vehicle mass of it, Bᵢ that of rigid_body_response.h (3).
struct UnbalanceParams {
  Multirotor vehicle;
  double smallest_m_s2 = 0.4;         ///< advisory: growth over the baseline that is reported
  double caution_m_s2 = 1.2;          ///< growth from which the vehicle should return
  bool thresholds_are_masses = true;  ///< then they change with `response`
  bool has_baseline = false;          ///< calibrated; otherwise every rotor is taken to have `usual_m_s2`
  double usual_m_s2 = 0.5;            ///< of propellers nobody has measured
  std::array<double, kMaxRotors> baseline_m_s2{};
  std::array<double, kMaxRotors> baseline_sigma_m_s2{};
  std::array<double, kMaxRotors>
      baseline_power_m2_s4{};  ///< UnbalancePowers of healthy flights; zeros = none
  double response = 1.0;  ///< acceleration felt / that of a rigid body, mean of x and y, near the rotor speed
  /// 1σ of response·Bᵢ over vehicle mass, of itself. Before a trial mass has measured it: that an airframe answers one
  /// axis more than the other by half again and more (Bebop 2: 1.6), and a battery or payload that the file does not
  /// tell.
  std::array<double, kMaxRotors> response_sigma_ratio{0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25};
  double against_ratio = 0.3;  ///< part of the vibration that turns against the rotor, of an uneven airframe
  double low_pass_Hz = 0.0;    ///< of the accelerometer; 0 = not known
  double speed_latency_s = 0.0;  ///< of the telemetry
  double speed_noise_ratio = 0.004;
  /// True over reported speed, less 1: motor controllers have clocks of their own.
  std::array<double, kMaxRotors> speed_error_ratio{};
  double most_speed_error_ratio =
      0.01;               ///< they may be off the above, and are followed in flight; 0 = not followed
  double log_odds = 9.2;  ///< of some rotor being out of balance, to report one that is nobody's: 10 000 to 1
  /// Of the rotor that is blamed over every other one: 20 to 1. Times 1 + 4·against_ratio², as an airframe that
  /// answers each rotor with an ellipse of its own is not what the hypotheses think it is (found on the Bebop 2, where
  /// it is 1).
  double log_lead = 3.0;
  double persistence_s = 0.5;      ///< of the growth before it is reported
  double ambiguous_after_s = 5.0;  ///< of an unbalance that is nobody's yet, before it is reported as such
  FaultLifeCycleParams life_cycle{.clear_ratio = 0.5, .clear_after = Duration{10'000'000}};
};

/// Why an unbalance of a rotor would not be seen now.
enum class UnbalanceNotJudged : std::uint8_t {
  kJudged,
  kNotFlying,          ///< by the flight phase
  kInertialStale,      ///< no inertial data for a second
  kConverging,         ///< less than 0.5 s of data, or too little information as yet
  kSpeedUnknown,       ///< rotor speeds missing, stale or too seldom
  kSpeedImplausible,   ///< rotor speeds that do not carry the vehicle, or frozen
  kUnfitInertialData,  ///< averaging, filter or rate of the accelerometer leave too little of the vibration
  kConfounded,         ///< turns too much like another rotor
};

/// The growth of one rotor as a mass times radius; without a baseline the whole of its unbalance. kg·m.
struct UnbalanceReading {
  double growth_kg_m = 0.0;
  double sigma_kg_m = 0.0;
  /// The truth is between low and high in 95 % of the flights with rotor speeds, if the mass of the vehicle file is
  /// right to 10 %; by power the interval says less than that.
  /// Not a number while the rotor is not judged; infinite where the response may be next to nothing.
  double low_kg_m = std::numeric_limits<double>::quiet_NaN();
  double high_kg_m = std::numeric_limits<double>::quiet_NaN();
};

/// What is known of the unbalance of one rotor.
struct RotorUnbalance {
  double amplitude_m_s2 = 0.0;
  double sigma_m_s2 = 0.0;
  double against_m_s2 = 0.0;  ///< amplitude of the part that turns against the rotor
  double growth_m_s2 = 0.0;   ///< over the baseline
  double growth_sigma_m_s2 = 0.0;
  UnbalanceReading reading;
  bool by_power = false;    ///< by the signal-power filter, as the speeds of the rotors are not known
  double log_odds = 0.0;    ///< that this rotor is out of balance, against everything else; 0 by power
  double test_ratio = 0.0;  ///< alarm at 1
  std::uint32_t confounded_with = 0;  ///< bit j: rotor j + 1 cannot be told from this one
  UnbalanceNotJudged reason = UnbalanceNotJudged::kNotFlying;
  FaultLifeCycle::Transition transition = FaultLifeCycle::Transition::kNone;
  TimePoint onset{};
};

/// How well the tracker's model explains what is felt, for the log.
struct UnbalanceInnovation {
  double nis = 0.0;  ///< mean over 1 s; 2 where the model is right
  double noise_m_s2 = 0.0;
  std::int64_t samples = 0;
  std::int64_t samples_refused = 0;
  std::int64_t speeds_refused = 0;
  std::array<double, kMaxRotors> speed_error_ratio{};  ///< as learned
};

/// What the signal-power filter has learned of the rotors, for a calibration.
struct UnbalancePowers {
  std::array<double, kMaxRotors>
      m2_s4{};             ///< squares of amplitudes at hover speed; noise may make one negative
  double learned_s = 0.0;  ///< the time that they rest upon
};

/// The policy of rotor unbalance over order tracking: who is out of balance, by how much, how sure. Without usable
/// speeds of the rotors it falls back to the signal-power filter, core/detectors/unbalance/power_fallback.h.
///
/// A rotor is reported when, for `persistence_s`, its growth over the baseline exceeds `smallest_m_s2` by two sigma
/// and what its neighbours may leak into it, while it is told apart from every other rotor and explains what is felt
/// better than any other would, by `log_lead`; the sigma holds all that the rotors share. What is out of balance by
/// `log_odds` but nobody's for `ambiguous_after_s` is reported as such, with the candidates. Judged in flight only.
class UnbalanceMonitor {
 public:
  static constexpr Duration kPeriod{100'000};  ///< of judging

  UnbalanceMonitor(const UnbalanceMonitor&) = delete;
  UnbalanceMonitor& operator=(const UnbalanceMonitor&) = delete;
  virtual ~UnbalanceMonitor() = default;

  virtual void on_phase(Phase phase) noexcept = 0;
  /// rad/s; NaN = not in this report. A report for another number of rotors is refused.
  virtual void on_speeds(TimePoint time, std::span<const double> speed_rad_s) noexcept = 0;
  /// Commands, 0 … 1, for the time when no speeds come.
  virtual void on_commands(TimePoint time, std::span<const double> command_ratio) noexcept = 0;
  /// Horizontal specific force in the body frame. True when the vehicle was judged anew.
  virtual bool on_accel(TimePoint time, double a_x_m_s2, double a_y_m_s2, double window_s) noexcept = 0;

  /// The clock, for the time when no inertial data come. True when the vehicle was judged anew.
  virtual bool on_clock(TimePoint now) noexcept = 0;

  [[nodiscard]] virtual DetectorState state() const noexcept = 0;
  [[nodiscard]] virtual TimePoint judged_at() const noexcept = 0;
  [[nodiscard]] virtual std::span<const RotorUnbalance> rotors() const noexcept = 0;
  /// The unbalance that is nobody's yet: its life, and who may have it (bit j: rotor j + 1).
  [[nodiscard]] virtual FaultLifeCycle::Transition ambiguity() const noexcept = 0;
  [[nodiscard]] virtual std::uint32_t candidates() const noexcept = 0;
  [[nodiscard]] virtual TimePoint ambiguous_since() const noexcept = 0;
  [[nodiscard]] virtual UnbalanceInnovation innovation() const noexcept = 0;
  [[nodiscard]] virtual UnbalancePowers powers() const noexcept = 0;

  /// Mass times radius that makes an amplitude of 1 m/s² at hover speed, felt in the centre of mass. kg·m.
  [[nodiscard]] static double kg_m_per_m_s2(const UnbalanceParams& params) noexcept;
  /// The same felt where the accelerometer is, of one rotor.
  [[nodiscard]] static double kg_m_per_m_s2(const UnbalanceParams& params, std::size_t rotor) noexcept;
  [[nodiscard]] static double hover_speed_rad_s(const Multirotor& vehicle) noexcept;

 protected:
  UnbalanceMonitor() = default;
};

}  // namespace airworthy
