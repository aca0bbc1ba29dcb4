#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/time/time.h"
#include "runtime/error.h"
#include "services/effectiveness/calibration.h"
#include "services/effectiveness/effectiveness_config.h"

namespace airworthy::calibrate {

/// What was logged of one healthy flight, or of the part before its fault; inertial samples of free flight only.
struct EffectivenessRecording {
  struct Inertial {
    TimePoint time;
    std::array<double, 3> accel_m_s2;
    std::array<double, 3> gyro_rad_s;
  };
  struct PerRotor {
    TimePoint time;
    std::array<double, kMaxRotors> value;  ///< NaN = not in this message
  };
  std::string log;
  std::vector<Inertial> in_flight;
  double after_onset_s = 0.0;      ///< of free flight that was left out, for something was broken then
  std::vector<PerRotor> speeds;    ///< rad/s
  std::vector<PerRotor> commands;  ///< 0 to 1
};

/// Less of free flight says too little.
inline constexpr double kLeastFlight_s = 8.0;

/// Standard error of a gain that is only described.
inline constexpr double kDescribedSigma = 0.2;

/// How much later than the rotor speeds the inertial data of a flight are stamped, where a link stamps on arrival: of
/// 0, 2.5, … 60 ms the delay for which the described rows explain most of roll and pitch. Refuses a flight without rotor
/// speeds, and 60 ms: it may be more.
[[nodiscard]] rt::Expected<Duration> inertial_delay_of(const EffectivenessRecording& flight,
                                                       const effectiveness::EffectivenessParams& params);

/// Learns how a vehicle answers to its rotors.
///   Telemetry latency  of 0, 2, … 40 ms the one for which the described rows explain most of roll and pitch     (1)
///   Gain of an axis    g of ControlRegression with intervals of 1, 2 or 4 times max(50 ms, 2τ), whichever is surest, all flights together; standard
///                      error by leaving out one block of 5 s at a time (jackknife)                          (2)
///   Motor              first-order lag and delay from commands to reported speeds with the least squared
///                      difference over a grid, each rotor with its own scale; the delay beyond (1) is that of the
///                      commands                                                                         (3)
///   Without reports    if no flight has rotor speeds: lag and delay from the same grid for which the commands explain most
///                      of roll and pitch; the speed that a command gives is that of the vehicle file, and what is
///                      wrong with it goes into the gains; less than 40 commands a second are refused          (6)
///   Noise              what the detector's own variances settle at with (1) to (3)                          (4)
///   Edges              a best value at the edge of its grid (but for no latency and no delay) is refused: it may lie
///                      beyond                                                                            (7)
///   Smallest loss      s with s²·b/2 = h, b the information that one second of hover gives about a rotor         (5)
/// Inertial samples that are not finite are left out. Refuses, naming it, an axis that was not excited: the rotors explain
/// less than a tenth of its changes, or its gain stays uncertain by more than 15 % (standard error). With `keeps_unexcited`
/// such an axis keeps the described gain with kDescribedSigma, and is marked as not excited; one axis at least must have
/// been excited.
[[nodiscard]] rt::Expected<effectiveness::Calibration> learn_effectiveness(
    const std::vector<EffectivenessRecording>& flights, const effectiveness::EffectivenessConfig& config,
    bool keeps_unexcited = false);

/// Reads logs, several at a time. Refuses those of other vehicles.
[[nodiscard]] rt::Expected<std::vector<EffectivenessRecording>> read_effectiveness_recordings(
    const std::vector<std::string>& logs, const effectiveness::EffectivenessConfig& config, unsigned jobs);

}  // namespace airworthy::calibrate
