#include "runtime/config/document.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <exception>
#include <sstream>
#include <utility>

namespace airworthy::rt::config_detail {
namespace {

// toml++ bounds the nesting of arrays and inline tables but not the length of a dotted key, and frees nested
// tables recursively: 30 000 dots end in a stack overflow. No configuration needs more than a few of either.
constexpr int kMaxDotsPerLine = 32;
constexpr int kMaxDepth = 32;

constexpr std::size_t kMaxTextShown = 60;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// A dot between digits that start a token is a decimal point; every other one may separate keys.
bool is_decimal_point(std::string_view line, std::size_t dot) {
  if (dot == 0 || dot + 1 >= line.size() || !is_digit(line[dot - 1]) || !is_digit(line[dot + 1]))
    return false;
  std::size_t start = dot;
  while (start > 0 && is_digit(line[start - 1])) --start;
  return start > 0 && std::string_view{" \t=,[+-"}.find(line[start - 1]) != std::string_view::npos;
}

std::optional<SyntaxError> check_dots(std::string_view text) {
  std::uint32_t line_number = 1;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    const std::size_t first = line.find_first_not_of(" \t");
    if (first != std::string_view::npos && line[first] != '#') {
      int dots = 0;
      for (std::size_t i = first; i < line.size(); ++i) {
        if (line[i] != '.' || is_decimal_point(line, i)) continue;
        if (++dots > kMaxDotsPerLine) {
          return SyntaxError{{Position::Origin::kFile, line_number, static_cast<std::uint32_t>(i + 1)},
                             fmt::format("more than {} dots in one line", kMaxDotsPerLine)};
        }
      }
    }
    text.remove_prefix(std::min(end + 1, text.size()));
    ++line_number;
  }
  return std::nullopt;
}

std::string one_line(std::string_view text) {
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) {
      result += fmt::format("\\x{:02x}", byte);
    } else {
      result += c;
    }
  }
  return result;
}

/// Turns the library's tree into ours.
class Converter {
 public:
  explicit Converter(Position::Origin origin) : origin_{origin} {}

  std::optional<SyntaxError> convert(const toml::node& from, Node& to, int depth) {
    to.position = position(from.source().begin);
    if (depth > kMaxDepth) {
      return SyntaxError{to.position, fmt::format("nested more than {} deep", kMaxDepth)};
    }
    if (const auto* table = from.as_table()) return convert_table(*table, to, depth);
    if (const auto* array = from.as_array()) {
      to.kind = Node::Kind::kArray;
      for (const auto& element : *array) {
        if (auto error = convert(element, to.elements.emplace_back(), depth + 1)) return error;
      }
      return std::nullopt;
    }
    convert_scalar(from, to);
    return std::nullopt;
  }

 private:
  [[nodiscard]] Position position(const toml::source_position& from) const {
    return {origin_, static_cast<std::uint32_t>(from.line), static_cast<std::uint32_t>(from.column)};
  }

  std::optional<SyntaxError> convert_table(const toml::table& from, Node& to, int depth) {
    to.kind = Node::Kind::kTable;
    for (const auto& [key, value] : from) {
      Entry& entry = to.entries.emplace_back();
      entry.key = std::string{key.str()};
      entry.position = position(key.source().begin);
      if (auto error = convert(value, entry.value, depth + 1)) return error;
    }
    std::stable_sort(to.entries.begin(), to.entries.end(), [](const Entry& a, const Entry& b) {
      return std::pair{a.position.line, a.position.column} < std::pair{b.position.line, b.position.column};
    });
    return std::nullopt;
  }

  static void convert_scalar(const toml::node& from, Node& to) {
    if (const auto* text = from.as_string()) {
      to.kind = Node::Kind::kString;
      to.text = text->get();
    } else if (const auto* integer = from.as_integer()) {
      to.kind = Node::Kind::kInteger;
      to.integer = integer->get();
    } else if (const auto* number = from.as_floating_point()) {
      to.kind = Node::Kind::kNumber;
      to.number = number->get();
    } else if (const auto* boolean = from.as_boolean()) {
      to.kind = Node::Kind::kBoolean;
      to.boolean = boolean->get();
    } else {
      to.kind = Node::Kind::kDate;
      std::ostringstream out;
      if (const auto* date = from.as_date()) out << date->get();
      if (const auto* time = from.as_time()) out << time->get();
      if (const auto* date_time = from.as_date_time()) out << date_time->get();
      to.text = out.str();
    }
  }

  Position::Origin origin_;
};

bool is_bare(char c) { return (std::isalnum(static_cast<unsigned char>(c)) != 0) || c == '_' || c == '-'; }

}  // namespace

Entry* Node::find(std::string_view key) {
  const auto found =
      std::find_if(entries.begin(), entries.end(), [&](const Entry& e) { return e.key == key; });
  return found == entries.end() ? nullptr : &*found;
}

std::optional<SyntaxError> parse_document(std::string_view text, Node& root) {
  if (auto error = check_dots(text)) return error;
  try {
    const toml::table table = toml::parse(text, std::string_view{});
    return Converter{Position::Origin::kFile}.convert(table, root, 0);
  } catch (const toml::parse_error& error) {
    const auto& begin = error.source().begin;
    return SyntaxError{{Position::Origin::kFile, static_cast<std::uint32_t>(begin.line),
                        static_cast<std::uint32_t>(begin.column)},
                       one_line(error.description())};
  } catch (const std::exception& error) {
    return SyntaxError{{Position::Origin::kFile, 1, 1}, one_line(error.what())};
  }
}

std::optional<Node> parse_value(std::string_view text) {
  // A line break could smuggle in a second key.
  if (text.find_first_of("\r\n") != std::string_view::npos) return std::nullopt;
  const std::string document = fmt::format("value = {}", text);
  if (check_dots(document)) return std::nullopt;
  try {
    const toml::table table = toml::parse(document, std::string_view{});
    const toml::node* value = table.get("value");
    Node result;
    if (value == nullptr || Converter{Position::Origin::kOverride}.convert(*value, result, 0))
      return std::nullopt;
    return result;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

std::string_view kind_with_article(Node::Kind kind) {
  switch (kind) {
    case Node::Kind::kString:
      return "a string";
    case Node::Kind::kInteger:
      return "an integer";
    case Node::Kind::kNumber:
      return "a number";
    case Node::Kind::kBoolean:
      return "a boolean";
    case Node::Kind::kDate:
      return "a date";
    case Node::Kind::kArray:
      return "an array";
    case Node::Kind::kTable:
      return "a table";
  }
  return "nothing";
}

std::string quoted(std::string_view text) {
  std::string result{'"'};
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  result += '"';
  return one_line(result);
}

std::string describe(const Node& node) {
  switch (node.kind) {
    case Node::Kind::kString: {
      if (node.text.size() <= kMaxTextShown) return "the string " + quoted(node.text);
      std::size_t end = kMaxTextShown;
      // Never between the bytes of one UTF-8 character.
      while (end > 0 && (static_cast<unsigned char>(node.text[end]) & 0xC0U) == 0x80U) --end;
      return "the string " + quoted(node.text.substr(0, end)) + "...";
    }
    case Node::Kind::kInteger:
      return fmt::format("the integer {}", node.integer);
    case Node::Kind::kNumber:
      return fmt::format("the number {}", node.number);
    case Node::Kind::kBoolean:
      return fmt::format("the boolean {}", node.boolean);
    case Node::Kind::kDate:
      return fmt::format("the date {}", node.text);
    case Node::Kind::kArray:
    case Node::Kind::kTable:
      break;
  }
  return std::string{kind_with_article(node.kind)};
}

std::string key_text(std::string_view key) {
  return !key.empty() && std::all_of(key.begin(), key.end(), is_bare) ? std::string{key} : quoted(key);
}

std::string join(std::string_view parent, std::string_view key) {
  return parent.empty() ? key_text(key) : fmt::format("{}.{}", parent, key_text(key));
}

std::string join(std::string_view array, std::size_t index) { return fmt::format("{}[{}]", array, index); }

std::optional<std::vector<PathStep>> parse_path(std::string_view path) {
  std::vector<PathStep> steps;
  bool key_expected = true;
  while (!path.empty()) {
    if (key_expected) {
      const auto end =
          static_cast<std::size_t>(std::find_if_not(path.begin(), path.end(), is_bare) - path.begin());
      if (end == 0) return std::nullopt;
      steps.push_back({std::string{path.substr(0, end)}, 0, false});
      path.remove_prefix(end);
      key_expected = false;
    } else if (path.front() == '.') {
      path.remove_prefix(1);
      key_expected = true;
    } else if (path.front() == '[') {
      const std::size_t end = path.find(']');
      if (end == std::string_view::npos) return std::nullopt;
      std::size_t index = 0;
      const auto [stop, error] = std::from_chars(path.data() + 1, path.data() + end, index);
      if (error != std::errc{} || stop != path.data() + end) return std::nullopt;
      steps.push_back({{}, index, true});
      path.remove_prefix(end + 1);
    } else {
      return std::nullopt;
    }
  }
  if (key_expected) return std::nullopt;
  return steps;
}

}  // namespace airworthy::rt::config_detail
