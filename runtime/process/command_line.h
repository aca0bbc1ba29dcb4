#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/config/rules.h"

namespace airworthy::rt {

// What is said of a wrong option is said in our words: those of CLI11 let NaN through, wrap large numbers around and
// print bounds with 300 digits.

/// A number, the whole text of it, within the range; NaN and infinity never are.
[[nodiscard]] CLI::Validator is_number(Range range);

/// A whole number within the bounds, which are exact.
[[nodiscard]] CLI::Validator is_whole_number(std::uint64_t least,
                                             std::uint64_t most = std::numeric_limits<std::uint64_t>::max());

/// An option that takes one of a few words, and nothing but these.
template <class T>
CLI::Option* add_words(CLI::App& app, const std::string& option, T& target,
                       const std::vector<std::pair<std::string, T>>& words, const std::string& about) {
  std::string names;
  for (const auto& [name, value] : words) names += (names.empty() ? "" : ", ") + name;
  const auto choose = [&target, words, names, option](const std::string& chosen) {
    const auto found = std::find_if(words.begin(), words.end(),
                                    [&chosen](const auto& word) { return word.first == chosen; });
    if (found == words.end()) throw CLI::ValidationError(option, "must be one of " + names);
    target = found->second;
  };
  std::string type = names;
  type.erase(std::remove(type.begin(), type.end(), ' '), type.end());
  return app.add_option_function<std::string>(option, choose, about)->type_name("{" + type + "}");
}

/// Parses the command line. Nothing if the program may go on; else the exit code, when help, version or what is wrong
/// is printed, the latter as fail() does.
[[nodiscard]] std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv);

/// Prints what is wrong with the command line, and the hint to --help; returns the exit code.
[[nodiscard]] int wrong_usage(const std::string& reason);

}  // namespace airworthy::rt
