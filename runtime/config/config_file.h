#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "runtime/config/rules.h"
#include "runtime/error.h"

namespace airworthy::rt {

namespace config_detail {
struct Node;
struct Position;
class State;

template <class T>
struct FixedArray : std::false_type {};
template <class T, std::size_t kSize>
struct FixedArray<std::array<T, kSize>> : std::true_type {};
}  // namespace config_detail

/// One of the words a key may hold, and what it means.
template <class T>
struct Word {
  std::string_view word;
  T value;
};

/// What an array of tables must satisfy.
struct TablesRule {
  /// Key whose value (string or integer) no two tables may share; empty if there is none.
  std::string_view unique_key = {};
  Count count = {};
};

/// A table being read. Every reader names one key of this table, and returns the value or, where the file is
/// wrong, a harmless substitute (the default, zero, the empty string): reading goes on, so that
/// ConfigFile::finish() can report everything that is wrong at once. Keys nobody reads are errors.
///
/// T is one of bool, std::int64_t, int, std::uint8_t, std::uint16_t, std::uint32_t, std::uint64_t, double,
/// std::string, std::vector of one of these, std::vector<std::vector<double>>, or std::array<U, N> for a
/// std::vector<U> of exactly N elements. An integer literal is a valid double. The range holds for every
/// number of an array.
///
/// A light handle, to be passed by value; must not outlive its ConfigFile.
class ConfigTable {
 public:
  /// A key that must be there.
  template <class T>
  [[nodiscard]] T required(std::string_view key, Range range = {}, Count count = {});

  /// A key that has a default.
  template <class T>
  [[nodiscard]] T optional(std::string_view key, T default_value, Range range = {}, Count count = {});

  /// A key whose absence means something of its own.
  template <class T>
  [[nodiscard]] std::optional<T> if_present(std::string_view key, Range range = {}, Count count = {});

  /// A key that must be there and hold one of the words.
  template <class T>
  [[nodiscard]] T choice(std::string_view key, std::initializer_list<Word<T>> words) {
    const auto index = word_index(key, names(words), std::nullopt);
    return (words.begin() + index)->value;
  }

  /// A key that holds one of the words, with a default, which must be among them.
  template <class T>
  [[nodiscard]] T choice(std::string_view key, std::initializer_list<Word<T>> words, T default_value) {
    std::size_t default_index = 0;
    while (default_index + 1 < words.size() && (words.begin() + default_index)->value != default_value) {
      ++default_index;
    }
    const auto index = word_index(key, names(words), default_index);
    return (words.begin() + index)->value;
  }

  /// A path to a file or folder, relative to the file that holds the key; given by --set, to the working
  /// directory.
  [[nodiscard]] std::filesystem::path required_path(std::string_view key);
  [[nodiscard]] std::filesystem::path optional_path(std::string_view key, std::string_view default_value);

  /// A sub-table; an absent one reads like an empty one, so that its defaults apply and its mandatory keys
  /// are missed.
  [[nodiscard]] ConfigTable table(std::string_view key);
  /// As table(), but its absence is an error, even if it has no mandatory key.
  [[nodiscard]] ConfigTable required_table(std::string_view key);
  /// A sub-table whose absence means something of its own.
  [[nodiscard]] std::optional<ConfigTable> optional_table(std::string_view key);

  /// An array of tables, empty if absent.
  [[nodiscard]] std::vector<ConfigTable> tables(std::string_view key, TablesRule rule = {});

  /// True if the key is written in the file or set on the command line. Does not count as reading it.
  [[nodiscard]] bool has(std::string_view key) const;

  /// Reports a violation that only the caller can see, at the position of `key`: a dotted path below this
  /// table, such as `policy.raise_sigma` or `channel[2].name`. Where that key or one of `because_of` is
  /// already in error, nothing is reported: the value at hand is a substitute, and the complaint would
  /// mislead.
  void fail(std::string_view key, std::string_view reason,
            std::initializer_list<std::string_view> because_of = {});

  /// Reports a file named by `key` that is wrong in itself; its own errors follow those of this file. Nothing more is
  /// said of the key.
  void fail_in_other_file(std::string_view key, const Error& error);

  /// Adds something to the effective configuration, and so to the hash: the content of a file that `key`
  /// names.
  void record(std::string_view key, std::string_view value);

 private:
  friend class ConfigFile;

  ConfigTable(config_detail::State& state, config_detail::Node* node, std::string path, bool silent);

  template <class T>
  static std::vector<std::string_view> names(std::initializer_list<Word<T>> words) {
    std::vector<std::string_view> result;
    result.reserve(words.size());
    for (const Word<T>& word : words) result.push_back(word.word);
    return result;
  }

  template <class T>
  std::optional<T> read_any(std::string_view key, Range range, Count count, bool mandatory);
  template <class T>
  std::optional<T> read(std::string_view key, Range range, Count count, bool mandatory);
  template <class T>
  void record_default(std::string_view key, const T& value);

  std::size_t word_index(std::string_view key, const std::vector<std::string_view>& words,
                         std::optional<std::size_t> default_index);
  std::optional<std::filesystem::path> read_path(std::string_view key, bool mandatory);
  ConfigTable open(std::string_view key, bool mandatory);
  ConfigTable open(config_detail::Node& node, std::string path);
  void check_unique(const std::vector<ConfigTable>& tables, std::string_view key);

  config_detail::State* state_;
  config_detail::Node* node_;  ///< null if the table is absent
  std::string path_;
  bool silent_;  ///< the table is unreadable, which has been reported: nothing below it is worth a word
};

/// A TOML configuration file, with what the command line overrides in it.
///
///   auto file = ConfigFile::load(path, overrides);
///   ConfigTable root = file.root();
///   Config config;
///   config.period_s = root.optional<double>("period_s", 0.2, Range{0.01, 10.0});
///   config.hash = file.hash();
///   return file.finish(std::move(config));
///
/// finish() returns the errors, one per line, sorted by position, each `file:line:col: key: reason`; `--set
/// key: reason` where an override is to blame; `file:line:col: reason` for a syntax error; `file: reason` for
/// a file that cannot be read.
class ConfigFile {
 public:
  static constexpr std::size_t kMaxBytes = 1U << 20U;

  /// `overrides` are `key.path=value`. A value that is not TOML is a string.
  [[nodiscard]] static ConfigFile load(const std::filesystem::path& path,
                                       const std::vector<std::string>& overrides = {});
  /// The same for text at hand; `name` stands for the file in messages, and its folder for relative paths.
  [[nodiscard]] static ConfigFile parse(std::string_view text, const std::filesystem::path& name,
                                        const std::vector<std::string>& overrides = {});

  ConfigFile(ConfigFile&& other) noexcept;
  ConfigFile& operator=(ConfigFile&& other) noexcept;
  ConfigFile(const ConfigFile&) = delete;
  ConfigFile& operator=(const ConfigFile&) = delete;
  ~ConfigFile();

  [[nodiscard]] ConfigTable root();

  /// FNV-1a, 64 bits, in hex, over the effective configuration read so far: the sorted lines `key.path=value`
  /// of every value a reader returned, defaults included. Layout, comments, order, and whether a default is
  /// written out make no difference.
  [[nodiscard]] std::string hash() const;

  /// The configuration, if nothing is wrong with the file; every error otherwise. To be called after all
  /// reading.
  template <class T>
  [[nodiscard]] Expected<T> finish(T config) {
    if (auto error = errors()) return tl::unexpected<Error>{std::move(*error)};
    return config;
  }

 private:
  explicit ConfigFile(std::unique_ptr<config_detail::State> state);
  std::optional<Error> errors();

  std::unique_ptr<config_detail::State> state_;
};

template <class T>
std::optional<T> ConfigTable::read_any(std::string_view key, Range range, Count count, bool mandatory) {
  if constexpr (config_detail::FixedArray<T>::value) {
    T result{};
    const auto values =
        read<std::vector<typename T::value_type>>(key, range, Count::exactly(result.size()), mandatory);
    if (!values) return std::nullopt;
    std::copy(values->begin(), values->end(), result.begin());
    return result;
  } else {
    return read<T>(key, range, count, mandatory);
  }
}

template <class T>
T ConfigTable::required(std::string_view key, Range range, Count count) {
  return read_any<T>(key, range, count, true).value_or(T{});
}

template <class T>
T ConfigTable::optional(std::string_view key, T default_value, Range range, Count count) {
  if (auto value = read_any<T>(key, range, count, false)) return std::move(*value);
  if constexpr (config_detail::FixedArray<T>::value) {
    record_default(key, std::vector<typename T::value_type>(default_value.begin(), default_value.end()));
  } else {
    record_default(key, default_value);
  }
  return default_value;
}

template <class T>
std::optional<T> ConfigTable::if_present(std::string_view key, Range range, Count count) {
  return read_any<T>(key, range, count, false);
}

}  // namespace airworthy::rt
