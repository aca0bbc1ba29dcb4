#pragma once

#include <cstdlib>
#include <filesystem>

namespace airworthy::testing {

/// Folder of recorded flights: $AIRWORTHY_DATA, else the one beside the source tree. The recordings are not
/// part of the project; a test that needs them skips, saying so, where they are absent.
inline std::filesystem::path recorded_data() {
  const char* folder = std::getenv("AIRWORTHY_DATA");
  return folder != nullptr && *folder != '\0' ? folder : AIRWORTHY_DATA_DEFAULT;
}

}  // namespace airworthy::testing
