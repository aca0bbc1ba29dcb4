#pragma once

#include <string>

#include "runtime/config/config_file.h"

namespace airworthy::rt {

/// Everything that is wrong with a file that has been read, or nothing.
inline std::string errors_of(ConfigFile& file) {
  const auto result = file.finish(0);
  return result ? std::string{} : result.error().text;
}

}  // namespace airworthy::rt
