#pragma once

#include <string>
#include <vector>

#include "gateway/health/health_config.h"
#include "gateway/health/health_snapshot.h"

namespace airworthy::health {

/// What explains the rest.
struct RootCause {
  enum class Kind {
    kNone,
    kFault,       ///< a component of the vehicle
    kLoss,        ///< a link or process that fails: health is not fully monitored
    kImpairment,  ///< a process that says of itself that it is degraded
    kAbsence      ///< a process that was stopped or never came
  };
  Kind kind{Kind::kNone};
  std::string name;
};

/// The worst fault, then the earliest, unless a lost link or process explains it: its detector is fed by what
/// was lost and it began within `implied_window` of the loss. An advisory yields to a loss in any case, for a
/// loss hides what is worse. Among losses the earliest is the cause of the later ones.
[[nodiscard]] RootCause find_root_cause(const HealthConfig& config, const HealthSnapshot& snapshot,
                                        bool start_grace_is_over);

}  // namespace airworthy::health
