#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/import/feed.h"
#include "drivers/mavlink/mavlink_config.h"

namespace airworthy::importer {

/// What the driver's configuration file says by default, but for the link.
[[nodiscard]] drivers::MavlinkConfig default_mavlink_config();

/// Imports the telemetry log of a ground station (`.tlog` or `.tlog.xz`): every packet goes through the code
/// of airworthy-mavlink, with the time at which the ground station received it for the time of arrival.
[[nodiscard]] rt::Expected<LogSummary> import_tlog(const std::filesystem::path& file,
                                                   const std::filesystem::path& log_path,
                                                   const drivers::MavlinkConfig& config,
                                                   std::vector<Truth> truths, const Progress& progress);

/// Name of a file without .tlog and .xz.
[[nodiscard]] std::string tlog_name(const std::filesystem::path& file);

/// Truth of the flight called `sequence` in a table with columns sequence, fault and fault_onset_ns, such as
/// the index of the ALFA data set. Several faults in a cell are joined by `+`; `unknown` is no truth at all.
[[nodiscard]] rt::Expected<std::vector<Truth>> read_index(const std::filesystem::path& index,
                                                          const std::string& sequence);

}  // namespace airworthy::importer
