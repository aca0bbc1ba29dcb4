#include "cli/import/table_map.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "cli/import/feed.h"
#include "runtime/config/config_file.h"
#include "runtime/config/vehicle.h"

namespace airworthy::importer {
namespace {

using rt::ConfigTable;

TimeColumn read_time(ConfigTable table) {
  using Unit = TimeColumn::Unit;
  TimeColumn time;
  time.name = table.required<std::string>("column");
  time.unit = table.choice<Unit>("unit", {{"s", Unit::kSeconds},
                                          {"ms", Unit::kMilliseconds},
                                          {"us", Unit::kMicroseconds},
                                          {"ns", Unit::kNanoseconds}});
  time.base = from_seconds(table.optional<double>("base_s", 0.0, rt::Range{0.0, 1e10}));
  return time;
}

CsvFormat read_format(ConfigTable table) {
  CsvFormat format;
  const auto delimiter = table.optional<std::string>("delimiter", ",");
  if (delimiter.size() == 1 && delimiter != "\"" && delimiter != "\n") {
    format.delimiter = delimiter.front();
  } else {
    table.fail("delimiter", "must be one character other than a quote");
  }
  format.skip_lines = table.optional<int>("skip_lines", 0, rt::Range{0, 1000});
  format.header = table.optional<std::vector<std::string>>("header", {});
  return format;
}

void read_field(ConfigTable table, const MessageBuilder& builder, MessageMap& message) {
  FieldMap field;
  const auto name = table.required<std::string>("field");
  const auto slot = builder.find(name);
  if (!slot) {
    table.fail("field", fmt::format("{} has no such field, or the element is missing or out of range",
                                    message.channel));
  } else {
    field.slot = *slot;
    if (builder.is_per_rotor(*slot)) message.rotors = std::max(message.rotors, slot->element + 1);
  }

  field.constant = table.if_present<double>("value", rt::Range{}.or_not_finite());
  const auto column = table.if_present<std::string>("column");
  const auto norm = table.optional<std::vector<std::string>>("norm", {});
  const double scale = table.optional<double>("scale", 1.0);
  if (column) field.terms.push_back({*column, scale});
  for (const std::string& part : norm) field.terms.push_back({part, scale});
  field.norm = !norm.empty();
  const auto sum = table.tables("sum");
  for (ConfigTable part : sum) {
    field.terms.push_back(
        {part.required<std::string>("column"), scale * part.optional<double>("scale", 1.0)});
  }
  const int sources =
      (field.constant ? 1 : 0) + (column ? 1 : 0) + (norm.empty() ? 0 : 1) + (sum.empty() ? 0 : 1);
  if (sources != 1) table.fail("field", "needs exactly one of value, column, sum and norm");

  if (const auto unit = table.if_present<std::string>("unit"); unit && slot) {
    const std::string_view target = builder.unit(*slot);
    const auto conversion = find_conversion(*unit, target);
    if (conversion) {
      field.conversion = *conversion;
    } else {
      table.fail("unit", fmt::format("{} takes one of {}", name, fmt::join(units_for(target), ", ")));
    }
  }
  field.offset = table.optional<double>("offset", 0.0);
  field.min = table.optional<double>("min", field.min, rt::Range{}.or_not_finite());
  field.max = table.optional<double>("max", field.max, rt::Range{}.or_not_finite());
  if (!(field.min <= field.max)) table.fail("min", "must not exceed max", {"max"});
  message.fields.push_back(std::move(field));
}

MessageMap read_message(ConfigTable table) {
  MessageMap message;
  message.channel = table.required<std::string>("channel");
  const auto builder = MessageBuilder::of(message.channel);
  if (!builder) {
    table.fail("channel", fmt::format("must be one of {}", fmt::join(MessageBuilder::channels(), ", ")));
    return message;
  }
  for (const ConfigTable& field : table.tables("fields", {"field", rt::Count::at_least(1)})) {
    read_field(field, *builder, message);
  }
  message.only_on_change = table.optional<std::vector<std::string>>("only_on_change", {});
  return message;
}

TableMap read_table(ConfigTable table) {
  TableMap map;
  map.path = table.optional<std::string>("path", "");
  map.format = read_format(table);
  map.time = read_time(table.required_table("time"));
  for (const ConfigTable& message : table.tables("message", {{}, rt::Count::at_least(1)})) {
    map.messages.push_back(read_message(message));
  }
  return map;
}

GateMap read_gate(ConfigTable table) {
  GateMap gate;
  gate.name = table.required<std::string>("name");
  gate.path = table.required<std::string>("path");
  gate.format = read_format(table);
  gate.time = read_time(table.required_table("time"));
  gate.column = table.required<std::string>("column");
  gate.values = table.required<std::vector<double>>("values", {}, rt::Count::at_least(1));
  gate.longest_gap = from_seconds(table.required<double>("longest_gap_s", rt::Range{0.0, 3600.0}));
  return gate;
}

FixedTruth read_fixed_truth(ConfigTable table) {
  FixedTruth truth;
  truth.component = table.optional<std::string>("component", "");
  truth.fault_kind = table.required<std::string>("fault_kind");
  truth.onset_s = table.if_present<double>("onset_s", rt::Range{0.0, 1e10});
  truth.magnitude = table.optional<double>("magnitude", truth.magnitude, rt::Range{}.or_not_finite());
  if (truth.fault_kind == kNoFault && truth.onset_s) table.fail("onset_s", "a healthy flight has no onset");
  if (truth.fault_kind != kNoFault && truth.component.empty()) {
    table.fail("component", "a fault needs a component", {"fault_kind"});
  }
  return truth;
}

WordMap read_words(ConfigTable table) {
  WordMap map;
  map.column = table.optional<std::string>("column", "");
  map.constant = table.optional<std::string>("value", "");
  for (ConfigTable word : table.tables("words", {"cell"})) {
    map.words.emplace_back(word.required<std::string>("cell"), word.required<std::string>("means"));
  }
  if (map.column.empty() == map.constant.empty())
    table.fail("column", "needs exactly one of column and value");
  return map;
}

TruthIndex read_truth_index(ConfigTable table) {
  TruthIndex index;
  index.path = table.required<std::string>("path");
  index.key_column = table.required<std::string>("key_column");
  index.component = read_words(table.required_table("component"));
  index.fault_kind = read_words(table.required_table("fault_kind"));
  if (auto onset = table.optional_table("onset")) index.onset = read_time(*onset);
  if (auto magnitude = table.optional_table("magnitude")) {
    index.magnitude_column = magnitude->required<std::string>("column");
    index.magnitude_scale = magnitude->optional<double>("scale", 1.0);
    index.magnitude_offset = magnitude->optional<double>("offset", 0.0);
  }
  return index;
}

TruthSetting read_truth_setting(ConfigTable table) {
  TruthSetting setting;
  setting.path = table.required<std::string>("path");
  setting.time = read_time(table.required_table("time"));
  setting.name_column = table.required<std::string>("name_column");
  setting.name = table.required<std::string>("name");
  setting.value_column = table.required<std::string>("value_column");
  setting.healthy = table.required<std::array<double, 2>>("healthy");
  if (setting.healthy[0] > setting.healthy[1])
    table.fail("healthy", "must be the lowest, then the highest value");
  setting.confirmed_column = table.optional<std::string>("confirmed_column", "");
  setting.confirmed_word = table.optional<std::string>("confirmed_word", "");
  setting.component = table.required<std::string>("component");
  setting.fault_kind = table.required<std::string>("fault_kind");
  if (auto magnitude = table.optional_table("magnitude")) {
    setting.magnitude_scale = magnitude->optional<double>("scale", 1.0);
    setting.magnitude_offset = magnitude->optional<double>("offset", 0.0);
  }
  return setting;
}

}  // namespace

rt::Expected<ImportMap> ImportMap::load(const std::filesystem::path& path) {
  auto file = rt::ConfigFile::load(path);
  ConfigTable root = file.root();
  ImportMap map;
  map.vehicle = root.required<std::string>("vehicle");
  if (!rt::VehicleFile::is_valid_name(map.vehicle)) {
    root.fail("vehicle", fmt::format("must be 1 to {} of A-Z a-z 0-9 _ -", rt::VehicleFile::kMaxNameLength));
  }
  for (const ConfigTable& table : root.tables("table", {{}, rt::Count::at_least(1)}))
    map.tables.push_back(read_table(table));
  const auto is_file_itself = [](const TableMap& table) { return table.path.empty(); };
  if (map.tables.size() > 1 && std::any_of(map.tables.begin(), map.tables.end(), is_file_itself)) {
    root.fail("table", "several tables need a path each, in the folder that is imported");
  }
  for (const ConfigTable& gate : root.tables("gate", {"name"})) map.gates.push_back(read_gate(gate));
  for (const ConfigTable& truth : root.tables("truth")) map.truths.push_back(read_fixed_truth(truth));
  if (auto index = root.optional_table("truth_index")) map.truth_index = read_truth_index(*index);
  for (const ConfigTable& setting : root.tables("truth_setting"))
    map.truth_settings.push_back(read_truth_setting(setting));
  return file.finish(std::move(map));
}

}  // namespace airworthy::importer
