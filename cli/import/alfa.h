#pragma once

#include <filesystem>
#include <string>

#include "cli/import/feed.h"

namespace airworthy::importer {

/// Imports one sequence of the ALFA data set (Keipour, Mousaei, Scherer, IJRR 2021), a folder with one table
/// (`<topic>.csv` or `<topic>.csv.xz`) for each ROS topic, into `log_path`. Units, axes and what is left out
/// on purpose: docs/import.md.
[[nodiscard]] rt::Expected<LogSummary> import_alfa(const std::filesystem::path& folder,
                                                   const std::filesystem::path& log_path,
                                                   const std::string& vehicle, const Progress& progress);

/// Name of the sequence: the last part of the folder's path.
[[nodiscard]] std::string sequence_name(const std::filesystem::path& folder);

}  // namespace airworthy::importer
