// Rotor unbalance on recorded flights: prints one section of the evidence as JSON. `tools/evidence unbalance_recorded`
// makes a page of it.

#include "tests/evidence/unbalance_recorded.h"

#include <cstdio>
#include <string_view>

#include "tests/support/recorded_data.h"

int main(int argc, char** argv) {
  using namespace airworthy::testing;
  const std::string_view section = argc == 2 ? argv[1] : "";
  const auto data = recorded_data();
  if (!std::filesystem::is_directory(data)) {
    std::fprintf(stderr, "no recorded flights in %s (set AIRWORTHY_DATA)\n", data.c_str());
    return 1;
  }
  constexpr std::uint64_t kSeed = 20261;
  nlohmann::json result;
  if (section == "bebop")
    result = bebop_evidence(data);
  else if (section == "healthy")
    result = healthy_evidence(data);
  else if (section == "crazypad")
    result = crazypad_evidence(data);
  else if (section == "added")
    result = added_evidence(data, kSeed);
  else {
    std::fprintf(stderr, "usage: unbalance_recorded bebop|healthy|crazypad|added\n");
    return 64;
  }
  std::printf("%s\n", result.dump(1).c_str());
  return result.is_null() ? 1 : 0;
}
