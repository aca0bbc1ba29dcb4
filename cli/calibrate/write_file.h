#pragma once

#include <string>

#include "runtime/error.h"

namespace airworthy::calibrate {

/// Writes the whole file or none of it.
[[nodiscard]] rt::Expected<void> write_file(const std::string& path, const std::string& text);

}  // namespace airworthy::calibrate
