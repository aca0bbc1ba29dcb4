#pragma once

#include <cstdint>

#include "core/detectors/flight_phase.h"

namespace airworthy::rt {

/// The `landed_state` of FLIGHT_STATE, which has the values of MAVLink's MAV_LANDED_STATE; any other is unknown.
inline LandedReport landed_report(std::int8_t landed_state) {
  switch (landed_state) {
    case 1:
      return LandedReport::kOnGround;
    case 2:
      return LandedReport::kInAir;
    case 3:
      return LandedReport::kTakingOff;
    case 4:
      return LandedReport::kLanding;
    default:
      return LandedReport::kUnknown;
  }
}

}  // namespace airworthy::rt
