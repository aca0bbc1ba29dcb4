#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

namespace airworthy::response {

/// What a response channel may be built from. Body frame: x forward, y right, z down.
enum class Signal : std::uint8_t {
  kOne,
  kAccelX,
  kAccelY,
  kAccelZ,
  kRollRate,
  kPitchRate,
  kYawRate,
  kRoll,
  kPitch,
  kEulerPitchRate,
  kRollSetpoint,
  kPitchSetpoint,
  kRollError,
  kPitchError,
  kAltitudeError,
  kAirspeedError,
  kAirspeed,
  kClimb,
  kThrustSetpoint,
  kCommand0,  ///< kCommand0 + i: normalised command of actuator i, as ROTOR_COMMAND has it
  kCommand1,
  kCommand2,
  kCommand3,
  kCommand4,
  kCommand5,
  kCommand6,
  kCommand7,
};
inline constexpr int kSignals = 27;
inline constexpr int kMostCommands = 8;

/// Names as the configuration writes them, in the order of Signal.
inline constexpr std::array<std::string_view, kSignals> kSignalNames{"one",
                                                                     "accel_x_m_s2",
                                                                     "accel_y_m_s2",
                                                                     "accel_z_m_s2",
                                                                     "roll_rate_rad_s",
                                                                     "pitch_rate_rad_s",
                                                                     "yaw_rate_rad_s",
                                                                     "roll_rad",
                                                                     "pitch_rad",
                                                                     "euler_pitch_rate_rad_s",
                                                                     "roll_setpoint_rad",
                                                                     "pitch_setpoint_rad",
                                                                     "roll_error_rad",
                                                                     "pitch_error_rad",
                                                                     "altitude_error_m",
                                                                     "airspeed_error_m_s",
                                                                     "airspeed_m_s",
                                                                     "climb_m_s",
                                                                     "thrust_setpoint_ratio",
                                                                     "command_0_ratio",
                                                                     "command_1_ratio",
                                                                     "command_2_ratio",
                                                                     "command_3_ratio",
                                                                     "command_4_ratio",
                                                                     "command_5_ratio",
                                                                     "command_6_ratio",
                                                                     "command_7_ratio"};

[[nodiscard]] constexpr std::string_view to_string(Signal signal) {
  return kSignalNames[static_cast<std::size_t>(signal)];
}

/// Applied to a signal's value before delay and difference.
enum class Transform : std::uint8_t { kNone, kSine, kAbsoluteSine, kLoadFactor };

/// One regressor: transform, then low-pass, then delay, minus the same at a second delay where one is given.
struct Term {
  Signal signal = Signal::kOne;
  Transform transform = Transform::kNone;
  double lowpass_s = 0;  ///< time constant; 0 = none
  int delay_ticks = 0;
  std::optional<int> minus_delay_ticks;
};

/// The values of all signals at one tick; NaN where not known.
class SignalFrame {
 public:
  [[nodiscard]] double operator[](Signal signal) const { return values_[static_cast<std::size_t>(signal)]; }
  double& operator[](Signal signal) { return values_[static_cast<std::size_t>(signal)]; }

 private:
  std::array<double, kSignals> values_ = [] {
    std::array<double, kSignals> unknown{};
    unknown.fill(std::numeric_limits<double>::quiet_NaN());
    unknown[0] = 1.0;
    return unknown;
  }();
};

[[nodiscard]] inline double apply(Transform transform, double value) {
  switch (transform) {
    case Transform::kNone:
      return value;
    case Transform::kSine:
      return std::sin(value);
    case Transform::kAbsoluteSine:
      return std::abs(std::sin(value));
    case Transform::kLoadFactor: {  // 1/cos² of the bank angle: induced drag of a coordinated turn, held at
                                    // ±1.2 rad
      const double cosine = std::cos(std::fmin(std::fmax(value, -1.2), 1.2));
      return 1.0 / (cosine * cosine);
    }
  }
  return value;
}

}  // namespace airworthy::response
