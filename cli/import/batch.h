#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "cli/import/progress.h"

namespace airworthy::importer {

/// One input of a batch: where it comes from and what its log is called, without ".lcm".
struct BatchItem {
  std::filesystem::path input;
  std::string name;
};

using ImportOne = std::function<rt::Expected<LogSummary>(
    const std::filesystem::path& input, const std::filesystem::path& log_path, const Progress& progress)>;

/// Imports each input into `folder`/`name`.lcm, stopping at the first that fails: those before it are whole,
/// it and those after it do not exist. The folder is made if need be.
[[nodiscard]] rt::Expected<std::vector<LogSummary>> import_batch(const std::vector<BatchItem>& items,
                                                                 const std::filesystem::path& folder,
                                                                 const ImportOne& import_one);

}  // namespace airworthy::importer
