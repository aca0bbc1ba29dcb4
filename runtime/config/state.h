#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/config/document.h"
#include "runtime/error.h"

namespace airworthy::rt::config_detail {

/// Everything a ConfigFile knows: the document, what was read from it, what is wrong with it.
class State {
 public:
  explicit State(std::filesystem::path file) : file_{std::move(file)} {}

  /// Parses the text and applies the overrides on top of it.
  void parse(std::string_view text, const std::vector<std::string>& overrides);

  /// The file as a whole is of no use.
  void fail_whole(std::string_view reason);

  /// `path` is the full dotted path of the key that is wrong. Every key is complained about once: the first
  /// complaint is the cause of any further one.
  void fail(Position at, const std::string& path, std::string_view reason);
  /// The key at `path` is in error by what the file it names says.
  void fail_in_other_file(const std::string& path, const Error& error) {
    failed_.insert(path);
    other_files_.push_back(error.text);
  }

  void record(const std::string& path, std::string value) { effective_[path] = std::move(value); }

  /// True if the key at `path`, or anything below it, is in error.
  [[nodiscard]] bool has_failed(const std::string& path) const;
  /// False if the document could not be parsed; reading it is pointless.
  [[nodiscard]] bool readable() const { return readable_; }
  [[nodiscard]] Node& root() { return root_; }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

  /// Where to look for something missing from the table at `path`: the innermost table around it that is
  /// written somewhere.
  [[nodiscard]] Position position_of_table(std::string_view path);

  /// Position of the node at the dotted path, or of the innermost written table on the way to it.
  [[nodiscard]] Position position_of(std::string_view path);

  [[nodiscard]] std::string hash() const;
  [[nodiscard]] std::optional<Error> errors();

 private:
  struct Complaint {
    Position at;
    std::string text;
  };

  void apply_override(std::string_view text);
  void fail_override(std::string_view key, std::string_view reason);
  void report_unknown(const Node& table, const std::string& path);

  std::filesystem::path file_;
  Node root_;
  bool readable_ = false;
  std::vector<Complaint> complaints_;
  std::vector<std::string> other_files_;
  std::set<std::string> failed_;
  std::map<std::string, std::string> effective_;
};

}  // namespace airworthy::rt::config_detail
