#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "cli/import/message_builder.h"
#include "cli/import/topic.h"

namespace airworthy::importer {

/// A column and its weight in a sum.
struct Term {
  std::string column;
  double scale = 1.0;
};

/// What goes into one field of a message: a constant, or columns of the row.
///   value = clamp(conversion(Σ scale · cell, or its Euclidean norm) + offset)
struct FieldMap {
  FieldSlot slot;
  std::optional<double> constant;
  std::vector<Term> terms;
  bool norm = false;  ///< √Σ (scale · cell)² in place of the sum
  UnitConversion conversion;
  double offset = 0.0;
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};

/// A message published for each row of a table.
struct MessageMap {
  std::string channel;
  std::vector<FieldMap> fields;
  std::vector<std::string> only_on_change;  ///< columns; no message unless one differs from the row before
  std::size_t rotors = 0;
};

struct TableMap {
  std::filesystem::path path;  ///< in the folder that is imported; empty: the imported file itself
  CsvFormat format;
  TimeColumn time;
  std::vector<MessageMap> messages;
};

/// Lets messages pass only while a column of a table has one of the values, before and after: between two
/// rows that disagree nobody knows when it changed.
struct GateMap {
  std::filesystem::path path;
  CsvFormat format;
  TimeColumn time;
  std::string column;
  std::vector<double> values;
  Duration longest_gap{};  ///< between two rows; beyond it the value is unknown
  std::string name;        ///< for the report of what was left out
};

/// A fault, or health, that all flights of the map have in common.
struct FixedTruth {
  std::string component;
  std::string fault_kind;
  std::optional<double> onset_s;  ///< after the first row; none: from the start
  double magnitude = std::numeric_limits<double>::quiet_NaN();
};

/// What a word in a column of an index means.
struct WordMap {
  std::string column;  ///< empty: the constant
  std::string constant;
  std::vector<std::pair<std::string, std::string>> words;  ///< cell → meaning; without any, the cell itself
};

/// Truth in a table of flights: one row a flight, whose key is the end of the path that is imported.
struct TruthIndex {
  std::filesystem::path path;  ///< from the folder of the imported file, or from the imported folder
  std::string key_column;
  WordMap component;  ///< several components are separated by spaces
  WordMap fault_kind;
  std::optional<TimeColumn> onset;
  std::string magnitude_column;  ///< empty: not known
  double magnitude_scale = 1.0;
  double magnitude_offset = 0.0;
};

/// Truth in a log of settings: a fault starts with the first row whose value is not healthy, and ends with
/// the first confirmed row whose value is.
struct TruthSetting {
  std::filesystem::path path;
  TimeColumn time;
  std::string name_column;
  std::string name;
  std::string value_column;
  std::array<double, 2> healthy{};  ///< lowest and highest healthy value
  std::string confirmed_column;     ///< empty: every row is confirmed
  std::string confirmed_word;
  std::string component;
  std::string fault_kind;
  double magnitude_scale = 1.0;
  double magnitude_offset = 0.0;
};

/// A mapping file of `airworthy import table`; its keys are explained in docs/import.md.
struct ImportMap {
  std::string vehicle;
  std::vector<TableMap> tables;
  std::vector<GateMap> gates;
  std::vector<FixedTruth> truths;
  std::optional<TruthIndex> truth_index;
  std::vector<TruthSetting> truth_settings;

  /// Whether a folder of tables is imported rather than a single file.
  [[nodiscard]] bool is_folder() const { return !tables.empty() && !tables.front().path.empty(); }

  [[nodiscard]] static rt::Expected<ImportMap> load(const std::filesystem::path& path);
};

}  // namespace airworthy::importer
