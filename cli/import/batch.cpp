#include "cli/import/batch.h"

#include <fmt/format.h>

#include <set>

namespace airworthy::importer {

rt::Expected<std::vector<LogSummary>> import_batch(const std::vector<BatchItem>& items,
                                                   const std::filesystem::path& folder,
                                                   const ImportOne& import_one) {
  std::set<std::string> names;
  for (const BatchItem& item : items) {
    if (!names.insert(item.name).second) {
      return rt::fail_with(
          fmt::format("{}: another input has the same name, and so the same log", item.input.string()));
    }
  }
  std::error_code error;
  const bool is_new_folder = std::filesystem::create_directories(folder, error);
  if (error) return rt::fail_with(fmt::format("{}: {}", folder.string(), error.message()));

  ProgressLine line;
  std::vector<LogSummary> logs;
  for (std::size_t i = 0; i < items.size(); ++i) {
    auto log = import_one(items[i].input, folder / (items[i].name + ".lcm"),
                          line.of(items[i].name, i, items.size()));
    if (!log) {
      // Only an empty folder can be removed this way.
      if (is_new_folder) std::filesystem::remove(folder, error);
      return tl::unexpected<rt::Error>{log.error()};
    }
    logs.push_back(std::move(*log));
  }
  return logs;
}

}  // namespace airworthy::importer
