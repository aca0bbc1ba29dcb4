#include "cli/import/commands.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <cstdio>

#include "cli/import/alfa.h"
#include "cli/import/summary.h"
#include "cli/import/table.h"
#include "cli/import/tlog.h"

namespace airworthy::importer {
namespace {

Logs run_alfa(const Request& request) {
  std::vector<BatchItem> items;
  for (const std::string& input : request.inputs) items.push_back({input, sequence_name(input)});
  const std::string vehicle = request.vehicle.empty() ? "alfa" : request.vehicle;
  return import_batch(items, request.output, [&](const auto& input, const auto& log, const auto& progress) {
    return import_alfa(input, log, vehicle, progress);
  });
}

Logs run_tlog(const Request& request) {
  drivers::MavlinkConfig config = default_mavlink_config();
  config.vehicle = "mavlink";
  if (!request.config.empty()) {
    auto loaded = drivers::MavlinkConfig::load(request.config, {});
    if (!loaded) return tl::unexpected<rt::Error>{loaded.error()};
    config = std::move(*loaded);
  }
  if (!request.vehicle.empty()) config.vehicle = request.vehicle;
  std::vector<BatchItem> items;
  for (const std::string& input : request.inputs) items.push_back({input, tlog_name(input)});
  return import_batch(
      items, request.output,
      [&](const auto& input, const auto& log, const auto& progress) -> rt::Expected<LogSummary> {
        std::vector<Truth> truths;
        if (!request.truth.empty()) {
          auto indexed = read_index(request.truth, tlog_name(input));
          if (!indexed) return tl::unexpected<rt::Error>{indexed.error()};
          truths = std::move(*indexed);
        }
        return import_tlog(input, log, config, std::move(truths), progress);
      });
}

Logs run_table(const Request& request) {
  const auto map = ImportMap::load(request.map);
  if (!map) return tl::unexpected<rt::Error>{map.error()};
  Window window;
  if (request.from_s) window.from = TimePoint{from_seconds(*request.from_s)};
  if (request.until_s) window.until = TimePoint{from_seconds(*request.until_s)};
  const std::string vehicle = request.vehicle.empty() ? map->vehicle : request.vehicle;
  const std::string& input = request.inputs.front();
  ProgressLine line;
  auto log = import_table(input, *map, window, vehicle, request.output, line.of(input, 0, 1));
  if (!log) return tl::unexpected<rt::Error>{log.error()};
  return std::vector<LogSummary>{std::move(*log)};
}

}  // namespace

Logs run(const Request& request) {
  switch (request.kind) {
    case Kind::kAlfa:
      return run_alfa(request);
    case Kind::kTlog:
      return run_tlog(request);
    case Kind::kTable:
      break;
  }
  return run_table(request);
}

int report(const std::vector<LogSummary>& logs, const Request& request) {
  fmt::print("{}", request.json ? to_json(logs) : to_text(logs));
  return std::fflush(stdout) == 0 ? EX_OK : EX_IOERR;
}

}  // namespace airworthy::importer
