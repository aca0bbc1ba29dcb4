#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/estimators/effectiveness/effectiveness_matrix.h"
#include "core/estimators/effectiveness/rotor_speed_predictor.h"
#include "core/estimators/effectiveness/spin_regression.h"
#include "core/estimators/effectiveness/thrust_regression.h"
#include "core/time/time.h"

namespace airworthy::effectiveness {

struct SlowEvidenceParams {
  Multirotor vehicle;
  EffectivenessMatrix<double> effectiveness;
  RotorSpeedParams<double> speeds;
  double false_alarms_per_hour = 1e-4;
  double propeller_spread_ratio = 0.04;  ///< by how much healthy propellers differ, one standard deviation
  double offset_ratio = 0.04;            ///< and the centre of mass from its place, in shares of the mean arm
  double gain_ratio = 0.2;               ///< and the control effectiveness of a whole axis
  double least_excess_ratio = 0.15;      ///< the smallest that is looked for
};

/// One inertial sample for SlowEvidence.
struct SlowSample {
  TimePoint time;
  std::array<double, 3> accel_m_s2{};
  std::array<double, 3> gyro_rad_s{};
  bool is_judged = false;   ///< in free flight, nothing wrong with the input
  bool may_accuse = false;  ///< the rotors are known to be numbered as described
};

/// What only shows over seconds to minutes: a rotor that has given more thrust than described since take-off, and
/// rotors that turn the other way than described. It waits for telemetry in place of predicting the speeds.
///   Excess   for kLasting: ℓᵢ of ThrustRegression at least h, kᵢ = believedᵢ·(1 + δᵢ) at least 1 + least_excess with
///            δᵢ > 0, and margin before every other rotor, however that one differs; cleared when kᵢ + 2σ stays below 1 + ½·least_excess
///            for kClearAfter. One rotor at a time is accused here; what note() has told of others is followed too
///   Spin     a pattern of SpinRegression at least h before the one described; named if margin before all others
///   h        ln(hypotheses·looks per hour/false alarms per hour); sums fade within kMemory_s: a look is half of that
class SlowEvidence {
 public:
  static constexpr double kMemory_s = 180.0;
  static constexpr double kMargin = 8.0;  ///< nats, as of RotorLossTest
  /// A wrong propeller stays what it is; what a steep descent does to the air passes.
  static constexpr Duration kLasting{5'000'000};
  static constexpr Duration kClearAfter{10'000'000};

  struct Excess {
    std::size_t rotor = 0;
    double effectiveness = 1.0;
    double sigma = 0.0;
    double probability = 0.0;  ///< that it is above 1
    double evidence = 0.0;
    double second = 0.0;
    bool is_first = false;  ///< found anew, or again in this flight: not what was said of it before
    bool is_over = false;   ///< no longer so: cleared
    TimePoint since{};      ///< first sample of the flight that took part
    TimePoint sample{};
  };

  explicit SlowEvidence(const SlowEvidenceParams& params) noexcept;

  void on_speeds(TimePoint time, std::span<const double> speed_rad_s) noexcept;
  /// In order of time. What was found, once a second at most.
  std::optional<Excess> on_imu(const SlowSample& sample) noexcept;
  /// On the ground: a propeller may be changed. Nobody is believed to give too much any more, and what was said of an excess
  /// is judged afresh in the next flight. What was said of the sense of rotation stays.
  void end_flight() noexcept;
  /// The model now takes this for rotor i: evidence against the old model no longer counts.
  void believe(std::size_t rotor, double effectiveness) noexcept;
  /// Others have said that rotor i gives too much, or that this is over: an excess is followed here until it is over.
  void note(std::size_t rotor, bool is_excess) noexcept;

  /// Bit i: rotor i turns the other way than described; nothing while nobody says so.
  [[nodiscard]] std::optional<std::uint32_t> wrong_spin() const noexcept { return wrong_spin_; }
  /// Whether the data name the rotors of wrong_spin(), not only that the description is wrong.
  [[nodiscard]] bool is_spin_named() const noexcept { return spin_is_named_; }
  [[nodiscard]] double spin_evidence() const noexcept { return spin_evidence_; }
  [[nodiscard]] double excess_threshold() const noexcept { return excess_threshold_; }
  [[nodiscard]] double spin_threshold() const noexcept { return spin_threshold_; }
  /// kᵢ as last estimated; what is believed where nothing has been seen yet.
  [[nodiscard]] double effectiveness(std::size_t i) const noexcept {
    return believed_[i] * (1.0 + deviation_[i].mean);
  }
  /// Whether rotor i was said to give too much, and not yet that this is over.
  [[nodiscard]] bool is_active(std::size_t i) const noexcept { return claim_[i] != Claim::kNone; }

 private:
  static constexpr std::size_t kWaiting = 128;

  /// What was said of a rotor's excess.
  enum class Claim : std::uint8_t {
    kNone,
    kCarried,  ///< in an earlier flight
    kFound,    ///< in this one
  };

  void watch_reports(TimePoint time) noexcept;
  [[nodiscard]] bool is_reported_often(TimePoint time) const noexcept;
  std::optional<Excess> process(const SlowSample& sample) noexcept;
  void begin(const SlowSample& sample) noexcept;
  void step(const SlowSample& sample, double dt_s) noexcept;
  std::optional<Excess> judge(const SlowSample& sample) noexcept;
  [[nodiscard]] Excess excess_of(std::size_t rotor, const SlowSample& sample) const noexcept;
  [[nodiscard]] double best_other(std::size_t rotor) const noexcept;
  [[nodiscard]] bool is_excess(std::size_t rotor) const noexcept;
  std::optional<Excess> accuse(const SlowSample& sample) noexcept;
  std::optional<Excess> clear(const SlowSample& sample) noexcept;
  std::optional<Excess> follow(const SlowSample& sample) noexcept;
  void judge_spin() noexcept;

  SlowEvidenceParams params_;
  std::size_t n_;
  RotorSpeedPredictor<double> speeds_;  ///< of telemetry alone
  ThrustRegression<double> thrust_;
  SpinRegression<double> spin_;
  std::array<std::array<double, 2>, kMaxRotors> inflow_per_rate_{};
  std::array<double, kMaxRotors> vertical_at_imu_{};
  std::array<double, kMaxRotors> believed_{};
  std::array<double, kMaxRotors> before_{};
  std::array<ThrustRegression<double>::Deviation, kMaxRotors> deviation_{};
  double excess_threshold_ = 0.0;
  double spin_threshold_ = 0.0;

  std::array<SlowSample, kWaiting> waiting_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::optional<TimePoint> last_;
  std::array<std::optional<TimePoint>, kMaxRotors> reported_at_{};
  std::array<double, kMaxRotors> report_interval_s_{};  ///< running mean; 0: not known yet
  std::optional<TimePoint> doubtful_until_;
  TimePoint since_{};
  double age_s_ = 0.0;  ///< since the last look
  bool starts_over_ = true;
  bool is_running_ = false;
  std::array<Claim, kMaxRotors> claim_{};
  std::array<std::optional<TimePoint>, kMaxRotors> healthy_since_{};
  std::array<std::optional<TimePoint>, kMaxRotors> excess_since_{};
  std::size_t followed_ = 0;  ///< the rotor of the last update
  std::optional<std::uint32_t> wrong_spin_;
  bool spin_is_named_ = false;
  double spin_evidence_ = 0.0;
};

}  // namespace airworthy::effectiveness
