#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>

#include "core/time/stamp_gate.h"
#include "core/time/time.h"
#include "core/vehicle/multirotor.h"

namespace airworthy {

enum class Phase : std::uint8_t {
  kUnknown,   ///< nothing to judge by yet
  kOnGround,  ///< something else than the rotors carries the vehicle, and it is still
  kTakeOff,   ///< the rotors lift, airborne or about to be
  kInFlight,  ///< only air and rotors act on the vehicle
  kLanding,   ///< announced, or touching the ground while the rotors still lift
  kContact,   ///< forces that neither rotors nor air explain: impact, tumbling, a hand
};
inline constexpr std::size_t kPhaseCount = 6;

[[nodiscard]] std::string_view name_of(Phase phase) noexcept;

/// The autopilot's own opinion, as in FLIGHT_STATE.
enum class LandedReport : std::uint8_t { kUnknown, kOnGround, kInAir, kTakingOff, kLanding };

/// Where a multirotor is in its flight, for detectors that must not judge on the ground.
///
/// What tells flight from ground is who carries the vehicle. An accelerometer feels every force but weight: in the
/// air that is the thrust (and drag), on the ground also the ground's:
///   f  = c·Σωᵢ²                 thrust over mass from rotor speeds, or from commands without them          (1)
///   r  = a − f·z_up             specific force that the rotors do not explain                              (2)
///   c ← c + (a_up/Σω² − c)/n    learned in flight; starts from κ/m of the vehicle file                     (3)
///   v  = ∫(a_up − g₀) dt        speed gained since the thrust rose, g₀ = a_up while standing; in a landing
///                               f instead of a_up, so that the ground's push does not count              (4)
/// (2) compares a of 25 ms ago with the range f had within 80 ms, so that late telemetry is no force. (4) is what a vehicle that leaves
/// the ground cannot avoid, and one that stays cannot show; it needs no knowledge of the mass.
///
///   from        to         when                                                                 order = priority
///   any         Contact    |r| > 2 g + Ω²·5 cm, or |r| > 0.7 g while thrust is low and it moves
///   any         OnGround   |r| > 0.4 g, f < 0.4 g, still, for 0.25 s
///   Unknown     InFlight   |r_up| < 0.3 g, f > 0.6 g for 2 s, 0.25 s if reported in the air; or as TakeOff
///   OnGround    TakeOff    f > 0.35 g, or in the air by (4) or free fall
///   TakeOff     InFlight   v > 0.4 m/s and |r_up| < 0.35 g; reported climb > 0.5 m/s; for 0.1 s
///   TakeOff     Unknown    0.5 s of it without samples, or without knowing the thrust
///   Contact     InFlight   free fall for 0.1 s
///   Contact     Landing    |r| < 0.35 g for 0.5 s, with thrust
///   InFlight    Landing    touch-down: r_up rises by > 0.35 g within 0.3 s; r_up > 0.3 g; reported landing
///   Landing     InFlight   v > 0.4 m/s again, or 1.5 s without a sign of the ground, unless landing is reported
/// Without any knowledge of the thrust for 0.5 s the autopilot's report is followed, and Unknown without it. Begun on
/// the ground with rotors that give more than 0.7 g, it takes 2 s of that for flight: nothing else tells them apart.
///
/// Operating point (tests/sim/flight_phase_test.cpp, hard realism): 100 landings and take-offs of six vehicles,
/// with and without reports.
/// Inputs: accelerometer at >= 50 Hz; rotor speeds or commands at >= 10 Hz, at most 60 ms late.
class FlightPhase {
 public:
  explicit FlightPhase(const Multirotor& vehicle) noexcept;

  /// Body frame FRD. Times must not go back; one that does is ignored and counted, unless StampGate finds that the newest
  /// was wrong: then the phase goes on from there as after a gap. So it is with each source of the thrust.
  void on_imu(TimePoint time, const std::array<double, 3>& accel_m_s2,
              const std::array<double, 3>& gyro_rad_s) noexcept;
  /// NaN = this rotor did not report.
  void on_rotor_speeds(TimePoint time, std::span<const double> speed_rad_s) noexcept;
  void on_rotor_commands(TimePoint time, std::span<const double> command_ratio) noexcept;
  /// Climb positive up; NaN = not known.
  void on_report(TimePoint time, LandedReport landed, double climb_m_s) noexcept;

  [[nodiscard]] Phase phase() const noexcept { return phase_; }
  [[nodiscard]] TimePoint since() const noexcept { return since_; }
  /// Thrust over mass by (1), NaN if unknown. m/s².
  [[nodiscard]] double thrust_m_s2() const noexcept;
  /// Upward part of (2), smoothed. m/s².
  [[nodiscard]] double unexplained_m_s2() const noexcept { return unexplained_up_.value; }
  /// c of (3) for the source in use. m/s² per (rad/s)².
  [[nodiscard]] double thrust_scale() const noexcept { return scale_[source_].value; }
  [[nodiscard]] std::int64_t times_gone_back() const noexcept { return times_gone_back_; }
  /// How often the newest stamp turned out to have been wrong.
  [[nodiscard]] std::int64_t restarts() const noexcept {
    return stamps_.restarts() + thrust_stamps_[kSpeeds].restarts() + thrust_stamps_[kCommands].restarts();
  }

 private:
  // A first-order low-pass that starts at its first input.
  struct Smooth {
    double value = 0.0;
    bool has_value = false;
    void step(double input, double share) noexcept {
      value = has_value ? value + share * (input - value) : input;
      has_value = true;
    }
  };
  struct Scale {
    double value = 0.0;
    double seconds = 0.0;  ///< learned so far
  };
  enum Source : std::uint8_t { kSpeeds, kCommands };
  // How long a condition has held.
  class Held {
   public:
    [[nodiscard]] bool for_s(bool holds, double dt_s, double seconds) noexcept {
      seconds_ = holds ? seconds_ + dt_s : 0.0;
      return holds && seconds_ >= seconds;
    }
    void reset() noexcept { seconds_ = 0.0; }

   private:
    double seconds_ = 0.0;
  };

  void note_thrust(TimePoint time, Source source, double sum_speed2) noexcept;
  void choose_source(TimePoint now) noexcept;
  void observe(double dt_s, const std::array<double, 3>& accel, const std::array<double, 3>& gyro) noexcept;
  void learn(double dt_s) noexcept;
  /// By (4), or by the reported climb.
  [[nodiscard]] bool has_left_the_ground(double dt_s) noexcept;
  [[nodiscard]] Phase next(double dt_s) noexcept;
  [[nodiscard]] Phase by_report() const noexcept;
  void compare() noexcept;
  [[nodiscard]] double excess_over_recent_thrust(double up_m_s2) const noexcept;

  // What was felt and what the rotors gave, one every 5 ms.
  struct Moment {
    double thrust_m_s2;
    std::array<double, 3> accel_fast_m_s2;
    double up_m_s2;
  };
  static constexpr std::size_t kHistory = 16;

  Multirotor vehicle_;
  Phase phase_ = Phase::kUnknown;
  TimePoint since_{};
  StampGate stamps_;
  TimePoint now_{};
  bool has_time_ = false;
  std::int64_t times_gone_back_ = 0;

  std::array<Scale, 2> scale_{};
  std::array<double, 2> sum_speed2_{};
  std::array<StampGate, 2> thrust_stamps_{};
  std::array<double, kMaxRotors> last_speed_rad_s_{};
  Source source_ = kSpeeds;
  bool has_thrust_ = false;
  std::array<Moment, kHistory> history_{};
  std::size_t history_size_ = 0;
  std::size_t history_next_ = 0;
  double history_age_s_ = 0.0;

  LandedReport report_ = LandedReport::kUnknown;
  double climb_m_s_ = std::numeric_limits<double>::quiet_NaN();
  std::optional<TimePoint> last_report_;

  std::array<Smooth, 3> accel_fast_{};  ///< 15 ms: impacts
  Smooth up_;                           ///< 50 ms
  Smooth unexplained_up_;               ///< 50 ms, signed, zero while within the recent thrust
  Smooth unexplained_slow_;             ///< 300 ms
  Smooth rates_;                        ///< |Ω|, 50 ms
  Smooth roughness_m_s2_;               ///< |a − slow a|, 100 ms
  std::array<Smooth, 3> accel_slow_{};
  Smooth standing_up_m_s2_;        ///< g₀ of (4)
  double unexplained_m_s2_ = 0.0;  ///< |r|, fast
  double unexplained_fast_up_m_s2_ = 0.0;
  double speed_gained_m_s_ = 0.0;  ///< v of (4)

  Held still_;
  Held airborne_;
  Held carried_;
  Held falling_;
  Held free_;
  Held calm_;
  Held supported_;
};

}  // namespace airworthy
