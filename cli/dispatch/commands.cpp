#include "cli/dispatch/commands.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <system_error>
#include <utility>

namespace airworthy::cli {
namespace {

namespace fs = std::filesystem;
using About = std::pair<std::string_view, std::string_view>;

constexpr std::string_view kPrefix = "airworthy-";

/// Every other airworthy-X is a process of the vehicle, or somebody's own command.
constexpr std::array kTools{
    About{"calibrate", "learn the baselines of a vehicle from healthy flights"},
    About{"doctor", "check that this computer can run Airworthy, and print the cures"},
    About{"eval", "score detectors over recorded flights against the truth"},
    About{"import", "convert other formats to recorded flights"},
    About{"sim", "simulate a vehicle"},
    About{"watch", "show the health of a vehicle live"},
};

const About* tool_named(std::string_view name) {
  const auto* found =
      std::find_if(kTools.begin(), kTools.end(), [&](const About& tool) { return tool.first == name; });
  return found == kTools.end() ? nullptr : found;
}

bool is_program(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error) && access(path.c_str(), X_OK) == 0;
}

}  // namespace

bool is_command_name(std::string_view name) {
  const auto is_lower = [](char c) { return c >= 'a' && c <= 'z'; };
  if (name.empty() || !is_lower(name.front())) return false;
  return std::all_of(name.begin(), name.end(),
                     [&](char c) { return is_lower(c) || (c >= '0' && c <= '9') || c == '-'; });
}

Commands Commands::of_this_computer() {
  std::vector<std::string> folders;
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  if (!error) folders.push_back(self.parent_path().string());
  const char* path = std::getenv("PATH");
  std::string_view rest = path == nullptr ? "" : path;
  while (!rest.empty()) {
    const std::size_t colon = std::min(rest.find(':'), rest.size());
    // An empty entry of PATH means the working directory: not for us.
    if (colon > 0) folders.emplace_back(rest.substr(0, colon));
    rest.remove_prefix(std::min(colon + 1, rest.size()));
  }
  return Commands{std::move(folders)};
}

std::optional<std::string> Commands::find(std::string_view name) const {
  if (!is_command_name(name)) return std::nullopt;
  for (const std::string& folder : folders_) {
    const fs::path path = fs::path{folder} / fmt::format("{}{}", kPrefix, name);
    if (is_program(path)) return path.string();
  }
  return std::nullopt;
}

std::vector<std::string> Commands::list() const {
  std::set<std::string> names;
  for (const std::string& folder : folders_) {
    std::error_code error;
    fs::directory_iterator entry{folder, error};
    while (!error && entry != fs::directory_iterator{}) {
      const std::string file = entry->path().filename().string();
      if (file.starts_with(kPrefix) && is_command_name(file.substr(kPrefix.size())) &&
          is_program(entry->path())) {
        names.insert(file.substr(kPrefix.size()));
      }
      entry.increment(error);
    }
  }
  return {names.begin(), names.end()};
}

std::string help_text(const std::vector<std::string>& names) {
  std::string tools = fmt::format("  {:<12} {}\n", "version", "print the version");
  std::string others;
  for (const std::string& name : names) {
    if (const About* tool = tool_named(name)) {
      tools += fmt::format("  {:<12} {}\n", tool->first, tool->second);
    } else {
      others += fmt::format("  {}\n", name);
    }
  }
  std::string text =
      "Usage: airworthy COMMAND [ARGUMENTS]\n       airworthy help COMMAND\n\nCommands:\n" + tools;
  if (!others.empty())
    text += "\nProcesses of the vehicle, and other programs called airworthy-*:\n" + others;
  return text;
}

}  // namespace airworthy::cli
