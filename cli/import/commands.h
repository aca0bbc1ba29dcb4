#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/import/batch.h"

namespace airworthy::importer {

enum class Kind : std::uint8_t { kAlfa, kTlog, kTable };

/// The command line of one import, whatever its kind.
struct Request {
  Kind kind = Kind::kAlfa;
  std::vector<std::string> inputs;
  std::string output;
  std::string vehicle;  ///< empty: the default of the kind
  bool json = false;
  std::string truth;             ///< of telemetry logs: table of faults, may be empty
  std::string config;            ///< of telemetry logs: the driver's, may be empty
  std::string map;               ///< of a table
  std::optional<double> from_s;  ///< of a table
  std::optional<double> until_s;
};

/// Why nothing was imported, and what the program ends with.
struct Failure {
  int exit_code;  ///< of sysexits.h
  rt::Error error;
};
using Logs = tl::expected<std::vector<LogSummary>, Failure>;

[[nodiscard]] Logs run(const Request& request);

/// Prints the summary on stdout and returns the exit code.
[[nodiscard]] int report(const std::vector<LogSummary>& logs, const Request& request);

}  // namespace airworthy::importer
