#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/detectors/effectiveness/effectiveness_monitor.h"
#include "core/estimators/effectiveness/loss_of_effectiveness_filter.h"
#include "core/vehicle/multirotor.h"
#include "sim/config/realism.h"
#include "sim/config/scenario.h"

namespace airworthy::sim {

/// What happens to the messages on their way.
enum class Mischief {
  kNone,
  kDuplicates,  ///< everything arrives twice
  kGaps,        ///< every second, nothing for 50 ms
  kSpikes,      ///< one rotor speed in twenty is any number
};

/// One simulated flight for the detectors of lost effectiveness.
struct EffectivenessFlight {
  Multirotor vehicle;
  Manoeuvre manoeuvre = Manoeuvre::kHover;
  Realism realism;
  std::optional<Fault> fault;
  double duration_s = 12.0;  ///< ends earlier once the fault is found by all
  double give_up_s = 1.0;    ///< after the onset
  int cycles = 1;            ///< take-offs and landings, healthy flights only
  Mischief mischief = Mischief::kNone;
  double telemetry_until_s = std::numeric_limits<double>::infinity();  ///< then no rotor reports any more
  std::uint64_t seed = 1;
};

/// What a detector said.
struct Said {
  std::size_t rotor = 0;
  double time_s = 0.0;  ///< when it could be known: on the arrival of the message that decided
  double effectiveness = 0.0;
  double sigma = 0.0;
  effectiveness::LossKind kind = effectiveness::LossKind::kPropellerLost;
  effectiveness::LossEvent event;
};

struct EffectivenessOutcome {
  std::vector<Said> ours;
  std::vector<Said> faithful;
  std::optional<double> clairvoyant_s;  ///< a cumulative sum that knows rotor and size
  double flown_s = 0.0;                 ///< off the ground
  double lift_off_s = 0.0;              ///< first time off the ground
  double judged_s = 0.0;                ///< of that, not muted
  int take_offs = 0;
  bool was_judging = false;  ///< at the onset
  std::int64_t unexplained = 0;
  std::optional<std::uint32_t> wrong_spin;  ///< bit i: rotor i seems to turn the other way than described
  bool is_spin_named = false;
  double wrong_spin_s = 0.0;                                          ///< when that was known
  double spin_evidence = 0.0;                                         ///< at the end, nats
  effectiveness::Muted muted = effectiveness::Muted::kNot;            ///< at the end
  effectiveness::Muted muted_in_flight = effectiveness::Muted::kNot;  ///< last reason but the phase's
};

/// The nominal configuration of the detector for a vehicle file: nothing is known of what really flies.
[[nodiscard]] effectiveness::EffectivenessParams effectiveness_params(const Multirotor& vehicle);

[[nodiscard]] EffectivenessOutcome fly(const EffectivenessFlight& flight,
                                       const effectiveness::EffectivenessParams& params);

}  // namespace airworthy::sim
