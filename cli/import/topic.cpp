#include "cli/import/topic.h"

#include <fmt/format.h>

#include <limits>

namespace airworthy::importer {
namespace {

// Vehicle times fit 2^53 µs, 285 years, so that a double holds them to the microsecond.
constexpr double kLatest_us = 9'007'199'254'740'992.0;

double us_of(TimeColumn::Unit unit) {
  switch (unit) {
    case TimeColumn::Unit::kSeconds:
      return 1e6;
    case TimeColumn::Unit::kMilliseconds:
      return 1e3;
    case TimeColumn::Unit::kMicroseconds:
      return 1.0;
    case TimeColumn::Unit::kNanoseconds:
      return 1e-3;
  }
  return 1.0;
}

}  // namespace

rt::Expected<TimePoint> TimeColumn::read(const CsvReader& row, std::size_t column) const {
  // Nanoseconds since 1970 do not fit a double, so they are divided as integers.
  if (unit == Unit::kNanoseconds) {
    const auto ns = row.integer(column);
    if (!ns) return tl::unexpected<rt::Error>{ns.error()};
    if (*ns < 0) return row.fail_cell(column, "is before time 0");
    return from_us(*ns / 1000) + base;
  }
  const auto value = row.number(column);
  if (!value) return tl::unexpected<rt::Error>{value.error()};
  const double us = std::round(*value * us_of(unit));
  if (us < 0.0) return row.fail_cell(column, "is before time 0");
  if (us > kLatest_us) return row.fail_cell(column, "is out of range");
  return from_us(static_cast<std::int64_t>(us)) + base;
}

rt::Expected<Topic> Topic::open(CsvReader reader, const TimeColumn& time,
                                const std::vector<std::string>& columns, EmptyCell empty_cell) {
  Topic topic{std::move(reader)};
  topic.empty_cell_ = empty_cell;
  topic.time_column_ = time;
  const auto time_index = topic.reader_.column(time.name);
  if (!time_index) return tl::unexpected<rt::Error>{time_index.error()};
  topic.time_index_ = *time_index;
  for (const std::string& name : columns) {
    const auto index = topic.reader_.column(name);
    if (!index) return tl::unexpected<rt::Error>{index.error()};
    topic.indices_.push_back(*index);
  }
  topic.values_.resize(columns.size());
  return topic;
}

rt::Expected<bool> Topic::next() {
  auto more = reader_.next();
  if (!more || !*more) return more;
  const auto time = time_column_.read(reader_, time_index_);
  if (!time) return tl::unexpected<rt::Error>{time.error()};
  if (has_time_ && *time < time_) {
    return reader_.fail(
        fmt::format("time goes backward by {:.6f} s: rows are out of order", to_seconds(time_ - *time)));
  }
  time_ = *time;
  has_time_ = true;
  for (std::size_t i = 0; i < indices_.size(); ++i) {
    if (empty_cell_ == EmptyCell::kUnknown && reader_.text(indices_[i]).empty()) {
      values_[i] = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    const auto value = reader_.number(indices_[i]);
    if (!value) return tl::unexpected<rt::Error>{value.error()};
    values_[i] = *value;
  }
  return true;
}

}  // namespace airworthy::importer
