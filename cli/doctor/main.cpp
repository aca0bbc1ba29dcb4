#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <iostream>

#include "cli/doctor/findings.h"
#include "cli/doctor/linux_probes.h"
#include "cli/doctor/report.h"
#include "runtime/process/command_line.h"

int main(int argc, char** argv) {
  using namespace airworthy;
  const char* from_environment = std::getenv("LCM_DEFAULT_URL");
  std::string url = from_environment == nullptr ? "" : from_environment;
  std::string log_directory = ".";
  bool json = false;

  CLI::App app{
      "Checks that this computer can run Airworthy and prints the command that cures what it finds.\n"
      "Exit code 0: no failure; 1: at least one failure; 64: wrong arguments.",
      "airworthy doctor"};
  app.set_version_flag("--version", AIRWORTHY_VERSION);
  app.add_option("--lcm-url", url, "bus to check; default LCM_DEFAULT_URL, else LCM's own default");
  app.add_option("--log-dir", log_directory, "folder that recordings go to; default the current one");
  app.add_flag("--json", json, "print a JSON object instead of text");
  if (const auto ended = rt::parse_command_line(app, argc, argv)) return *ended;

  const auto address = doctor::parse_lcm_url(url);
  if (!address) {
    std::cerr << "airworthy doctor: " << address.error().text << '\n';
    return EX_USAGE;
  }
  const auto findings = doctor::judge(doctor::probe_this_computer(*address, log_directory));
  std::cout << (json ? doctor::to_json(findings) : doctor::to_text(findings));
  return doctor::has_failure(findings) ? EXIT_FAILURE : EXIT_SUCCESS;
}
