#include "cli/calibrate/write_file.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

namespace airworthy::calibrate {

rt::Expected<void> write_file(const std::string& path, const std::string& text) {
  const std::string unfinished = path + ".unfinished";
  std::ofstream file{unfinished, std::ios::binary};
  file << text;
  file.close();
  std::error_code error;
  if (file) std::filesystem::rename(unfinished, path, error);
  if (!file || error) {
    std::filesystem::remove(unfinished, error);
    return rt::fail_with(fmt::format("{}: cannot be written", path));
  }
  return {};
}

}  // namespace airworthy::calibrate
