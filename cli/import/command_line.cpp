#include "cli/import/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>

#include "runtime/config/vehicle.h"
#include "runtime/process/command_line.h"

namespace airworthy::importer {

namespace {

/// Vehicle time is a count of microseconds in 64 bits: no more than 292 thousand years.
constexpr rt::Range kMoment_s{0.0, 9e12};

}  // namespace

tl::expected<Request, int> parse_command_line(int argc, const char* const* argv) {
  CLI::App app{
      "Turns recorded flights of other kinds into LCM logs.\n"
      "Exit code 0: done; 64: wrong arguments; 65: input that is not as it should be, or a disk that ran "
      "full; 73: "
      "a log that cannot be begun where it is to be; 78: wrong configuration or map.",
      "airworthy import"};
  app.set_version_flag("--version", AIRWORTHY_VERSION);
  app.require_subcommand(0, 1);
  Request request;
  const auto vehicle_name = [](const std::string& name) {
    return rt::VehicleFile::is_valid_name(name) ? std::string{}
                                                : std::string{"must be 1 to 16 of A-Z a-z 0-9 _ -"};
  };
  const auto common = [&](CLI::App* command, const char* default_vehicle) {
    command
        ->add_option("--vehicle", request.vehicle,
                     std::string{"vehicle's name in the log; default "} + default_vehicle)
        ->check(vehicle_name);
    command->add_flag("--json", request.json, "print the summary as a JSON object");
  };

  CLI::App* alfa = app.add_subcommand("alfa", "sequences of the ALFA data set, a folder of CSV files each");
  alfa->add_option("DIR", request.inputs, "folder of one sequence")->required();
  alfa->add_option("-o,--output", request.output, "folder for the logs, <sequence>.lcm each")->required();
  common(alfa, "alfa");

  CLI::App* tlog = app.add_subcommand("tlog", "MAVLink telemetry logs of a ground station");
  tlog->add_option("FILE", request.inputs, ".tlog or .tlog.xz")->required();
  tlog->add_option("-o,--output", request.output, "folder for the logs, <name>.lcm each")->required();
  tlog->add_option("--truth", request.truth, "CSV file with columns sequence, fault, fault_onset_ns");
  tlog->add_option("--config", request.config,
                   "configuration of airworthy-mavlink, such as config/mavlink.toml");
  common(tlog, "mavlink, or that of --config");

  CLI::App* table = app.add_subcommand("table", "a CSV file, or a folder of them, by a mapping file");
  table->add_option("FILE", request.inputs, "CSV file, or folder where the map names several")
      ->required()
      ->expected(1);
  table->add_option("--map", request.map, "mapping file, such as those in config/import")->required();
  table->add_option("-o,--output", request.output, "log to write")->required();
  table->add_option("--from", request.from_s, "first moment to import, s of vehicle time")
      ->check(rt::is_number(kMoment_s));
  table->add_option("--until", request.until_s, "last moment to import, s of vehicle time")
      ->check(rt::is_number(kMoment_s));
  common(table, "that of the map");

  const std::array kinds{alfa, tlog, table};
  const bool is_kind = argc > 1 && std::any_of(kinds.begin(), kinds.end(), [argv](const CLI::App* kind) {
                         return kind->get_name() == argv[1];
                       });
  if (argc > 1 && argv[1][0] != '-' && !is_kind) {
    return tl::unexpected<int>{
        rt::wrong_usage(fmt::format("\"{}\" cannot be imported; there are alfa, tlog and table", argv[1]))};
  }
  if (const auto ended = rt::parse_command_line(app, argc, argv)) return tl::unexpected<int>{*ended};
  if (app.get_subcommands().empty()) {
    return tl::unexpected<int>{rt::wrong_usage("what to import is missing: alfa, tlog or table")};
  }
  if (request.from_s && request.until_s && *request.until_s < *request.from_s) {
    return tl::unexpected<int>{
        rt::wrong_usage(fmt::format("--until: {} is before --from ({})", *request.until_s, *request.from_s))};
  }
  request.kind = alfa->parsed() ? Kind::kAlfa : tlog->parsed() ? Kind::kTlog : Kind::kTable;
  return request;
}

}  // namespace airworthy::importer
