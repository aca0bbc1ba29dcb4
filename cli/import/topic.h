#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "cli/import/csv_reader.h"
#include "core/time/time.h"

namespace airworthy::importer {

/// How the cell of a time column becomes vehicle time.
struct TimeColumn {
  enum class Unit : std::uint8_t { kSeconds, kMilliseconds, kMicroseconds, kNanoseconds };

  std::string name;
  Unit unit = Unit::kNanoseconds;
  Duration base{};  ///< vehicle time at a cell of 0

  /// The time in a cell of the current row.
  [[nodiscard]] rt::Expected<TimePoint> read(const CsvReader& row, std::size_t column) const;
};

/// What a cell without text means.
enum class EmptyCell : std::uint8_t { kError, kUnknown };

/// The columns of a table that an import reads: their numbers and the row's time, which never goes backward.
class Topic {
 public:
  /// `columns` are read as numbers, in this order; unknown is NaN. Columns that are not named are not looked
  /// at.
  [[nodiscard]] static rt::Expected<Topic> open(CsvReader reader, const TimeColumn& time,
                                                const std::vector<std::string>& columns,
                                                EmptyCell empty_cell = EmptyCell::kError);

  [[nodiscard]] rt::Expected<bool> next();

  [[nodiscard]] TimePoint time() const { return time_; }
  [[nodiscard]] double operator[](std::size_t column) const { return values_[column]; }
  [[nodiscard]] const CsvReader& reader() const { return reader_; }

 private:
  explicit Topic(CsvReader reader) : reader_{std::move(reader)} {}

  CsvReader reader_;
  TimeColumn time_column_;
  std::size_t time_index_ = 0;
  std::vector<std::size_t> indices_;
  std::vector<double> values_;
  EmptyCell empty_cell_ = EmptyCell::kError;
  TimePoint time_;
  bool has_time_ = false;
};

}  // namespace airworthy::importer
