#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "runtime/config/vehicle.h"
#include "sim/config/realism.h"
#include "sim/config/scenario.h"

namespace airworthy::sim_command {

/// What to simulate.
struct Flight {
  rt::VehicleFile vehicle;
  sim::Scenario scenario;
  sim::Realism realism;
  std::uint64_t seed = 1;
  double duration_s = 0.0;
};

}  // namespace airworthy::sim_command
