#include <fmt/format.h>

#include <limits>
#include <map>
#include <utility>

#include "runtime/config/config_file.h"
#include "runtime/config/state.h"

namespace airworthy::rt {

using config_detail::Entry;
using config_detail::join;
using config_detail::Node;
using config_detail::Position;
using config_detail::State;

namespace {

template <class T>
struct IsVector : std::false_type {};
template <class T>
struct IsVector<std::vector<T>> : std::true_type {};

template <class T>
constexpr std::string_view expected_kind() {
  if constexpr (std::is_same_v<T, bool>) return "a boolean";
  if constexpr (std::is_integral_v<T>) return "an integer";
  if constexpr (std::is_same_v<T, double>) return "a number";
  if constexpr (std::is_same_v<T, std::string>) return "a string";
  return "an array";
}

template <class T>
Range within_limits(Range range) {
  // A double cannot hold the bounds of 64-bit integers; TOML's own integers are 64 bits wide.
  if constexpr (sizeof(T) == sizeof(std::int64_t)) {
    return std::is_unsigned_v<T> ? range.within(0.0, std::numeric_limits<double>::infinity()) : range;
  } else {
    return range.within(static_cast<double>(std::numeric_limits<T>::min()),
                        static_cast<double>(std::numeric_limits<T>::max()));
  }
}

/// What a value must satisfy, and where complaints about it go.
struct Check {
  State& state;
  Range range;
  Count count;
};

void fail_kind(State& state, Position at, const std::string& path, std::string_view expected,
               const Node& found) {
  state.fail(at, path, fmt::format("expected {}, found {}", expected, describe(found)));
}

template <class T>
std::optional<T> convert(const Check& check, const Node& node, Position at, const std::string& path);

template <class T>
std::optional<T> convert_integer(const Check& check, const Node& node, Position at, const std::string& path) {
  if (node.kind != Node::Kind::kInteger) {
    fail_kind(check.state, at, path, expected_kind<T>(), node);
    return std::nullopt;
  }
  const auto value = static_cast<double>(node.integer);
  const Range narrowed = within_limits<T>(check.range);
  if (!narrowed.contains(value)) {
    // The bounds of the type are worth a word only to those who overstep them.
    const Range& broken = check.range.contains(value) ? narrowed : check.range;
    check.state.fail(at, path, fmt::format("{}, is {}", broken.requirement(value), node.integer));
    return std::nullopt;
  }
  return static_cast<T>(node.integer);
}

std::optional<double> convert_number(const Check& check, const Node& node, Position at,
                                     const std::string& path) {
  if (node.kind != Node::Kind::kInteger && node.kind != Node::Kind::kNumber) {
    fail_kind(check.state, at, path, expected_kind<double>(), node);
    return std::nullopt;
  }
  const double value = node.kind == Node::Kind::kInteger ? static_cast<double>(node.integer) : node.number;
  if (!check.range.contains(value)) {
    check.state.fail(at, path, fmt::format("{}, is {}", check.range.requirement(value), value));
    return std::nullopt;
  }
  return value;
}

template <class T>
std::optional<T> convert_array(const Check& check, const Node& node, Position at, const std::string& path) {
  if (node.kind != Node::Kind::kArray) {
    fail_kind(check.state, at, path, expected_kind<T>(), node);
    return std::nullopt;
  }
  T result;
  bool whole = true;
  if (!check.count.contains(node.elements.size())) {
    check.state.fail(at, path, fmt::format("{}, has {}", check.count.requirement(), node.elements.size()));
    whole = false;
  }
  // The count is that of the outer array; rows of a matrix are the caller's affair.
  const Check element_check{check.state, check.range, Count{}};
  for (std::size_t i = 0; i < node.elements.size(); ++i) {
    const Node& element = node.elements[i];
    const Position element_at = element.position.line != 0 ? element.position : at;
    auto value = convert<typename T::value_type>(element_check, element, element_at, join(path, i));
    if (value) {
      result.push_back(std::move(*value));
    } else {
      whole = false;
    }
  }
  if (!whole) return std::nullopt;
  return result;
}

template <class T>
std::optional<T> convert(const Check& check, const Node& node, Position at, const std::string& path) {
  if constexpr (IsVector<T>::value) {
    return convert_array<T>(check, node, at, path);
  } else if constexpr (std::is_same_v<T, double>) {
    return convert_number(check, node, at, path);
  } else if constexpr (std::is_same_v<T, bool>) {
    if (node.kind == Node::Kind::kBoolean) return node.boolean;
    fail_kind(check.state, at, path, expected_kind<T>(), node);
    return std::nullopt;
  } else if constexpr (std::is_same_v<T, std::string>) {
    if (node.kind == Node::Kind::kString) return node.text;
    fail_kind(check.state, at, path, expected_kind<T>(), node);
    return std::nullopt;
  } else {
    return convert_integer<T>(check, node, at, path);
  }
}

/// One spelling for one value, so that equal configurations have equal hashes.
std::string normalised(bool value) { return value ? "true" : "false"; }
std::string normalised(double value) { return fmt::format("{}", value); }
std::string normalised(const std::string& value) { return config_detail::quoted(value); }
template <class T>
std::string normalised(T value) {
  return fmt::format(
      "{}", static_cast<std::conditional_t<std::is_signed_v<T>, std::int64_t, std::uint64_t>>(value));
}
template <class T>
std::string normalised(const std::vector<T>& values) {
  std::string result = "[";
  for (const auto& value : values) {
    if constexpr (std::is_same_v<T, bool>) {
      result += normalised(static_cast<bool>(value));
    } else {
      result += normalised(value);
    }
    result += ',';
  }
  return result + "]";
}

Entry* look_up(Node* table, std::string_view key) {
  if (table == nullptr) return nullptr;
  table->asked.emplace_back(key);
  Entry* entry = table->find(key);
  if (entry != nullptr) entry->visited = true;
  return entry;
}

/// Where to complain about an entry.
Position position_of(State& state, const Entry& entry, const std::string& path) {
  return entry.position.line != 0 ? entry.position : state.position_of(path);
}

}  // namespace

ConfigTable::ConfigTable(State& state, Node* node, std::string path, bool silent)
    : state_{&state}, node_{node}, path_{std::move(path)}, silent_{silent} {}

template <class T>
std::optional<T> ConfigTable::read(std::string_view key, Range range, Count count, bool mandatory) {
  if (silent_) return std::nullopt;
  const std::string path = join(path_, key);
  const Entry* entry = look_up(node_, key);
  if (entry == nullptr) {
    if (mandatory) state_->fail(state_->position_of_table(path_), path, "missing mandatory key");
    return std::nullopt;
  }
  auto value =
      convert<T>(Check{*state_, range, count}, entry->value, position_of(*state_, *entry, path), path);
  if (value) state_->record(path, normalised(*value));
  return value;
}

template <class T>
void ConfigTable::record_default(std::string_view key, const T& value) {
  if (!silent_) state_->record(join(path_, key), normalised(value));
}

#define AIRWORTHY_CONFIG_TYPE(T)                                                        \
  template std::optional<T> ConfigTable::read<T>(std::string_view, Range, Count, bool); \
  template void ConfigTable::record_default<T>(std::string_view, const T&);

AIRWORTHY_CONFIG_TYPE(bool)
AIRWORTHY_CONFIG_TYPE(std::uint8_t)
AIRWORTHY_CONFIG_TYPE(std::uint16_t)
AIRWORTHY_CONFIG_TYPE(std::uint32_t)
AIRWORTHY_CONFIG_TYPE(std::uint64_t)
AIRWORTHY_CONFIG_TYPE(std::int32_t)
AIRWORTHY_CONFIG_TYPE(std::int64_t)
AIRWORTHY_CONFIG_TYPE(double)
AIRWORTHY_CONFIG_TYPE(std::string)
AIRWORTHY_CONFIG_TYPE(std::vector<bool>)
AIRWORTHY_CONFIG_TYPE(std::vector<std::uint8_t>)
AIRWORTHY_CONFIG_TYPE(std::vector<std::uint16_t>)
AIRWORTHY_CONFIG_TYPE(std::vector<std::uint32_t>)
AIRWORTHY_CONFIG_TYPE(std::vector<std::uint64_t>)
AIRWORTHY_CONFIG_TYPE(std::vector<std::int32_t>)
AIRWORTHY_CONFIG_TYPE(std::vector<std::int64_t>)
AIRWORTHY_CONFIG_TYPE(std::vector<double>)
AIRWORTHY_CONFIG_TYPE(std::vector<std::string>)
AIRWORTHY_CONFIG_TYPE(std::vector<std::vector<double>>)
#undef AIRWORTHY_CONFIG_TYPE

std::size_t ConfigTable::word_index(std::string_view key, const std::vector<std::string_view>& words,
                                    std::optional<std::size_t> default_index) {
  const std::size_t substitute = default_index.value_or(0);
  if (silent_) return substitute;
  const std::string path = join(path_, key);
  const Entry* entry = look_up(node_, key);
  if (entry == nullptr) {
    if (default_index) {
      state_->record(path, normalised(std::string{words[substitute]}));
    } else {
      state_->fail(state_->position_of_table(path_), path,
                   fmt::format("missing mandatory key, one of {}", fmt::join(words, ", ")));
    }
    return substitute;
  }
  const Position at = position_of(*state_, *entry, path);
  const Node& node = entry->value;
  if (node.kind != Node::Kind::kString) {
    fail_kind(*state_, at, path, fmt::format("one of {}", fmt::join(words, ", ")), node);
    return substitute;
  }
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] != node.text) continue;
    state_->record(path, normalised(node.text));
    return i;
  }
  state_->fail(
      at, path,
      fmt::format("must be one of {}, is {}", fmt::join(words, ", "), config_detail::quoted(node.text)));
  return substitute;
}

std::optional<std::filesystem::path> ConfigTable::read_path(std::string_view key, bool mandatory) {
  const auto value = read<std::string>(key, {}, {}, mandatory);
  if (!value) return std::nullopt;
  if (value->empty()) {
    fail(key, "must not be empty");
    return std::nullopt;
  }
  if (value->find('\0') != std::string::npos) {
    fail(key, "must not hold a NUL character");
    return std::nullopt;
  }
  const Entry* entry = node_->find(key);
  if (entry->value.position.origin == Position::Origin::kOverride) return std::filesystem::path{*value};
  return (state_->file().parent_path() / *value).lexically_normal();
}

std::filesystem::path ConfigTable::required_path(std::string_view key) {
  return read_path(key, true).value_or(std::filesystem::path{});
}

std::filesystem::path ConfigTable::optional_path(std::string_view key, std::string_view default_value) {
  if (auto value = read_path(key, false)) return std::move(*value);
  record_default(key, std::string{default_value});
  return (state_->file().parent_path() / default_value).lexically_normal();
}

ConfigTable ConfigTable::open(Node& node, std::string path) {
  node.opened = true;
  return ConfigTable{*state_, &node, std::move(path), false};
}

ConfigTable ConfigTable::open(std::string_view key, bool mandatory) {
  std::string path = join(path_, key);
  if (silent_) return ConfigTable{*state_, nullptr, std::move(path), true};
  Entry* entry = look_up(node_, key);
  if (entry == nullptr) {
    if (mandatory) state_->fail(state_->position_of_table(path_), path, "missing mandatory table");
    return ConfigTable{*state_, nullptr, std::move(path), false};
  }
  if (entry->value.kind != Node::Kind::kTable) {
    fail_kind(*state_, position_of(*state_, *entry, path), path, "a table", entry->value);
    return ConfigTable{*state_, nullptr, std::move(path), true};
  }
  return open(entry->value, std::move(path));
}

ConfigTable ConfigTable::table(std::string_view key) { return open(key, false); }

ConfigTable ConfigTable::required_table(std::string_view key) { return open(key, true); }

std::optional<ConfigTable> ConfigTable::optional_table(std::string_view key) {
  if (silent_) return std::nullopt;
  if (has(key)) {
    state_->record(join(path_, key), "{}");
    return open(key, false);
  }
  if (node_ != nullptr) node_->asked.emplace_back(key);
  return std::nullopt;
}

std::vector<ConfigTable> ConfigTable::tables(std::string_view key, TablesRule rule) {
  std::vector<ConfigTable> result;
  if (silent_) return result;
  const std::string path = join(path_, key);
  Entry* entry = look_up(node_, key);
  if (entry == nullptr) {
    if (rule.count.min > 0) {
      state_->fail(state_->position_of_table(path_), path,
                   fmt::format("missing mandatory tables, {}", rule.count.requirement()));
    }
    return result;
  }
  const Position at = position_of(*state_, *entry, path);
  if (entry->value.kind != Node::Kind::kArray) {
    fail_kind(*state_, at, path, "an array of tables", entry->value);
    return result;
  }
  auto& elements = entry->value.elements;
  if (!rule.count.contains(elements.size())) {
    state_->fail(at, path, fmt::format("{}, has {}", rule.count.requirement(), elements.size()));
  }
  state_->record(path, fmt::format("[{}]", elements.size()));
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const std::string element_path = join(path, i);
    if (elements[i].kind == Node::Kind::kTable) {
      result.push_back(open(elements[i], element_path));
    } else {
      fail_kind(*state_, elements[i].position.line != 0 ? elements[i].position : at, element_path, "a table",
                elements[i]);
    }
  }
  if (!rule.unique_key.empty()) check_unique(result, rule.unique_key);
  return result;
}

void ConfigTable::check_unique(const std::vector<ConfigTable>& tables, std::string_view key) {
  std::map<std::string, std::string> first_user;
  for (const ConfigTable& table : tables) {
    const Entry* entry = table.node_->find(key);
    if (entry == nullptr) continue;
    const Node& value = entry->value;
    if (value.kind != Node::Kind::kString && value.kind != Node::Kind::kInteger) continue;
    const std::string text = value.kind == Node::Kind::kString ? config_detail::quoted(value.text)
                                                               : fmt::format("{}", value.integer);
    const auto [first, inserted] = first_user.emplace(text, table.path_);
    if (inserted) continue;
    const std::string path = join(table.path_, key);
    state_->fail(position_of(*state_, *entry, path), path,
                 fmt::format("{} is already used by {}", text, first->second));
  }
}

bool ConfigTable::has(std::string_view key) const { return node_ != nullptr && node_->find(key) != nullptr; }

void ConfigTable::fail(std::string_view key, std::string_view reason,
                       std::initializer_list<std::string_view> because_of) {
  if (silent_) return;
  // The caller's key is a path of its own, written as it is to appear.
  const auto full = [this](std::string_view below) {
    return path_.empty() ? std::string{below} : fmt::format("{}.{}", path_, below);
  };
  for (const std::string_view other : because_of) {
    if (state_->has_failed(full(other))) return;
  }
  const std::string path = full(key);
  if (!state_->has_failed(path)) state_->fail(state_->position_of(path), path, reason);
}

void ConfigTable::fail_in_other_file(std::string_view key, const Error& error) {
  state_->fail_in_other_file(join(path_, key), error);
}

void ConfigTable::record(std::string_view key, std::string_view value) {
  if (!silent_) state_->record(join(path_, key), std::string{value});
}

}  // namespace airworthy::rt
