#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/detectors/effectiveness/rotor_loss_test.h"
#include "core/detectors/effectiveness/rotor_mapping.h"
#include "core/detectors/effectiveness/slow_evidence.h"
#include "core/detectors/flight_phase.h"
#include "core/estimators/effectiveness/control_regression.h"
#include "core/estimators/effectiveness/disturbed_axis.h"
#include "core/estimators/effectiveness/effectiveness_matrix.h"
#include "core/estimators/effectiveness/loss_of_effectiveness_filter.h"
#include "core/estimators/effectiveness/rotor_speed_predictor.h"
#include "core/estimators/effectiveness/stream_delay.h"
#include "core/time/stamp_gate.h"

namespace airworthy::effectiveness {

/// A sudden great loss, a smaller one that shows later, and a gain: the return of what was lost.
inline constexpr std::size_t kLossRanges = 3;

/// How far the model may be wrong. Accelerations in shares of what one rotor gives in hover, so that the same
/// numbers fit a vehicle of 39 g and one of 6 kg.
struct ModelNoise {
  double acceleration_ratio = 0.04;  ///< always there, correlated over `correlation_s`
  double gain_error_ratio = 0.2;     ///< of the acceleration that the rotors give at this moment
  double correlation_s = 0.01;
  double rotor_error_ratio = 0.1;  ///< of what each rotor's thrust differs from usual: arms, propellers, air
  double rotor_correlation_s = 0.05;
  double vertical_correlation_s = 0.03;
  double lag_error_ratio = 0.1;  ///< of the motors' time constant ...
  double latency_error_s =
      0.001;  ///< ... and of commands: speeds that change are known so much too late or early
  double unheard_lag_error_ratio = 0.3;       ///< the same of motors whose speeds nobody reports ...
  double unheard_latency_error_s = 0.003;     ///< ... and of their commands
  double disturbance_ratio_per_sqrt_s = 0.1;  ///< gusts: how fast an outer moment or force wanders
  double vertical_ratio_per_sqrt_s = 0.6;     ///< climbing changes the thrust of all rotors
  double gyro_rad_s = 0.03;                   ///< first guess; adapts
  double accel_m_s2 = 0.7;
};

struct EffectivenessParams {
  Multirotor vehicle;
  EffectivenessMatrix<double> effectiveness;  ///< of the vehicle file, or learned
  RotorSpeedParams<double> speeds;
  ModelNoise noise;
  double false_alarms_per_hour = 1e-4;
  double samples_per_s = 500.0;
  double least_loss_ratio = 0.15;        ///< the smallest loss, or excess, that is looked for
  double propeller_spread_ratio = 0.04;  ///< by how much healthy propellers differ, one standard deviation
  double offset_ratio = 0.04;            ///< and the centre of mass from its place, in shares of the mean arm
  double lost_below_ratio = 0.3;         ///< effectiveness of what counts as lost
  double lost_probability = 0.9;
  bool mapping_is_known = false;       ///< as after a calibration: no need to wait for proof in flight
  bool learns_inertial_delay = false;  ///< the streams are stamped on arrival: see StreamDelay
  Duration most_wait{20'000};          ///< for the inputs that explain a sample
  Duration settle{500'000};            ///< in flight before a great loss is looked for
  Duration settle_partial{3'000'000};  ///< and before a partial one is, or anything once reports have stopped
  Duration most_classifying{
      30'000};  ///< from the onset until what is not surely lost is called a partial loss
};

enum class Muted : std::uint8_t {
  kNot,
  kPhase,  ///< on ground, taking off, landing, contact
  kSettling,
  kNoThrust,        ///< the rotors hardly lift: what one of them lost would not show
  kStruck,          ///< pushed from the side, as no rotor can
  kTooSlow,         ///< inertial data come less often than kLeastRate_Hz
  kFrozen,          ///< the inertial unit repeats itself: nothing is measured
  kNoSpeeds,        ///< neither reports nor commands
  kDelayUnknown,    ///< not yet known how much later than the speeds the inertial data come
  kTelemetry,       ///< of one rotor implausible, frozen or missing
  kSpeedsLate,      ///< without commands, reports come too seldom or too late
  kMappingUnknown,  ///< nothing has yet shown that the rotors are numbered as described
  kRotorMapping,    ///< the vehicle moves as if the rotors were numbered otherwise
  kRotorLost,       ///< what is left cannot be judged
};

enum class LossKind : std::uint8_t {
  kPropellerLost,
  kPartialLoss,
  kOverEffective,  ///< more thrust than described: a larger or steeper propeller
};

inline constexpr std::size_t kLossKinds = 3;

struct LossEvent {
  LossKind kind = LossKind::kPartialLoss;
  std::size_t rotor = 0;
  double effectiveness = 1.0;
  double sigma = 0.0;
  double probability = 0.0;  ///< of being lost; of an excess, that there is one
  double evidence = 0.0;
  double threshold = 0.0;
  double second = 0.0;
  double unexplained = 0.0;
  bool is_over = false;  ///< an excess that no longer shows; of kOverEffective alone: losses are latched
  TimePoint onset{};     ///< estimated; of what was there at take-off, since when it has been looked at
  TimePoint sample{};    ///< newest inertial sample that took part
  TimePoint decided{};   ///< of the message with which it was decided
};

/// What pushes the vehicle along one axis in the rotor plane. A lost rotor does not.
class LateralForce {
 public:
  /// Whether this sample shows a push: a change within some 10 ms, far beyond vibration.
  bool step(double accel_m_s2, double dt_s) noexcept;

 private:
  double slow_m_s2_ = 0.0;
  double fast_m_s2_ = 0.0;
  double variance_m2_s4_ = 1.0;  ///< of the fast mean around the slow one
};

/// Finds rotors that give less thrust than they should. Feed it what arrives, in the order of arrival; it waits
/// until speeds of the moment of each inertial sample are known. See docs/equations/effectiveness.md.
class EffectivenessMonitor {
 public:
  using Test = RotorLossTest<double, kMaxRotors, kLossRanges>;

  explicit EffectivenessMonitor(const EffectivenessParams& params) noexcept;

  /// Phase as known at the time of the sample.
  std::optional<LossEvent> on_imu(TimePoint time, const std::array<double, 3>& accel_m_s2,
                                  const std::array<double, 3>& gyro_rad_s, Phase phase) noexcept;
  /// The autopilot's opinion, where it has one.
  void on_report(LandedReport report) noexcept;
  std::optional<LossEvent> on_speeds(TimePoint time, std::span<const double> speed_rad_s) noexcept;
  std::optional<LossEvent> on_commands(TimePoint time, std::span<const double> command_ratio) noexcept;

  /// What became of an inertial sample.
  struct Judgement {
    TimePoint from;  ///< stamp of the sample before, as it came
    TimePoint time;  ///< and of this one
    Muted muted;     ///< kNot: it took part in the test, or restarted it after a gap
    Phase phase;
  };
  /// Shows every sample in order of time: for evaluation.
  using JudgementObserver = void (*)(void* context, const Judgement& judgement);
  void observe_judgement(JudgementObserver observer, void* context) noexcept {
    judgement_observer_ = observer;
    judgement_context_ = context;
  }

  /// Shows every sample that is judged, before the judgement: for evaluation.
  using Observer = void (*)(void* context, const MotionSample<double>& sample, TimePoint now);
  void observe(Observer observer, void* context) noexcept {
    observer_ = observer;
    observer_context_ = context;
  }

  [[nodiscard]] Muted muted() const noexcept { return muted_; }
  [[nodiscard]] std::size_t muted_rotor() const noexcept { return muted_rotor_; }
  [[nodiscard]] const Test& test() const noexcept { return test_; }
  [[nodiscard]] const RotorSpeedPredictor<double>& speeds() const noexcept { return speeds_; }
  [[nodiscard]] double gyro_sigma(std::size_t axis) const noexcept;
  [[nodiscard]] double accel_sigma() const noexcept;
  /// What the model now takes for rotor i: 1, or what was found.
  [[nodiscard]] double effectiveness(std::size_t i) const noexcept { return effectiveness_[i]; }
  [[nodiscard]] std::optional<std::size_t> lost_rotor() const noexcept { return lost_; }
  [[nodiscard]] const SlowEvidence& slow() const noexcept { return slow_; }
  [[nodiscard]] Mapping mapping() const noexcept { return mapping_; }
  /// How much later than the rotor speeds the inertial data are stamped, as learned; 0 where it is not.
  [[nodiscard]] Duration inertial_delay() const noexcept { return inertial_delay_; }
  /// What explains the motion where mapping() is kWrongNumbers.
  [[nodiscard]] const RotorMapping<double>::Verdict& numbering() const noexcept { return numbering_; }
  /// Bit i: rotor i turns the other way than described; nothing while nobody says so, or while the numbering is wrong.
  [[nodiscard]] std::optional<std::uint32_t> wrong_spin() const noexcept {
    return mapping_ == Mapping::kWrongNumbers ? std::nullopt : slow_.wrong_spin();
  }
  [[nodiscard]] double judged_s() const noexcept { return judged_s_; }
  /// Stamp of the newest inertial sample that was taken.
  [[nodiscard]] const std::optional<TimePoint>& newest_sample() const noexcept { return stamps_.newest(); }
  [[nodiscard]] std::int64_t times_gone_back() const noexcept { return times_gone_back_; }
  /// Samples whose stamp was older than one that turned out to be wrong: see StampGate.
  [[nodiscard]] std::int64_t stamps_restarted() const noexcept { return stamps_.restarts(); }
  /// Samples that repeat the rates of the one before: no measurement.
  [[nodiscard]] std::int64_t samples_repeated() const noexcept { return repeated_; }
  [[nodiscard]] std::int64_t samples_dropped() const noexcept { return dropped_; }
  /// How often the motion fitted best what no rotor does in flight: a gain of one that had lost nothing.
  [[nodiscard]] std::int64_t impossible_gains() const noexcept { return impossible_gains_; }

 private:
  struct Inertial {
    TimePoint stamp;  ///< as it came
    TimePoint time;   ///< in that of the rotor speeds
    std::array<double, 3> accel_m_s2;
    std::array<double, 3> gyro_rad_s;
    Phase phase;
  };
  static constexpr std::size_t kWaiting = 64;

  [[nodiscard]] bool repeats(TimePoint time, const std::array<double, 3>& accel_m_s2,
                             const std::array<double, 3>& gyro_rad_s) noexcept;
  void start_over(TimePoint time) noexcept;
  void note_lateness(TimePoint report) noexcept;
  [[nodiscard]] bool come_too_late() const noexcept;
  std::optional<LossEvent> process(TimePoint now) noexcept;
  std::optional<LossEvent> step(const Inertial& sample, TimePoint now) noexcept;
  void watch_ground(const Inertial& sample) noexcept;
  [[nodiscard]] Muted reason(const Inertial& sample) noexcept;
  [[nodiscard]] bool is_blow(const MotionSample<double>& motion) const noexcept;
  std::optional<LossEvent> judge(const Inertial& sample, double dt_s, TimePoint now) noexcept;
  [[nodiscard]] bool advance_speeds(TimePoint time) noexcept;
  [[nodiscard]] double longest_step_s() const noexcept;
  void watch_input(const Inertial& sample, double dt_s) noexcept;
  void watch_source(TimePoint time) noexcept;
  void learn_delay(const Inertial& sample, bool in_flight) noexcept;
  void add_to_delay(const Inertial& sample) noexcept;
  void start(const Inertial& sample) noexcept;
  void watch_mapping(const Inertial& sample, double dt_s) noexcept;
  [[nodiscard]] MotionSample<double> innovate(const Inertial& sample, double dt_s) noexcept;
  [[nodiscard]] bool is_silent(std::size_t rotor, TimePoint now) const noexcept;
  [[nodiscard]] bool is_any_silent(TimePoint now) const noexcept;
  [[nodiscard]] bool is_beyond_ground(const Test::Finding& finding) const noexcept;
  std::optional<LossEvent> decide(const MotionSample<double>& sample, TimePoint now) noexcept;
  /// Below it, effectiveness differs from 1 by nothing worth a word.
  [[nodiscard]] double dead_ratio() const noexcept;
  /// Whether rotor i is believed to give less than that.
  [[nodiscard]] bool has_lost(std::size_t rotor) const noexcept;
  void set_effectiveness(std::size_t rotor, double effectiveness) noexcept;
  /// Nothing where the rotor is within the dead ratio, and nothing was said of it.
  [[nodiscard]] std::optional<LossKind> kind_of(const LossEvent& event) const noexcept;
  void believe(const LossEvent& event, const Test::Finding& finding) noexcept;
  void follow(std::size_t rotor, double effectiveness, const Test::Finding& finding) noexcept;
  std::optional<SlowEvidence::Excess> watch_slowly(const Inertial& sample) noexcept;
  [[nodiscard]] LossEvent event_of(const SlowEvidence::Excess& excess, TimePoint now) noexcept;

  EffectivenessParams params_;
  RotorSpeedPredictor<double> speeds_;
  Test test_;
  std::array<RateAxis<double>, 2> rate_;
  ForceAxis<double> vertical_;
  std::array<AdaptiveVariance<double>, 2> gyro_variance_;
  AdaptiveVariance<double> accel_variance_;
  std::array<double, 3> authority_{};  ///< acceleration that one rotor gives in hover
  std::array<double, kMaxRotors> effectiveness_{};
  std::array<double, kMaxRotors> speed_before_{};
  std::array<double, kMaxRotors> mean_speed2_{};  ///< since the sample before
  std::array<double, kMaxRotors> usual_speed2_{};
  std::array<std::array<double, 2>, kMaxRotors> inflow_per_rate_{};
  std::array<double, kMaxRotors> vertical_at_imu_{};
  double hover_speed_sum_ = 1.0;
  double timing_error_s_ = 0.0;
  double unheard_timing_error_s_ = 0.0;
  double mean_vertical_m_s2_ = 0.0;  ///< that the rotors give, slow

  std::array<Inertial, kWaiting> waiting_{};
  std::size_t waiting_first_ = 0;
  std::size_t waiting_count_ = 0;
  StampGate stamps_;
  std::optional<TimePoint> last_moved_;  ///< less the delay
  std::optional<TimePoint> last_processed_;
  TimePoint last_stamp_{};  ///< of the same sample
  std::optional<TimePoint> in_flight_since_;
  std::optional<TimePoint> on_ground_since_;
  std::optional<TimePoint> source_since_;  ///< speeds come from commands alone, or no longer do
  std::optional<std::size_t> lost_;
  std::array<LateralForce, 2> lateral_;
  std::optional<TimePoint> struck_;
  double mean_step_s_ = 0.0;
  double hardly_lifts_s_ = 0.0;
  ControlRegression<double> tilt_;
  StreamDelay<double> delay_;
  std::array<Inertial, kWaiting> delayed_{};  ///< wait for what the speeds were at their stamps
  std::size_t delayed_first_ = 0;
  std::size_t delayed_count_ = 0;
  std::optional<TimePoint> delay_added_;
  Duration inertial_delay_{0};
  SlowEvidence slow_;
  RotorMapping<double>::Verdict numbering_{};
  double mapping_threshold_ = 0.0;
  double mapping_age_s_ = 0.0;
  Observer observer_ = nullptr;
  void* observer_context_ = nullptr;
  JudgementObserver judgement_observer_ = nullptr;
  void* judgement_context_ = nullptr;
  std::size_t muted_rotor_ = 0;
  double judged_s_ = 0.0;
  std::int64_t times_gone_back_ = 0;
  std::int64_t dropped_ = 0;
  std::int64_t impossible_gains_ = 0;
  std::int64_t repeated_ = 0;
  std::array<double, 3> gyro_before_{};
  std::array<double, 3> accel_before_{};
  TimePoint gyro_changed_{};  ///< when a sample last differed from the one before
  TimePoint accel_changed_{};
  std::array<double, 3> gyro_watched_{};  ///< of the sample before, as it was watched for pushes
  double lateness_s_ = 0.0;               ///< of the reports, on arrival, against the inertial stamps
  // Small ones together: no padding between the others.
  SpeedSource source_ = SpeedSource::kNone;
  bool needs_start_ = false;
  bool delay_is_known_ = false;
  Mapping mapping_ = Mapping::kUnknown;
  bool mapping_was_plausible_ = false;
  bool reported_in_air_ = false;
  bool cautious_ = false;  ///< perhaps touching the ground
  Muted muted_ = Muted::kNoSpeeds;
};

}  // namespace airworthy::effectiveness
