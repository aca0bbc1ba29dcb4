#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/import/byte_source.h"

namespace airworthy::importer {

struct CsvFormat {
  char delimiter = ',';
  int skip_lines = 0;               ///< before the header
  std::vector<std::string> header;  ///< names of the columns of a file that has no header line; else empty
};

/// Reads a table row by row, strictly: every row has as many cells as the header, and the last line is ended.
/// A cell may stand in double quotes (a quote inside is doubled) but not span lines. Numbers are read without
/// regard to the locale. Every error names file and line.
class CsvReader {
 public:
  static constexpr std::size_t kLongestLine = std::size_t{1024} * 1024;

  [[nodiscard]] static rt::Expected<CsvReader> open(const std::filesystem::path& path,
                                                    const CsvFormat& format = {});

  /// Number of the column with this name, from 0.
  [[nodiscard]] rt::Expected<std::size_t> column(std::string_view name) const;
  [[nodiscard]] std::optional<std::size_t> find(std::string_view name) const;
  [[nodiscard]] const std::vector<std::string>& header() const { return header_; }

  /// Moves to the next row; false at the end. A file without any row is an error.
  [[nodiscard]] rt::Expected<bool> next();

  /// Of the current row, until the next call of next().
  [[nodiscard]] std::string_view text(std::size_t column) const { return cells_[column]; }
  [[nodiscard]] rt::Expected<double> number(std::size_t column) const;  ///< finite
  [[nodiscard]] rt::Expected<std::int64_t> integer(std::size_t column) const;

  /// What is wrong with the current row, as `file:line: what`.
  [[nodiscard]] tl::unexpected<rt::Error> fail(std::string_view what) const;
  /// The same for one cell: `file:line: column name: "cell" what`.
  [[nodiscard]] tl::unexpected<rt::Error> fail_cell(std::size_t column, std::string_view what) const;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::int64_t line() const { return line_; }
  [[nodiscard]] std::uint64_t position() const { return source_->position(); }
  [[nodiscard]] std::uint64_t size() const { return source_->size(); }

 private:
  CsvReader(std::filesystem::path path, char delimiter, std::unique_ptr<ByteSource> source)
      : path_{std::move(path)}, delimiter_{delimiter}, source_{std::move(source)} {}
  rt::Expected<bool> next_line();
  rt::Expected<void> split();
  rt::Expected<void> read_header(const CsvFormat& format);

  std::filesystem::path path_;
  char delimiter_;
  std::unique_ptr<ByteSource> source_;
  std::string buffer_;
  std::size_t begin_ = 0;  // of what is not yet read in the buffer
  std::string_view line_text_;
  std::int64_t line_ = 0;
  std::vector<std::string> header_;
  std::vector<std::string> cells_;
  bool has_row_ = false;
};

}  // namespace airworthy::importer
