#pragma once

#include <string>

#include "runtime/error.h"

namespace airworthy::rt {

/// Whether a finished file may be renamed onto `path`: what is there must be a regular file, if anything is. A device,
/// a pipe or a symbolic link would be gone.
[[nodiscard]] Expected<void> check_output_path(const std::string& path);

/// Writes the whole file, by way of `<path>.unfinished`, or none of it: an older file is then as before.
[[nodiscard]] Expected<void> write_file(const std::string& path, const std::string& text);

}  // namespace airworthy::rt
