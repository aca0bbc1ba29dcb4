#pragma once

#include <cstdint>
#include <filesystem>

#include "cli/sim/flight.h"
#include "cli/sim/record.h"
#include "runtime/error.h"

namespace airworthy::sim_command {

struct LiveFlight {
  std::int64_t start_boottime_us = 0;  ///< CLOCK_BOOTTIME at time 0 of the flight
  double flown_s = 0.0;
  std::int64_t writes_dropped = 0;  ///< frames that nobody read
  double most_behind_s = 0.0;       ///< how late the simulation was at worst
};

/// Flies at `speed` times the pace of the clock, as a flight controller on the serial line `link`.
[[nodiscard]] rt::Expected<LiveFlight> fly_live(const Flight& flight, const std::filesystem::path& link,
                                                double speed, const Progress& progress);

}  // namespace airworthy::sim_command
