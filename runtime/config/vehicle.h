#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/vehicle/multirotor.h"
#include "runtime/config/config_file.h"
#include "runtime/error.h"

namespace airworthy::rt {

enum class VehicleKind : std::uint8_t { kMultirotor, kFixedWing };

/// What every process must know of the vehicle it runs on; config/vehicle.toml or config/multirotor.toml. Process files name it by a
/// key, by convention `vehicle = "vehicle.toml"`.
struct VehicleFile {
  static constexpr std::size_t kMaxNameLength = 16;

  std::string name;  ///< prefix of every channel; [A-Za-z0-9_-]{1,16}
  VehicleKind kind = VehicleKind::kMultirotor;
  std::string description;
  std::optional<Multirotor> multirotor;  ///< nominal geometry and motors, where the file describes them
  std::string hash;                      ///< of the effective content, see ConfigFile::hash()

  [[nodiscard]] static Expected<VehicleFile> load(const std::filesystem::path& path);
  [[nodiscard]] static Expected<VehicleFile> read(ConfigFile file);

  /// Loads the vehicle file that `key` of a process file names. Its errors are reported with those of the
  /// process file, and its hash becomes part of the process file's.
  [[nodiscard]] static VehicleFile named_by(ConfigTable table, std::string_view key = "vehicle");

  /// The rule for `name`.
  [[nodiscard]] static bool is_valid_name(std::string_view name);
};

}  // namespace airworthy::rt
