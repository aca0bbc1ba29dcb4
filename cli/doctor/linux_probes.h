#pragma once

#include <string>

#include "cli/doctor/probes.h"

namespace airworthy::doctor {

/// Observes this computer. Needs no privilege, changes nothing, takes less than two seconds; sends a few
/// datagrams to the bus's group on a port of its own, which no other program listens to.
[[nodiscard]] Probes probe_this_computer(const BusAddress& address, const std::string& log_directory);

}  // namespace airworthy::doctor
