#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "runtime/error.h"

namespace airworthy::sim {

enum class Manoeuvre { kGround, kTakeOff, kHover, kCircle, kRandom, kLand };

/// One part of the flight plan. What a manoeuvre does not use keeps its default.
struct Segment {
  Manoeuvre manoeuvre = Manoeuvre::kHover;
  double duration_s = 10.0;
  double height_m = 2.0;    ///< take_off: above the ground
  double speed_m_s = 1.0;   ///< take_off and land: vertical; circle: along it; random: at most
  double radius_m = 1.0;    ///< circle
  double box_m = 1.0;       ///< random: set-points within ± this horizontally, half of it vertically
  double interval_s = 3.0;  ///< random: between two set-points
};

enum class FaultKind {
  kUnbalance,
  kPropellerLost,
  kPartialLoss,
  kStuckCommand,
  kDeadEsc,
  kDesync,
  kTelemetryFrozen,
  kTelemetryWrongUnit,
  kLinkLoss,
  kGyroBias,
  kGyroDrift,
  kGyroSpike,
  kGyroFreeze,
  kAccelBias,
  kAccelDrift,
  kAccelSpike,
  kAccelFreeze,
};

/// The word of a kind in scenario files and in GROUND_TRUTH.
[[nodiscard]] std::string_view word_of(FaultKind kind);
/// Whether a kind has a magnitude at its onset.
[[nodiscard]] bool has_magnitude(FaultKind kind);

enum class Link { kNone, kEsc, kAutopilot };

/// One fault; docs/simulator.md says what each kind does.
struct Fault {
  FaultKind kind = FaultKind::kPartialLoss;
  double onset_s = 0.0;
  double end_s = std::numeric_limits<double>::infinity();
  std::size_t rotor = 0;   ///< 1-based; 0 = not a fault of a rotor
  int axis = 0;            ///< of a sensor: 0 x, 1 y, 2 z; a frozen one is so in all
  double magnitude = 0.0;  ///< in the unit of its kind
  double growth_per_s = 0.0;
  /// Of an unbalance, from the propeller's natural one in its sense of rotation; empty: drawn from the vehicle seed.
  std::optional<double> angle_rad{};
  Link link = Link::kNone;

  [[nodiscard]] bool is_active(double time_s) const { return time_s >= onset_s && time_s < end_s; }
  /// `magnitude` grown since the onset.
  [[nodiscard]] double magnitude_at(double time_s) const {
    return magnitude + growth_per_s * (time_s - onset_s);
  }
  /// As in GROUND_TRUTH: "rotor 3", "imu", "link esc".
  [[nodiscard]] std::string component() const;
};

/// A flight plan and what breaks in it.
struct Scenario {
  std::string description;
  bool repeats = false;  ///< the plan starts over when it ends
  std::vector<Segment> segments;
  std::vector<Fault> faults;

  [[nodiscard]] double duration_s() const;
  /// `rotor_count` bounds the rotors that faults may name.
  [[nodiscard]] static rt::Expected<Scenario> load(const std::filesystem::path& path, std::size_t rotor_count,
                                                   const std::vector<std::string>& overrides = {});
};

}  // namespace airworthy::sim
