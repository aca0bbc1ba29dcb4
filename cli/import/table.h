#pragma once

#include "cli/import/feed.h"
#include "cli/import/table_map.h"

namespace airworthy::importer {

/// Which part of a recording is imported, in vehicle time; its ends belong to it.
struct Window {
  std::optional<TimePoint> from;
  std::optional<TimePoint> until;
};

/// Imports a table, or a folder of tables, by a map.
[[nodiscard]] rt::Expected<LogSummary> import_table(const std::filesystem::path& input, const ImportMap& map,
                                                    const Window& window, const std::string& vehicle,
                                                    const std::filesystem::path& log_path,
                                                    const Progress& progress);

}  // namespace airworthy::importer
