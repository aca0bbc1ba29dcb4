#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace airworthy::cli {

/// `airworthy X` runs the program airworthy-X: the first one found in these folders.
class Commands {
 public:
  explicit Commands(std::vector<std::string> folders) : folders_{std::move(folders)} {}

  /// The folder of this program, then those of PATH.
  [[nodiscard]] static Commands of_this_computer();

  /// Path of the program. Nothing if there is none, or if the name is none.
  [[nodiscard]] std::optional<std::string> find(std::string_view name) const;

  /// Every X for which there is an airworthy-X, sorted.
  [[nodiscard]] std::vector<std::string> list() const;

 private:
  std::vector<std::string> folders_;
};

/// Lower case letters, digits and hyphens, a letter first: no path, no option.
[[nodiscard]] bool is_command_name(std::string_view name);

/// What --help prints.
[[nodiscard]] std::string help_text(const std::vector<std::string>& names);

}  // namespace airworthy::cli
