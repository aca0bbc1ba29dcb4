#include "cli/import/csv_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace airworthy::importer {
namespace {

constexpr std::size_t kLongestQuotation = 40;

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

// One printable line of bounded length, whatever the file holds.
std::string in_quotes(std::string_view text) {
  std::string result = "\"";
  for (const char c : text.substr(0, kLongestQuotation)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte >= 0x7f) {
      result += fmt::format("\\x{:02x}", byte);
    } else {
      result += c;
    }
  }
  if (text.size() > kLongestQuotation) result += "...";
  return result + '"';
}

template <class Number>
std::errc parse(std::string_view text, Number& value) {
  text = trimmed(text);
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{}) return error;
  return end == text.data() + text.size() ? std::errc{} : std::errc::invalid_argument;
}

}  // namespace

rt::Expected<CsvReader> CsvReader::open(const std::filesystem::path& path, const CsvFormat& format) {
  auto source = ByteSource::open(path);
  if (!source) return tl::unexpected<rt::Error>{source.error()};
  CsvReader reader{path, format.delimiter, std::move(*source)};
  const auto header = reader.read_header(format);
  if (!header) return tl::unexpected<rt::Error>{header.error()};
  return reader;
}

rt::Expected<void> CsvReader::read_header(const CsvFormat& format) {
  for (int i = 0; i < format.skip_lines; ++i) {
    const auto more = next_line();
    if (!more) return tl::unexpected<rt::Error>{more.error()};
    if (!*more) return rt::fail_with(fmt::format("{}: ends before the header", path_.string()));
  }
  if (!format.header.empty()) {
    header_ = format.header;
    return {};
  }
  const auto more = next_line();
  if (!more) return tl::unexpected<rt::Error>{more.error()};
  if (!*more) return rt::fail_with(fmt::format("{}: ends before the header", path_.string()));
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (line_text_.starts_with(kByteOrderMark)) line_text_.remove_prefix(kByteOrderMark.size());
  if (auto cells = split(); !cells) return cells;
  header_ = cells_;
  for (auto& name : header_) name = trimmed(name);
  for (auto name = header_.begin(); name != header_.end(); ++name) {
    if (std::find(header_.begin(), name, *name) != name) {
      return fail(fmt::format("the header names column {} twice", in_quotes(*name)));
    }
  }
  return {};
}

rt::Expected<bool> CsvReader::next_line() {
  constexpr std::size_t kChunk = 65536;
  std::size_t searched = begin_;
  for (;;) {
    const std::size_t end = buffer_.find('\n', searched);
    if (end != std::string::npos) {
      ++line_;
      line_text_ = std::string_view{buffer_}.substr(begin_, end - begin_);
      if (line_text_.ends_with('\r')) line_text_.remove_suffix(1);
      begin_ = end + 1;
      return true;
    }
    if (buffer_.size() - begin_ > kLongestLine) {
      return rt::fail_with(fmt::format("{}:{}: a line of more than {} bytes: not a table", path_.string(),
                                       line_ + 1, kLongestLine));
    }
    buffer_.erase(0, begin_);
    begin_ = 0;
    searched = buffer_.size();
    buffer_.resize(searched + kChunk);
    const auto count = source_->read({buffer_.data() + searched, kChunk});
    if (!count) return tl::unexpected<rt::Error>{count.error()};
    buffer_.resize(searched + *count);
    if (*count == 0) {
      if (buffer_.empty()) return false;
      return rt::fail_with(
          fmt::format("{}:{}: the last line is not ended: truncated", path_.string(), line_ + 1));
    }
  }
}

rt::Expected<void> CsvReader::split() {
  std::size_t count = 0;
  const auto add = [&](std::string_view text) {
    if (count == cells_.size()) cells_.emplace_back();
    cells_[count++] = text;
  };
  std::string_view rest = line_text_;
  for (;;) {
    if (rest.starts_with('"')) {
      std::string cell;
      std::size_t at = 1;
      for (;; ++at) {
        if (at >= rest.size()) return fail("a quoted cell is not closed");
        if (rest[at] != '"') {
          cell += rest[at];
        } else if (rest.substr(at + 1).starts_with('"')) {
          cell += rest[++at];
        } else {
          break;
        }
      }
      add(cell);
      rest.remove_prefix(at + 1);
      if (!rest.empty() && rest.front() != delimiter_) return fail("text after a quoted cell");
    } else {
      const std::size_t end = std::min(rest.find(delimiter_), rest.size());
      add(rest.substr(0, end));
      rest.remove_prefix(end);
    }
    if (rest.empty()) break;
    rest.remove_prefix(1);
  }
  cells_.resize(count);
  return {};
}

rt::Expected<bool> CsvReader::next() {
  auto more = next_line();
  if (!more) return more;
  if (!*more) {
    if (!has_row_) return rt::fail_with(fmt::format("{}: has a header but no rows", path_.string()));
    return false;
  }
  if (const auto cells = split(); !cells) return tl::unexpected<rt::Error>{cells.error()};
  if (cells_.size() != header_.size()) {
    return fail(fmt::format("{} where the header has {}: truncated or corrupt",
                            cells_.size() == 1 ? "1 cell" : fmt::format("{} cells", cells_.size()),
                            header_.size()));
  }
  has_row_ = true;
  return true;
}

std::optional<std::size_t> CsvReader::find(std::string_view name) const {
  const auto found = std::find(header_.begin(), header_.end(), name);
  if (found == header_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - header_.begin());
}

rt::Expected<std::size_t> CsvReader::column(std::string_view name) const {
  if (const auto found = find(name)) return *found;
  return rt::fail_with(fmt::format("{}: no column {}", path_.string(), in_quotes(name)));
}

rt::Expected<double> CsvReader::number(std::size_t column) const {
  double value = 0.0;
  const std::errc error = parse(cells_[column], value);
  if (error == std::errc::result_out_of_range) return fail_cell(column, "is out of range");
  if (error != std::errc{}) return fail_cell(column, "is not a number");
  if (!std::isfinite(value)) return fail_cell(column, "is not finite");
  return value;
}

rt::Expected<std::int64_t> CsvReader::integer(std::size_t column) const {
  std::int64_t value = 0;
  const std::errc error = parse(cells_[column], value);
  if (error == std::errc::result_out_of_range) return fail_cell(column, "is out of range");
  if (error != std::errc{}) return fail_cell(column, "is not an integer");
  return value;
}

tl::unexpected<rt::Error> CsvReader::fail(std::string_view what) const {
  return rt::fail_with(fmt::format("{}:{}: {}", path_.string(), line_, what));
}

tl::unexpected<rt::Error> CsvReader::fail_cell(std::size_t column, std::string_view what) const {
  return fail(fmt::format("column {}: {} {}", header_[column], in_quotes(cells_[column]), what));
}

}  // namespace airworthy::importer
