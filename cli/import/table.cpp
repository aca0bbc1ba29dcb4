#include "cli/import/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "cli/import/table_truth.h"

namespace airworthy::importer {
namespace {

namespace fs = std::filesystem;

/// The times at which a gate is open.
class Gate {
 public:
  [[nodiscard]] static rt::Expected<Gate> read(const fs::path& folder, const GateMap& map) {
    auto reader = CsvReader::open(folder / map.path, map.format);
    if (!reader) return tl::unexpected<rt::Error>{reader.error()};
    auto topic = Topic::open(std::move(*reader), map.time, {map.column});
    if (!topic) return tl::unexpected<rt::Error>{topic.error()};
    Gate gate;
    gate.reason_ = map.name;
    bool is_open = false;
    TimePoint since;
    TimePoint last;
    for (;;) {
      const auto more = topic->next();
      if (!more) return tl::unexpected<rt::Error>{more.error()};
      const bool passes =
          *more && std::find(map.values.begin(), map.values.end(), (*topic)[0]) != map.values.end();
      const bool is_after_gap = topic->time() - last > map.longest_gap;
      if (is_open && (!passes || is_after_gap)) {
        gate.open_.push_back({since, last});
        is_open = false;
      }
      if (!*more) return gate;
      last = topic->time();
      if (passes && !is_open) since = last;
      is_open = passes;
    }
  }

  [[nodiscard]] const std::string& reason() const { return reason_; }

  /// Times of calls must not go backward.
  [[nodiscard]] bool is_open(TimePoint t) {
    while (next_ < open_.size() && open_[next_][1] < t) ++next_;
    return next_ < open_.size() && open_[next_][0] <= t;
  }

 private:
  std::string reason_;
  std::vector<std::array<TimePoint, 2>> open_;
  std::size_t next_ = 0;
};

/// A term by the place of its column among those that are read.
struct BoundTerm {
  std::size_t column;
  double scale;
};

/// One message of a table.
class BoundMessage {
 public:
  /// Adds the columns it needs to `columns`.
  BoundMessage(const MessageMap& map, std::vector<std::string>& columns)
      : map_{map}, builder_{MessageBuilder::of(map.channel)} {
    for (const FieldMap& field : map.fields) {
      std::vector<BoundTerm> terms;
      for (const Term& term : field.terms) terms.push_back({place(term.column, columns), term.scale});
      terms_.push_back(std::move(terms));
    }
    for (const std::string& column : map.only_on_change) watched_.push_back(place(column, columns));
    last_.resize(watched_.size());
  }

  void publish(const Topic& row, FlightLog& log) {
    if (!watched_.empty() && !has_changed(row)) {
      log.leave_out(map_.channel + ", repeated");
      return;
    }
    builder_->clear(map_.rotors);
    for (std::size_t i = 0; i < terms_.size(); ++i) builder_->set(map_.fields[i].slot, value(i, row));
    builder_->publish(log, row.time());
  }

 private:
  static std::size_t place(const std::string& column, std::vector<std::string>& columns) {
    const auto found = std::find(columns.begin(), columns.end(), column);
    if (found != columns.end()) return static_cast<std::size_t>(found - columns.begin());
    columns.push_back(column);
    return columns.size() - 1;
  }

  bool has_changed(const Topic& row) {
    bool changed = !has_last_;
    for (std::size_t i = 0; i < watched_.size(); ++i) {
      const double now = row[watched_[i]];
      changed = changed || (now != last_[i] && !(std::isnan(now) && std::isnan(last_[i])));
      last_[i] = now;
    }
    has_last_ = true;
    return changed;
  }

  double value(std::size_t i, const Topic& row) const {
    const FieldMap& field = map_.fields[i];
    if (field.constant) return *field.constant;
    double sum = 0.0;
    for (const BoundTerm& term : terms_[i]) {
      const double part = term.scale * row[term.column];
      sum += field.norm ? part * part : part;
    }
    if (field.norm) sum = std::sqrt(sum);
    const double converted = sum * field.conversion.factor + field.conversion.offset + field.offset;
    return std::isnan(converted) ? converted : std::clamp(converted, field.min, field.max);
  }

  const MessageMap& map_;
  std::unique_ptr<MessageBuilder> builder_;
  std::vector<std::vector<BoundTerm>> terms_;
  std::vector<std::size_t> watched_;
  std::vector<double> last_;
  bool has_last_ = false;
};

class TableFeed final : public Feed {
 public:
  [[nodiscard]] static rt::Expected<std::unique_ptr<TableFeed>> open(const fs::path& path,
                                                                     const TableMap& map,
                                                                     std::vector<Gate> gates,
                                                                     const Window& window) {
    std::vector<std::string> columns;
    std::vector<std::unique_ptr<BoundMessage>> messages;
    for (const MessageMap& message : map.messages) {
      messages.push_back(std::make_unique<BoundMessage>(message, columns));
    }
    auto reader = CsvReader::open(path, map.format);
    if (!reader) return tl::unexpected<rt::Error>{reader.error()};
    auto topic = Topic::open(std::move(*reader), map.time, columns, EmptyCell::kUnknown);
    if (!topic) return tl::unexpected<rt::Error>{topic.error()};
    return std::unique_ptr<TableFeed>{
        new TableFeed{std::move(*topic), std::move(messages), std::move(gates), window}};
  }

  rt::Expected<bool> next() override {
    for (;;) {
      auto more = topic_.next();
      if (!more || !*more) return more;
      if (window_.until && topic_.time() > *window_.until) continue;
      if (!window_.from || topic_.time() >= *window_.from) return true;
    }
  }
  TimePoint time() const override { return topic_.time(); }
  std::uint64_t position() const override { return topic_.reader().position(); }
  std::uint64_t size() const override { return topic_.reader().size(); }

  void publish(FlightLog& log) override {
    for (Gate& gate : gates_) {
      if (!gate.is_open(time())) {
        log.leave_out(
            fmt::format("rows of {}, {}", topic_.reader().path().filename().string(), gate.reason()));
        return;
      }
    }
    for (const auto& message : messages_) message->publish(topic_, log);
  }

 private:
  TableFeed(Topic topic, std::vector<std::unique_ptr<BoundMessage>> messages, std::vector<Gate> gates,
            const Window& window)
      : topic_{std::move(topic)}, messages_{std::move(messages)}, gates_{std::move(gates)}, window_{window} {}

  Topic topic_;
  std::vector<std::unique_ptr<BoundMessage>> messages_;
  std::vector<Gate> gates_;
  Window window_;
};

// What of the truth concerns the window: a fault that has ended before it does not, one that lasts is there
// from its start.
std::vector<Truth> inside(const std::vector<Truth>& truths, const Window& window) {
  std::vector<Truth> result;
  for (auto truth = truths.begin(); truth != truths.end(); ++truth) {
    if (window.until && truth->time && *truth->time > *window.until) continue;
    const bool is_past = window.from && truth->time && *truth->time < *window.from;
    const auto is_its_end = [&](const Truth& other) {
      return other.component == truth->component && other.fault_kind == kNoFault && other.time &&
             *other.time < *window.from;
    };
    if (is_past && (truth->fault_kind == kNoFault || std::any_of(truth, truths.end(), is_its_end))) continue;
    result.push_back(*truth);
  }
  return result;
}

}  // namespace

rt::Expected<LogSummary> import_table(const fs::path& input, const ImportMap& map, const Window& window,
                                      const std::string& vehicle, const fs::path& log_path,
                                      const Progress& progress) {
  std::error_code error;
  if (map.is_folder() && !fs::is_directory(input, error)) {
    return rt::fail_with(input.string() + ": not a folder, and the map is for a folder of tables");
  }
  auto truths = read_truth(input, map);
  if (!truths) return tl::unexpected<rt::Error>{truths.error()};
  const fs::path folder = map.is_folder() ? input : input.parent_path();
  std::vector<Gate> gates;
  for (const GateMap& gate_map : map.gates) {
    auto gate = Gate::read(folder, gate_map);
    if (!gate) return tl::unexpected<rt::Error>{gate.error()};
    gates.push_back(std::move(*gate));
  }
  std::vector<std::unique_ptr<Feed>> feeds;
  for (const TableMap& table : map.tables) {
    const fs::path path = table.path.empty() ? input : input / table.path;
    auto feed = TableFeed::open(path, table, gates, window);
    if (!feed) return tl::unexpected<rt::Error>{feed.error()};
    feeds.push_back(std::move(*feed));
  }
  auto log = FlightLog::create(log_path, vehicle);
  if (!log) return tl::unexpected<rt::Error>{log.error()};
  if (const auto merged = merge(feeds, inside(*truths, window), **log, progress); !merged) {
    return tl::unexpected<rt::Error>{merged.error()};
  }
  return (*log)->commit();
}

}  // namespace airworthy::importer
