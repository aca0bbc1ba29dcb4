// The configuration loader on arbitrary bytes: the file, and after each record separator (0x1e) one override.
// Whatever they are, reading must end, and end in a value or in error lines of the documented form.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/config/config_file.h"
#include "runtime/config/vehicle.h"

namespace {

using airworthy::rt::ConfigFile;
using airworthy::rt::ConfigTable;
using airworthy::rt::Count;
using airworthy::rt::Range;
using airworthy::rt::VehicleFile;

constexpr std::string_view kFile = "f.toml";

void require(bool holds) {
  if (!holds) std::abort();
}

void read_table(ConfigTable table, int depth) {
  (void)table.required<std::string>("name");
  (void)table.optional<double>("a", 0.5, Range{0.0, 1.0});
  (void)table.if_present<std::uint8_t>("b", Range::at_least(1));
  (void)table.required<std::int64_t>("c");
  (void)table.optional<bool>("d", true);
  (void)table.required<std::vector<double>>("e", Range{}.or_not_finite(), Count{1, 4});
  (void)table.optional<std::vector<std::vector<double>>>("f", {{1.0}});
  (void)table.optional<std::array<double, 3>>("g", {});
  (void)table.choice<int>("h", {{"low", 1}, {"high", 2}});
  (void)table.optional_path("i", "x");
  table.fail("t[1].name", "does not fit", {"a"});
  if (depth == 0) return;
  read_table(table.table("s"), depth - 1);
  (void)table.optional_table("o");
  for (ConfigTable element : table.tables("t", {.unique_key = "name", .count = Count::at_most(3)})) {
    read_table(element, depth - 1);
  }
}

/// The errors and the hash after reading everything.
std::string outcome(std::string_view text, const std::vector<std::string>& overrides) {
  auto file = ConfigFile::parse(text, kFile, overrides);
  read_table(file.root(), 2);
  const auto result = file.finish(0);
  return file.hash() + '\n' + (result ? "" : result.error().text);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string input(data, data + size);
  std::string_view rest{input};
  const auto next = [&rest] {
    const std::size_t end = std::min(rest.find('\x1e'), rest.size());
    const std::string_view part = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    return part;
  };
  const std::string_view text = next();
  std::vector<std::string> overrides;
  while (!rest.empty()) overrides.emplace_back(next());

  const std::string result = outcome(text, overrides);
  require(result == outcome(text, overrides));
  std::string_view lines{result};
  require(lines.find('\n') == 16);
  lines.remove_prefix(17);
  while (!lines.empty()) {
    const std::string_view line = lines.substr(0, lines.find('\n'));
    require(line.starts_with("f.toml:") || line.starts_with("--set "));
    for (const char c : line) require(static_cast<unsigned char>(c) >= 0x20 && c != '\x7f');
    lines.remove_prefix(std::min(line.size() + 1, lines.size()));
  }
  (void)VehicleFile::read(ConfigFile::parse(text, kFile, overrides));
  return 0;
}
