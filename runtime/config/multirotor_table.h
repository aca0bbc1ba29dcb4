#pragma once

#include "core/vehicle/multirotor.h"
#include "runtime/config/config_file.h"

namespace airworthy::rt {

/// Reads the table [multirotor] of a vehicle file; every key is explained in docs/vehicle.md.
[[nodiscard]] Multirotor read_multirotor(ConfigTable table);

}  // namespace airworthy::rt
