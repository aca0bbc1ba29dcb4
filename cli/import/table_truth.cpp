#include "cli/import/table_truth.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

namespace airworthy::importer {
namespace {

namespace fs = std::filesystem;

fs::path folder_of(const fs::path& input, const ImportMap& map) {
  return map.is_folder() ? input : input.parent_path();
}

// Whether the last parts of the path are those of the key.
bool ends_with(const fs::path& path, const fs::path& key) {
  const fs::path whole = fs::absolute(path).lexically_normal();
  const fs::path normal = whole.has_filename() ? whole : whole.parent_path();
  const auto parts = std::distance(key.begin(), key.end());
  if (parts == 0 || std::distance(normal.begin(), normal.end()) < parts) return false;
  return std::equal(key.begin(), key.end(), std::prev(normal.end(), parts));
}

rt::Expected<std::string> meaning(const CsvReader& reader, const WordMap& map, std::string_view cell) {
  if (map.column.empty()) return map.constant;
  if (map.words.empty()) return std::string{cell};
  for (const auto& [word, means] : map.words) {
    if (word == cell) return means;
  }
  return reader.fail(fmt::format("column {}: the map has no meaning for \"{}\"", map.column, cell));
}

rt::Expected<std::string_view> cell_of(const CsvReader& reader, const WordMap& map) {
  if (map.column.empty()) return std::string_view{};
  const auto column = reader.column(map.column);
  if (!column) return tl::unexpected<rt::Error>{column.error()};
  return reader.text(*column);
}

// The components of a cell, one after the other; without a column the constant one.
rt::Expected<std::vector<std::string>> components_of(const CsvReader& reader, const WordMap& map) {
  const auto cell = cell_of(reader, map);
  if (!cell) return tl::unexpected<rt::Error>{cell.error()};
  std::vector<std::string> components;
  if (map.column.empty()) {
    components.push_back(map.constant);
    return components;
  }
  std::istringstream words{std::string{*cell}};
  for (std::string word; words >> word;) {
    auto component = meaning(reader, map, word);
    if (!component) return tl::unexpected<rt::Error>{component.error()};
    components.push_back(std::move(*component));
  }
  if (components.empty()) {
    auto component = meaning(reader, map, "");
    if (!component) return tl::unexpected<rt::Error>{component.error()};
    components.push_back(std::move(*component));
  }
  return components;
}

rt::Expected<std::vector<Truth>> truth_of_row(const CsvReader& reader, const TruthIndex& index) {
  const auto cell = cell_of(reader, index.fault_kind);
  if (!cell) return tl::unexpected<rt::Error>{cell.error()};
  const auto kind = meaning(reader, index.fault_kind, *cell);
  if (!kind) return tl::unexpected<rt::Error>{kind.error()};
  if (*kind == kNoFault) return std::vector<Truth>{Truth{"", kNoFault, {}, {}}};

  Truth truth{"", *kind, {}, {}};
  if (index.onset) {
    const auto column = reader.column(index.onset->name);
    if (!column) return tl::unexpected<rt::Error>{column.error()};
    const auto time = index.onset->read(reader, *column);
    if (!time) return tl::unexpected<rt::Error>{time.error()};
    truth.time = *time;
  }
  if (!index.magnitude_column.empty()) {
    const auto column = reader.column(index.magnitude_column);
    if (!column) return tl::unexpected<rt::Error>{column.error()};
    const auto value = reader.number(*column);
    if (!value) return tl::unexpected<rt::Error>{value.error()};
    truth.magnitude = *value * index.magnitude_scale + index.magnitude_offset;
  }
  const auto components = components_of(reader, index.component);
  if (!components) return tl::unexpected<rt::Error>{components.error()};
  std::vector<Truth> truths;
  for (const std::string& component : *components) {
    truth.component = component;
    truths.push_back(truth);
  }
  return truths;
}

rt::Expected<std::vector<Truth>> read_index(const fs::path& input, const fs::path& folder,
                                            const TruthIndex& index) {
  const fs::path path = (folder / index.path).lexically_normal();
  auto reader = CsvReader::open(path);
  if (!reader) return tl::unexpected<rt::Error>{reader.error()};
  const auto key = reader->column(index.key_column);
  if (!key) return tl::unexpected<rt::Error>{key.error()};
  for (;;) {
    const auto more = reader->next();
    if (!more) return tl::unexpected<rt::Error>{more.error()};
    if (!*more) return rt::fail_with(fmt::format("{}: has no row for {}", path.string(), input.string()));
    if (ends_with(input, reader->text(*key))) return truth_of_row(*reader, index);
  }
}

rt::Expected<void> read_setting(const fs::path& folder, const TruthSetting& setting,
                                std::vector<Truth>& truths) {
  auto reader = CsvReader::open(folder / setting.path);
  if (!reader) return tl::unexpected<rt::Error>{reader.error()};
  const auto name = reader->column(setting.name_column);
  if (!name) return tl::unexpected<rt::Error>{name.error()};
  const auto value_column = reader->column(setting.value_column);
  if (!value_column) return tl::unexpected<rt::Error>{value_column.error()};
  const std::string& confirmed_name =
      setting.confirmed_column.empty() ? setting.name_column : setting.confirmed_column;
  const auto confirmed = reader->column(confirmed_name);
  if (!confirmed) return tl::unexpected<rt::Error>{confirmed.error()};
  auto topic = Topic::open(std::move(*reader), setting.time, {setting.value_column});
  if (!topic) return tl::unexpected<rt::Error>{topic.error()};

  bool faulty = false;
  for (;;) {
    const auto more = topic->next();
    if (!more) return tl::unexpected<rt::Error>{more.error()};
    if (!*more) return {};
    if (topic->reader().text(*name) != setting.name) continue;
    const double value = (*topic)[0];
    const bool is_healthy = value >= setting.healthy[0] && value <= setting.healthy[1];
    const bool is_confirmed =
        setting.confirmed_column.empty() || topic->reader().text(*confirmed) == setting.confirmed_word;
    if (!faulty && !is_healthy) {
      faulty = true;
      truths.push_back({setting.component,
                        setting.fault_kind,
                        topic->time(),
                        {},
                        value * setting.magnitude_scale + setting.magnitude_offset});
    } else if (faulty && is_healthy && is_confirmed) {
      faulty = false;
      truths.push_back({setting.component, kNoFault, topic->time(), {}});
    }
  }
}

}  // namespace

rt::Expected<std::vector<Truth>> read_truth(const fs::path& input, const ImportMap& map) {
  std::vector<Truth> truths;
  for (const FixedTruth& fixed : map.truths) {
    Truth truth{fixed.component, fixed.fault_kind, {}, {}, fixed.magnitude};
    if (fixed.onset_s) truth.after_start = from_seconds(*fixed.onset_s);
    truths.push_back(std::move(truth));
  }
  const fs::path folder = folder_of(input, map);
  if (map.truth_index) {
    auto indexed = read_index(input, folder, *map.truth_index);
    if (!indexed) return indexed;
    std::move(indexed->begin(), indexed->end(), std::back_inserter(truths));
  }
  for (const TruthSetting& setting : map.truth_settings) {
    if (const auto read = read_setting(folder, setting, truths); !read) {
      return tl::unexpected<rt::Error>{read.error()};
    }
  }
  return truths;
}

}  // namespace airworthy::importer
