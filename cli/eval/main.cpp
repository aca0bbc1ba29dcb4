#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "cli/eval/flight_run.h"
#include "cli/eval/report.h"
#include "runtime/process/exit.h"

namespace {

using namespace airworthy;

std::vector<std::optional<rt::Expected<eval::Flight>>> run_all(const std::vector<std::string>& logs,
                                                               const response::ResponseConfig& config,
                                                               unsigned jobs) {
  std::vector<std::optional<rt::Expected<eval::Flight>>> flights(logs.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < logs.size(); i = next++) flights[i] = eval::run_flight(logs[i], config);
  };
  std::vector<std::jthread> workers;
  for (unsigned i = 0; i < jobs; ++i) workers.emplace_back(work);
  return workers.clear(), flights;
}

int run(int argc, char** argv) {
  CLI::App app{
      "Runs the configured detectors over recorded flights, on message time, and scores them against the "
      "truth "
      "in the logs.",
      "airworthy eval"};
  std::vector<std::string> logs;
  std::string config_path;
  std::vector<std::string> overrides;
  bool json = false;
  unsigned jobs = std::max(1U, std::thread::hardware_concurrency());
  app.add_option("LOG", logs, "LCM logs, for example from 'airworthy import'")->required();
  app.add_option("--config", config_path, "configuration of airworthy-response")->required();
  app.add_option("--set", overrides, "override of a key, as KEY=VALUE; repeatable")->allow_extra_args(false);
  app.add_flag("--json", json, "print JSON instead of a table");
  app.add_option("--jobs", jobs, "flights evaluated at a time")->check(CLI::Range(1U, 256U));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? EX_OK : EX_USAGE;
  }
  const auto config = response::ResponseConfig::load(config_path, overrides);
  if (!config) return rt::fail(EX_CONFIG, config.error());

  eval::Evaluation evaluation;
  int failures = 0;
  for (auto& flight : run_all(logs, *config, jobs)) {
    if (!*flight) {
      failures = rt::fail(EX_DATAERR, flight->error());
      continue;
    }
    evaluation.scores.push_back(eval::score(**flight, {}));
    evaluation.tolerant_scores.push_back(eval::score(**flight, {.onset_tolerance = Duration{500'000}}));
    evaluation.flights.push_back(std::move(**flight));
  }
  fmt::print("{}", json ? eval::to_json(evaluation) : eval::to_table(evaluation));
  return failures;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {  // memory or threads ran out
    std::fprintf(stderr, "airworthy-eval: %s\n", error.what());
    return EX_OSERR;
  }
}
