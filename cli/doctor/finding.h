#pragma once

#include <string>

namespace airworthy::doctor {

enum class Level {
  kOk,
  kWarning,  ///< works, but not under every circumstance
  kFailure,  ///< keeps the system from working
  kUnknown,  ///< could not be observed
};

/// The result of one check, in words for the person who sets up the vehicle.
struct Finding {
  std::string id;  ///< stable, for scripts: "multicast.route"
  Level level;
  std::string found;      ///< what is the case
  std::string why;        ///< what it does to the system; empty when ok
  std::string cure;       ///< command to run as root that mends it until the next start; may be empty
  std::string permanent;  ///< how to keep it mended; may be empty
};

}  // namespace airworthy::doctor
