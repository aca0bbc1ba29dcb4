#pragma once

#include "cli/import/feed.h"
#include "cli/import/table_map.h"

namespace airworthy::importer {

/// Everything that the map knows of what really happened in a recording.
[[nodiscard]] rt::Expected<std::vector<Truth>> read_truth(const std::filesystem::path& input,
                                                          const ImportMap& map);

}  // namespace airworthy::importer
