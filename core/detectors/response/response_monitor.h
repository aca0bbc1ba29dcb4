#pragma once

#include <array>
#include <limits>
#include <span>

#include "core/detectors/detector_state.h"
#include "core/detectors/flight_phase.h"
#include "core/detectors/response/arx_channel.h"
#include "core/detectors/response/response_channel.h"
#include "core/estimators/attitude_propagator.h"

namespace airworthy::response {

/// How a channel expects its response.
enum class Method : std::uint8_t { kRegression, kArx };

/// Whose samples set the pace of the ticks.
enum class Pace : std::uint8_t {
  kInertial,  ///< the inertial unit's, averaged over a tick
  kAttitude,  ///< the measured attitude's, for links that carry hardly any inertial data: roll rate and pitch
              ///< rate are then differences of angles, and accelerations are unknown
};

struct MonitorParams {
  Pace pace = Pace::kInertial;
  Duration tick_period{100'000};
  Duration longest_gap{1'000'000};    ///< a longer silence of what sets the pace restarts all delays
  Duration input_timeout{2'000'000};  ///< attitude, set-point and flight state older than this are unknown
  double min_groundspeed_m_s = 0;     ///< slower is not flying; 0 = not asked
  bool needs_flight_phase = false;    ///< a multirotor: judges only while on_phase() says in flight
  int channel_count = 0;
  std::array<ChannelParams, kMostChannels> channels{};
  std::array<Method, kMostChannels> methods{};
  std::array<ArxParams, kMostChannels> arx{};  ///< beside life cycle and warm-up of channels[i]
  int configuration_count = 0;                 ///< 0: a cold start, everything is learned in this flight
  std::array<VehicleConfiguration, kMostConfigurations> configurations{};
  Duration configuration_after{1'000'000};  ///< so much flight tells which configuration this is
  double airspeed_sensor_above_m_s = 3.0;   ///< an airspeed sensor that works reads more than this in flight
};

enum class Muted : std::uint8_t {
  kNo,
  kNotFlying,    ///< disarmed, reported on the ground, or too slow
  kNotInFlight,  ///< by the flight phase
  kInputStale,
};

struct ImuSample {
  TimePoint time;
  std::array<double, 3> accel_m_s2{};
  std::array<double, 3> gyro_rad_s{};
};

/// NaN where not known.
struct FlightState {
  TimePoint time;
  double airspeed_m_s;
  double groundspeed_m_s;
  double climb_m_s;
  double altitude_error_m;
  double airspeed_error_m_s;
  int armed;         ///< 1, 0, -1 unknown
  int landed_state;  ///< 1 = on ground, -1 unknown
};

/// All response channels of a vehicle on one stream of samples. Times come from the messages alone, so that
/// the same stream gives the same verdicts, live or replayed. Inputs may come in any mix of rates; the
/// inertial samples set the pace. Every sample must be finite and newer than the last of its kind; others are
/// refused and change nothing.
class ResponseMonitor {
 public:
  explicit ResponseMonitor(const MonitorParams& params) noexcept;

  /// True if the sample completed a tick: verdicts() are then new.
  [[nodiscard]] bool on_imu(const ImuSample& sample) noexcept;
  /// The same where the attitude sets the pace.
  bool on_attitude(TimePoint time, double roll_rad, double pitch_rad) noexcept;
  /// `thrust_ratio` may be NaN: not known.
  void on_attitude_setpoint(TimePoint time, double roll_rad, double pitch_rad,
                            double thrust_ratio = std::numeric_limits<double>::quiet_NaN()) noexcept;
  /// Normalised commands of the actuators, NaN where this message has none; those beyond kMostCommands are
  /// not used.
  void on_rotor_command(TimePoint time, std::span<const double> command_ratio) noexcept;
  void on_flight_state(const FlightState& state) noexcept;

  /// The flight phase at the next sample of what sets the pace, with `needs_flight_phase`. A tick during any part of
  /// which it was not in flight is not judged.
  void on_phase(Phase phase) noexcept;

  /// Judges silence, on the gateway's clock: with no sample of what sets the pace for `longest_gap` the monitor is muted.
  /// Evidence is not touched, so the verdicts never depend on how ticks and samples interleave.
  void on_clock(TimePoint now) noexcept;

  [[nodiscard]] DetectorState state() const noexcept;
  [[nodiscard]] Muted muted() const noexcept { return silent_ ? Muted::kInputStale : muted_; }
  /// The phase for which the newest tick was muted.
  [[nodiscard]] Phase muted_phase() const noexcept { return muted_phase_; }
  [[nodiscard]] TimePoint tick_time() const noexcept { return tick_time_; }
  [[nodiscard]] std::span<const ChannelVerdict> verdicts() const noexcept {
    return {verdicts_.data(), static_cast<std::size_t>(params_.channel_count)};
  }
  /// What the channels saw at the newest tick.
  [[nodiscard]] const SignalFrame& signals() const noexcept { return signals_; }
  [[nodiscard]] const ResponseChannel& channel(int index) const noexcept {
    return channels_[static_cast<std::size_t>(index)];
  }
  /// Seen in this flight; known once `configuration_after` has been flown.
  [[nodiscard]] bool airspeed_sensor() const noexcept { return airspeed_sensor_; }
  /// Priors that were refused because they do not fit their channel.
  [[nodiscard]] std::int64_t refused_priors() const noexcept { return refused_priors_; }
  [[nodiscard]] std::int64_t refused_samples() const noexcept { return refused_samples_; }
  [[nodiscard]] std::int64_t gaps() const noexcept { return gaps_; }

 private:
  struct Angles {
    TimePoint time;
    double roll_rad;
    double pitch_rad;
    bool known = false;
    double thrust_ratio = std::numeric_limits<double>::quiet_NaN();
  };
  struct Command {
    TimePoint time;
    double ratio = std::numeric_limits<double>::quiet_NaN();
  };

  void restart(TimePoint now) noexcept;
  [[nodiscard]] bool follow(TimePoint time) noexcept;
  void finish_inertial_tick(TimePoint now) noexcept;
  void finish_attitude_tick(TimePoint now) noexcept;
  void judge_tick(TimePoint now, Duration elapsed) noexcept;
  void choose_configuration() noexcept;
  void sample_arx(Samples samples, TimePoint time) noexcept;
  [[nodiscard]] SignalFrame frame(TimePoint now) const noexcept;
  [[nodiscard]] bool flying() const noexcept;
  [[nodiscard]] Muted take_muted() noexcept;

  MonitorParams params_;
  // optional<ResponseChannel> would do; default parameters make unused channels cheap instead.
  std::array<ResponseChannel, kMostChannels> channels_;
  std::array<ArxChannel, kMostChannels> arx_;
  std::array<ChannelVerdict, kMostChannels> verdicts_{};
  AttitudePropagator<double> attitude_;
  Angles measured_{};  ///< the newest measured attitude, as it came
  Angles setpoint_{};
  std::array<Command, kMostCommands> commands_{};
  FlightState flight_state_{};
  bool flight_state_known_ = false;

  bool started_ = false;
  TimePoint last_sample_;
  TimePoint tick_time_;
  Duration typical_interval_{0};
  int averaged_ = 0;
  std::array<double, 3> accel_sum_{};
  std::array<double, 3> gyro_sum_{};
  std::array<double, 3> accel_{};
  std::array<double, 3> gyro_{};
  Angles tick_attitude_{};  ///< measured at the last tick, where the attitude sets the pace
  double euler_pitch_rate_ = 0;
  SignalFrame signals_;
  Duration flown_{0};
  Phase phase_ = Phase::kUnknown;
  Phase tick_phase_ = Phase::kUnknown;  ///< in flight only if it was so since the last tick
  Phase muted_phase_ = Phase::kUnknown;
  Muted muted_ = Muted::kNo;
  bool silent_ = false;
  bool airspeed_sensor_ = false;
  bool configured_ = false;
  std::int64_t refused_priors_ = 0;
  std::int64_t refused_samples_ = 0;
  std::int64_t gaps_ = 0;
};

}  // namespace airworthy::response
