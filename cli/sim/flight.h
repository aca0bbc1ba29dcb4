#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "runtime/config/vehicle.h"
#include "sim/config/realism.h"
#include "sim/config/scenario.h"
#include "sim/simulation.h"

namespace airworthy::sim_command {

/// What to simulate.
struct Flight {
  rt::VehicleFile vehicle;
  sim::Scenario scenario;
  sim::Realism realism;
  sim::Seeds seeds{1};
  double duration_s = 0.0;
};

}  // namespace airworthy::sim_command
