#pragma once

#include <cstdint>

namespace airworthy {

/// What a detector is doing, as in DETECTOR_STATUS.
enum class DetectorState : std::int8_t {
  kInitialising,  ///< its input has not come yet
  kConverging,    ///< learning, cannot judge yet
  kMonitoring,
  kMuted,  ///< must not judge now
};

}  // namespace airworthy
