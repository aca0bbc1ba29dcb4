#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "cli/sim/flight.h"
#include "runtime/error.h"

namespace airworthy::sim_command {

/// What a recorded flight became.
struct Recording {
  std::map<std::string, std::int64_t> messages;  ///< by channel
  bool stopped = false;                          ///< by the user; there is no log then
};

/// Told now and then how far it is; ends the simulation by returning false.
using Progress = std::function<bool(double time_s)>;

/// Flies as fast as the computer can and writes the log as a whole or not at all.
[[nodiscard]] rt::Expected<Recording> record(const Flight& flight, const std::filesystem::path& log,
                                             const Progress& progress);

}  // namespace airworthy::sim_command
