#include <sysexits.h>

#include <cstdio>
#include <exception>
#include <string_view>

#include "cli/calibrate/effectiveness_command.h"
#include "cli/calibrate/response_command.h"
#include "cli/calibrate/unbalance_command.h"

namespace {

using namespace airworthy::calibrate;

// `airworthy calibrate WHAT ...`; without a word it is the response detector.
int run(int argc, char** argv) {
  const std::string_view what = argc > 1 ? argv[1] : "";
  if (what == "unbalance") return calibrate_unbalance(argc - 1, argv + 1);
  if (what == "effectiveness") return calibrate_effectiveness(argc - 1, argv + 1);
  if (what == "response") return calibrate_response(argc - 1, argv + 1);
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
