#include "runtime/file/output_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <system_error>

namespace airworthy::rt {
namespace {

/// False, and errno says why, unless everything is on the disk.
bool write_all(const std::string& path, const std::string& text) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) return false;
  const bool is_written = std::fwrite(text.data(), 1, text.size(), file) == text.size() &&
                          std::fflush(file) == 0 && ::fsync(::fileno(file)) == 0;
  const int why = errno;
  const bool is_closed = std::fclose(file) == 0;
  if (!is_written) errno = why;
  return is_written && is_closed;
}

}  // namespace

Expected<void> check_output_path(const std::string& path) {
  std::error_code error;
  const auto there = std::filesystem::symlink_status(path, error);
  if (std::filesystem::exists(there) && !std::filesystem::is_regular_file(there)) {
    return fail_with(fmt::format("{}: exists and is not a regular file", path));
  }
  return {};
}

Expected<void> write_file(const std::string& path, const std::string& text) {
  if (auto checked = check_output_path(path); !checked) return checked;
  const std::string unfinished = path + ".unfinished";
  errno = 0;
  if (write_all(unfinished, text) && std::rename(unfinished.c_str(), path.c_str()) == 0) return {};
  const int why = errno;
  ::unlink(unfinished.c_str());
  return fail_with(fmt::format("{}: cannot be written: {}", path, std::strerror(why)));
}

}  // namespace airworthy::rt
