#include "cli/import/commands.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include "cli/import/alfa.h"
#include "cli/import/summary.h"
#include "cli/import/table.h"
#include "cli/import/tlog.h"

namespace airworthy::importer {
namespace {

tl::unexpected<Failure> failed(int exit_code, rt::Error error) {
  return tl::unexpected<Failure>{Failure{exit_code, std::move(error)}};
}

/// The logs, or what is wrong with the input.
Logs imported(rt::Expected<std::vector<LogSummary>> logs) {
  if (!logs) return failed(EX_DATAERR, std::move(logs.error()));
  return std::move(*logs);
}

/// Makes the folder of a batch and tries whether its logs can be written, before any of the work.
Logs run_batch(const std::vector<BatchItem>& items, const std::filesystem::path& folder,
               const ImportOne& import_one) {
  std::error_code error;
  const bool is_new = std::filesystem::create_directories(folder, error);
  if (error) return failed(EX_CANTCREAT, {fmt::format("{}: {}", folder.string(), error.message())});
  for (const BatchItem& item : items) {
    const auto writer = rt::LogWriter::create(folder / (item.name + ".lcm"));
    if (!writer) return failed(EX_CANTCREAT, writer.error());
  }
  auto logs = imported(import_batch(items, folder, import_one));
  if (!logs && is_new) std::filesystem::remove(folder, error);  // only if it is empty
  return logs;
}

Logs run_alfa(const Request& request) {
  std::vector<BatchItem> items;
  for (const std::string& input : request.inputs) items.push_back({input, sequence_name(input)});
  const std::string vehicle = request.vehicle.empty() ? "alfa" : request.vehicle;
  return run_batch(items, request.output, [&](const auto& input, const auto& log, const auto& progress) {
    return import_alfa(input, log, vehicle, progress);
  });
}

Logs run_tlog(const Request& request) {
  drivers::MavlinkConfig config = default_mavlink_config();
  config.vehicle = "mavlink";
  if (!request.config.empty()) {
    auto loaded = drivers::MavlinkConfig::load(request.config, {});
    if (!loaded) return failed(EX_CONFIG, loaded.error());
    config = std::move(*loaded);
  }
  if (!request.vehicle.empty()) config.vehicle = request.vehicle;
  std::vector<BatchItem> items;
  for (const std::string& input : request.inputs) items.push_back({input, tlog_name(input)});
  return run_batch(items, request.output,
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
  if (!map) return failed(EX_CONFIG, map.error());
  Window window;
  if (request.from_s) window.from = TimePoint{from_seconds(*request.from_s)};
  if (request.until_s) window.until = TimePoint{from_seconds(*request.until_s)};
  const std::string vehicle = request.vehicle.empty() ? map->vehicle : request.vehicle;
  const std::string& input = request.inputs.front();
  if (const auto writer = rt::LogWriter::create(request.output); !writer) {
    return failed(EX_CANTCREAT, writer.error());
  }
  ProgressLine line;
  auto log = import_table(input, *map, window, vehicle, request.output, line.of(input, 0, 1));
  if (!log) return failed(EX_DATAERR, log.error());
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
