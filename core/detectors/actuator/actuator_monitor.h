#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "core/detectors/actuator/loss_policy.h"
#include "core/detectors/actuator/mixing.h"
#include "core/detectors/actuator/rotor_thrust.h"
#include "core/detectors/actuator/sample_check.h"
#include "core/detectors/detector_state.h"
#include "core/detectors/flight_phase.h"
#include "core/estimators/actuator/multi_stage_observer.h"
#include "core/time/stamp_gate.h"

namespace airworthy::actuator {

struct ActuatorMonitorParams {
  Multirotor vehicle;
  InputSource source = InputSource::kAuto;
  // What is measured.
  double gyro_sigma_rad_s = 0.05;  ///< vibration included
  double accel_sigma_m_s2 = 0.5;   ///< after the low-pass
  double accel_lowpass_s = 0.02;
  double angle_sigma_rad = 0.02;
  double climb_sigma_m_s = 0.3;
  double timing_sigma_s = 0.01;  ///< how well the moment of a thrust is known, against the gyro's
  // Disturbances: standard deviation as a share of what one rotor does in hover, and how long they last.
  double disturbance_ratio = 0.15;  ///< roll, pitch
  double yaw_disturbance_ratio = 0.6;
  double height_disturbance_ratio = 0.5;
  double disturbance_time_s = 1.0;
  // Losses.
  double prior_sigma = 0.3;            ///< of γ when a flight begins
  double drift_sigma_1_sqrt_s = 0.05;  ///< random walk of γ in one second
  double healthy_spread = 0.03;        ///< σ of γ − baseline of a healthy rotor
  double first_spread = 0.2;           ///< what that is taken for until a flight has shown it
  double most_baseline = 0.2;  ///< largest constant γ of a healthy rotor that is learned and taken off
  double isolation_log_likelihood = 5;  ///< by so much the named rotor must explain more than the next
  double rotor_judged_sigma = 0.45;     ///< a rotor with a larger σ of (3) is not judged
  double axis_judged_sigma = 0.2;       ///< the same of γ of an axis
  Duration settle{3'000'000};           ///< of flight, before anything is judged
  LossPolicyParams rotor;
  LossPolicyParams axis{.loss = 0.5,
                        .probability = 0.99,
                        .persistence = Duration{500'000},
                        .life_cycle = {.clear_ratio = 0.5, .clear_after = Duration{5'000'000}}};
};

enum class NotJudged : std::uint8_t {
  kJudged,
  kNoInput,        ///< neither speed nor command of the rotors
  kInputTooSlow,   ///< rotor speeds or commands come too seldom or too late
  kNotFlying,      ///< the phase of flight forbids it
  kFrozen,         ///< the inertial unit repeats its values
  kConverging,     ///< not yet long enough in flight
  kNotExcited,     ///< nothing was asked of this axis that would tell
  kNotObservable,  ///< the rotors' forces do not tell this one from others
  kImplausible,    ///< γ is what no loss can be: the model does not hold
};

/// γ beyond these is no loss of effectiveness.
inline constexpr double kLeastLoss = -1.0;
inline constexpr double kMostLoss = 2.0;

/// γ ± σ of one rotor or axis and what became of it. Equation numbers: ActuatorMonitor.
struct LossVerdict {
  double gamma = std::numeric_limits<double>::quiet_NaN();  ///< like test_gamma within kLeastLoss, kMostLoss
  double sigma = std::numeric_limits<double>::quiet_NaN();
  double baseline = 0.0;  ///< of γ, learned while healthy
  double test_gamma =
      std::numeric_limits<double>::quiet_NaN();  ///< what the policy judged: of a rotor, (3) with (4)
  double test_sigma = std::numeric_limits<double>::quiet_NaN();
  double probability = 0.0;  ///< that test_gamma exceeds the policy's loss
  double lead = 0.0;         ///< log-likelihood over the next best rotor
  bool is_isolated = true;
  NotJudged reason = NotJudged::kNoInput;
  FaultLifeCycle::Transition transition = FaultLifeCycle::Transition::kNone;
  TimePoint onset{};
  std::uint32_t candidates = 0;  ///< bit j: rotor j explains the same
};

/// What a controller can use: the state of an axis with what the loss takes away accounted for.
struct AxisState {
  double position = std::numeric_limits<double>::quiet_NaN();  ///< angle, rad; of height: climb, m/s
  double position_sigma = std::numeric_limits<double>::quiet_NaN();
  double rate = std::numeric_limits<double>::quiet_NaN();  ///< rad/s; of height: specific force upward, m/s²
  double rate_sigma = std::numeric_limits<double>::quiet_NaN();
  double disturbance = std::numeric_limits<double>::quiet_NaN();  ///< rad/s²; of height m/s²
  double commanded = std::numeric_limits<double>::quiet_NaN();  ///< what healthy rotors would give, same unit
};

struct MonitorSample {
  TimePoint time;
  std::array<double, 3> accel_m_s2{};
  std::array<double, 3> gyro_rad_s{};
};

/// Loss of effectiveness of every rotor and of every axis of a multirotor, by multi-stage observers.
///   Rotors  x = [p q r f d_p d_q d_r d_f], u = s of every rotor, B = mixing matrix; y = [p q r f]       (1)
///           ω' = ω + Δt·(M·(s − S·γ) + d + gyroscopic);  f' = f + a·(M_f·(s − S·γ) + d_f − f)
///   Axes    x = [angle, rate, d], u = the sum of M·s on that axis; y = [angle, rate], each axis by itself   (2)
///           height: [climb, f, d], climb' = climb + Δt·(f·cos φ·cos θ − g)
///   Input   between its samples the commanded acceleration wanders: D is the mean square of its changes over their time;
///           of an input that is not prompt, D·(delay² − that of a prompt one) is white noise of the rates         (5)
///   f is the specific force upward after the low-pass of the accelerometer, a = 1 − exp(−Δt/τ); d: disturbances,
///   first-order Gauss-Markov; on the axes so strong that only a *varying* u tells γ. s: rotor_thrust.h, less the inflow
///   of a rotor that moves along its axis. Noise of the rates: what the inputs may have missed between their samples, and
///   timing_sigma_s times the commanded acceleration
///   Alone   P' = P_γ + h²·I, Y = P'⁻¹: if rotor j alone has lost something, γⱼ = (Y·γ̂)ⱼ/Yⱼⱼ ± Yⱼⱼ^−½, and that
///           explains (Y·γ̂)ⱼ²/(2·Yⱼⱼ) of the log-likelihood                                             (3)
/// A rotor's fault is judged by (3), which also works where several rotors act alike; the rotor that explains most is
/// named if it leads by isolation_log_likelihood, otherwise all that come as close are candidates. A rotor that has failed
/// may have lost anything (h = 1 in (3)), and what goes wrong within 2 s of a fault is its consequence, no second fault.
///   Spread  γ − baseline of healthy rotors has, in this flight and this wind, the mean square q over rotors and time
///           (3 s where it rises, 10 s where it falls); the policy takes σ = max(Yⱼⱼ^−½, 1.5·√q)            (4)
/// Neither baseline (time constant 20 s, bounded) nor q learns while a fault is more probable than not.
/// Collective thrust per command differs from the vehicle file (battery, air): the ratio is learned in flight, over 3 s
/// first, then over a minute, and not while anything is suspected. A loss that all rotors share is therefore not seen.
/// What γ beyond [−1, 2] would explain is no loss: it is not raised, and the bound is published with the reason.
/// A sample that SampleCheck does not take is no measurement: the observers go on by their models alone. What repeats for
/// longer than 0.05 s mutes, and the flight's estimates start anew after it.
/// Axes are judged by prompt input only, for a command that acts late looks like one without effect.
/// In a phase other than flight nothing is estimated, and each flight starts anew. Once the vehicle has stood on the ground
/// for 3 s it may have been repaired: baselines, thrust per command and latched rotors are forgotten, and what is found in
/// the next flight is raised again. Whether that is news to the operator is for who publishes it to say.
class ActuatorMonitor {
 public:
  static constexpr int kRotorStates = 8;
  using RotorObserver = MultiStageObserver<double, kRotorStates, kRotorColumns, 4>;
  using AxisObserver = MultiStageObserver<double, 3, 1, 2>;

  explicit ActuatorMonitor(const ActuatorMonitorParams& params) noexcept;

  void on_rotor_speeds(TimePoint time, std::span<const double> speed_rad_s) noexcept {
    thrust_.on_speeds(time, speed_rad_s);
  }
  void on_rotor_commands(TimePoint time, std::span<const double> command_ratio) noexcept {
    thrust_.on_commands(time, command_ratio);
  }
  /// Attitude that is not finite is refused and counted.
  void on_attitude(double roll_rad, double pitch_rad, double yaw_rad) noexcept;
  /// Positive up; NaN = not known: not fused.
  void on_climb(double climb_m_s) noexcept;
  /// Estimates and judges. kTimeBackward (by StampGate), kNotFinite, kOutOfRange (beyond 200 rad/s or 2000 m/s²): nothing
  /// happened.
  UpdateStatus on_imu(const MonitorSample& sample, Phase phase) noexcept;
  /// Silence of the inertial unit, judged on the gateway's clock.
  void on_clock(TimePoint now) noexcept;

  [[nodiscard]] DetectorState state() const noexcept;
  [[nodiscard]] NotJudged reason() const noexcept { return reason_; }
  [[nodiscard]] TimePoint time() const noexcept { return now_; }
  [[nodiscard]] std::span<const LossVerdict> rotors() const noexcept {
    return std::span{rotor_verdicts_}.first(params_.vehicle.rotor_count);
  }
  [[nodiscard]] const std::array<LossVerdict, kAxes>& axes() const noexcept { return axis_verdicts_; }
  [[nodiscard]] const std::array<AxisState, kAxes>& axis_states() const noexcept { return axis_states_; }
  [[nodiscard]] double nis() const noexcept { return innovation_.nis; }
  /// Inertial samples: not finite, out of range, or not newer than the one before.
  [[nodiscard]] std::int64_t refused() const noexcept { return refused_; }
  [[nodiscard]] std::int64_t refused_attitudes() const noexcept { return refused_attitudes_; }
  /// Samples of gyro or accelerometer that were no measurement, by SampleCheck.
  [[nodiscard]] std::int64_t outliers() const noexcept { return gyro_.outliers() + accel_.outliers(); }
  [[nodiscard]] std::int64_t repeated() const noexcept { return gyro_.repeated() + accel_.repeated(); }
  /// How often the newest inertial stamp turned out to have been wrong.
  [[nodiscard]] std::int64_t restarts() const noexcept { return stamps_.restarts(); }
  [[nodiscard]] const RotorThrust& rotor_input() const noexcept { return thrust_; }

 private:
  struct Body;

  void watch_ground(Phase phase) noexcept;
  void forget_flights() noexcept;
  void start_flight() noexcept;
  void pause(NotJudged reason) noexcept;
  [[nodiscard]] NotJudged obstacle(Phase phase) const noexcept;
  void check_sensors(const MonitorSample& sample) noexcept;
  void learn_thrust_ratio(double dt_s) noexcept;
  [[nodiscard]] bool estimate(const std::array<double, 3>& gyro_rad_s, double dt_s) noexcept;
  void find_missed(double dt_s) noexcept;
  void find_thrusts(const Body& body) noexcept;
  [[nodiscard]] UpdateStatus estimate_rotors(const Body& body, double dt_s) noexcept;
  [[nodiscard]] UpdateStatus estimate_axis(std::size_t axis, const Body& body, double dt_s) noexcept;
  [[nodiscard]] AxisObserver::Transition axis_transition(std::size_t axis, const Body& body,
                                                         double dt_s) const noexcept;
  [[nodiscard]] AxisObserver::Measurement axis_measurement(std::size_t axis, const Body& body,
                                                           double input) const noexcept;
  void learn_spread(double dt_s) noexcept;
  [[nodiscard]] bool explain_rotors() noexcept;
  void judge_rotors() noexcept;
  void judge_rotor(std::size_t rotor) noexcept;
  [[nodiscard]] bool is_consequence() const noexcept;
  [[nodiscard]] bool any_rotor_failed() const noexcept;
  void compare(std::size_t rotor) noexcept;
  [[nodiscard]] double rate_variance(double commanded_rad_s2) const noexcept;
  [[nodiscard]] double accel_variance() const noexcept;
  void judge_axes() noexcept;
  [[nodiscard]] Eigen::Matrix<double, 3, 1> gyroscopic(
      const std::array<double, 3>& rate_rad_s) const noexcept;

  ActuatorMonitorParams params_;
  MixingMatrix mixing_;
  std::array<double, kAxes> disturbance_{};  ///< standard deviation, rad/s² and m/s²
  RotorThrust thrust_;
  std::optional<RotorObserver> rotor_observer_;
  std::array<std::optional<AxisObserver>, kAxes> axis_observers_;
  RotorObserver::Innovation innovation_;

  StampGate stamps_;
  SampleCheck gyro_;
  SampleCheck accel_;
  TimePoint now_{};
  double flown_s_ = 0.0;
  double thrust_ratio_ = 1.0;
  std::array<double, kMaxRotors> specific_thrust_m_s2_{};
  using AxisVector = Eigen::Matrix<double, static_cast<int>(kAxes), 1>;
  AxisVector missed_variance_ = AxisVector::Zero();  ///< rad²/s²
  AxisVector input_diffusion_ = AxisVector::Zero();  ///< D of (5), rad²/s⁵
  double seen_variance_ = 0.0;
  std::array<double, kMaxRotors> explained_{};  ///< log-likelihood, (3)
  double accel_up_m_s2_ = 0.0;
  std::array<double, 3> angle_rad_{};
  double climb_m_s_ = std::numeric_limits<double>::quiet_NaN();
  std::int64_t refused_ = 0;
  std::int64_t refused_attitudes_ = 0;
  std::optional<TimePoint> last_raised_;
  std::optional<TimePoint> on_ground_since_;

  std::array<LossVerdict, kMaxRotors> rotor_verdicts_{};
  std::array<LossVerdict, kAxes> axis_verdicts_{};
  std::array<AxisState, kAxes> axis_states_{};
  std::array<std::optional<LossPolicy>, kMaxRotors> rotor_policies_;
  std::array<std::optional<LossPolicy>, kAxes> axis_policies_;
  bool has_time_ = false;
  bool has_gyro_ = false;  ///< of this sample: it is a measurement
  bool has_accel_ = false;
  NotJudged reason_ = NotJudged::kNoInput;
  bool has_accel_up_ = false;
  bool has_new_angle_ = false;
};

}  // namespace airworthy::actuator
