#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/error.h"

namespace airworthy::rt::config_detail {

/// Where a key or value was written. Line and column count from 1; line 0 means nowhere: a table that exists
/// only because something below it was set.
struct Position {
  enum class Origin : std::uint8_t { kFile, kOverride };
  Origin origin = Origin::kFile;
  std::uint32_t line = 0;
  std::uint32_t column = 0;
};

struct Entry;

/// One TOML value, free of the library that parsed it, with what the readers have made of it so far.
struct Node {
  enum class Kind : std::uint8_t { kString, kInteger, kNumber, kBoolean, kDate, kArray, kTable };

  Node() = default;
  Node(Node&&) noexcept = default;
  Node& operator=(Node&&) noexcept = default;
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  ~Node() = default;

  [[nodiscard]] Entry* find(std::string_view key);

  Kind kind = Kind::kTable;
  Position position;
  std::string text;  ///< of a string or a date
  std::int64_t integer = 0;
  double number = 0.0;
  bool boolean = false;
  std::vector<Entry> entries;      ///< of a table, in the order they were written
  std::vector<Node> elements;      ///< of an array
  bool opened = false;             ///< a table whose keys are being read: those nobody asks for are unknown
  std::vector<std::string> asked;  ///< keys that were asked for, present or not
};

struct Entry {
  std::string key;
  Position position;
  Node value;
  bool visited = false;
};

/// A parse error with the position toml++ gives it.
struct SyntaxError {
  Position position;
  std::string reason;
};

/// Parses a whole file into `root`. Never throws.
[[nodiscard]] std::optional<SyntaxError> parse_document(std::string_view text, Node& root);

/// Parses the right-hand side of an override; nothing if it is not a TOML value.
[[nodiscard]] std::optional<Node> parse_value(std::string_view text);

/// "an integer", "a table": what a value is, without its content.
[[nodiscard]] std::string_view kind_with_article(Node::Kind kind);

/// "the integer 3", "the string \"abc\"", "a table": what was found, for an error message; long text is cut.
[[nodiscard]] std::string describe(const Node& node);

/// Quotes and escapes so that the result is one printable line.
[[nodiscard]] std::string quoted(std::string_view text);

/// A key as it is written in a dotted path: quoted only if it must be.
[[nodiscard]] std::string key_text(std::string_view key);

/// `parent.key`, or `key` at the root.
[[nodiscard]] std::string join(std::string_view parent, std::string_view key);

/// `array[index]`.
[[nodiscard]] std::string join(std::string_view array, std::size_t index);

/// One step of a dotted path: a key, or the index of an array's element.
struct PathStep {
  std::string key;
  std::size_t index = 0;
  bool is_index = false;
};

/// Splits `policy.raise_sigma` or `channel[2].name`; nothing if it is not of that form.
[[nodiscard]] std::optional<std::vector<PathStep>> parse_path(std::string_view path);

}  // namespace airworthy::rt::config_detail
