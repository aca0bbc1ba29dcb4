#include <fmt/format.h>
#include <sysexits.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "cli/calibrate/effectiveness_command.h"
#include "cli/calibrate/response_command.h"
#include "cli/calibrate/unbalance_command.h"
#include "runtime/process/command_line.h"

namespace {

using namespace airworthy::calibrate;

// `airworthy calibrate WHAT ...`; without a word it is the response detector.
int run(int argc, char** argv) {
  const std::string_view what = argc > 1 ? argv[1] : "";
  if (what == "unbalance") return calibrate_unbalance(argc - 1, argv + 1);
  if (what == "effectiveness") return calibrate_effectiveness(argc - 1, argv + 1);
  if (what == "response") return calibrate_response(argc - 1, argv + 1);
  std::error_code error;
  const bool is_word = !what.empty() && what.find_first_of("-./") == std::string_view::npos;
  if (is_word && !std::filesystem::exists(what, error)) {
    return airworthy::rt::wrong_usage(
        fmt::format("\"{}\" is neither response, unbalance or effectiveness nor a log", what));
  }
  return calibrate_response(argc, argv);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {  // memory or threads ran out
    std::fprintf(stderr, "airworthy-calibrate: %s\n", error.what());
    return EX_OSERR;
  }
}
