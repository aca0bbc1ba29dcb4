#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/detectors/effectiveness/effectiveness_monitor.h"
#include "runtime/error.h"
#include "services/effectiveness/effectiveness_config.h"

namespace airworthy::testing {

inline constexpr Duration kScaledOutSpacing{1'000'000};  ///< of the onsets
inline constexpr Duration kScaledOutJudged{
    500'000};  ///< after an onset; see ScaledOutRotor for why no longer
inline constexpr std::array kScaledOutLosses{0.2, 0.3, 0.4, 0.6, 1.0};

struct ScaledOutcome {
  double onset_s = 0.0;  ///< since the flight's first message; of the first inertial sample that is changed
  std::size_t rotor = 0;
  double loss = 0.0;
  std::optional<effectiveness::LossEvent> found;  ///< first alarm within kScaledOutJudged
  double delay_s = 0.0;
};

struct ScaledOutFlight {
  std::vector<ScaledOutcome> outcomes;
  double judged_s = 0.0;   ///< of the flight as it was
  int healthy_alarms = 0;  ///< in it
  int muted_onsets = 0;    ///< left out, as nothing was judged then
};

/// For evidence only: a recorded healthy flight with each rotor's contribution scaled out in turn, from an onset every
/// second on, by each of kScaledOutLosses. `judging` is calibrated on other flights, `truth` is what is scaled out.
[[nodiscard]] rt::Expected<ScaledOutFlight> scale_out(const std::string& log,
                                                      const effectiveness::EffectivenessConfig& judging,
                                                      const effectiveness::EffectivenessConfig& truth);

}  // namespace airworthy::testing
