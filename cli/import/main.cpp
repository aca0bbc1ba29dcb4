#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "cli/import/alfa.h"
#include "cli/import/batch.h"
#include "cli/import/summary.h"
#include "runtime/config/vehicle.h"
#include "runtime/process/exit.h"

int main(int argc, char** argv) {
  using namespace airworthy;
  std::vector<std::string> inputs;
  std::string output;
  std::string vehicle = "alfa";
  bool json = false;

  CLI::App app{
      "Turns recorded flights of other kinds into LCM logs.\n"
      "Exit code 0: done; 64: wrong arguments; 65: input or output that is not as it should be.",
      "airworthy import"};
  app.set_version_flag("--version", AIRWORTHY_VERSION);
  app.require_subcommand(1);
  CLI::App* alfa = app.add_subcommand("alfa", "sequences of the ALFA data set, a folder of CSV files each");
  alfa->add_option("DIR", inputs, "folder of one sequence")->required();
  alfa->add_option("-o,--output", output, "folder for the logs, <sequence>.lcm each")->required();
  alfa->add_option("--vehicle", vehicle, "name of the vehicle in the log")->capture_default_str();
  alfa->add_flag("--json", json, "print the summary as a JSON object");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? EX_OK : EX_USAGE;
  }
  if (!rt::VehicleFile::is_valid_name(vehicle)) {
    return rt::fail(EX_USAGE, {"--vehicle: must be 1 to 16 of A-Z a-z 0-9 _ -"});
  }

  importer::stop_on_signals();
  std::vector<importer::BatchItem> items;
  for (const std::string& input : inputs) items.push_back({input, importer::sequence_name(input)});
  const auto logs =
      importer::import_batch(items, output, [&](const auto& input, const auto& log, const auto& progress) {
        return importer::import_alfa(input, log, vehicle, progress);
      });
  if (!logs) return rt::fail(EX_DATAERR, logs.error());
  std::cout << (json ? importer::to_json(*logs) : importer::to_text(*logs));
  return EX_OK;
}
