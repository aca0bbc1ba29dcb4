#include <sysexits.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "cli/dispatch/commands.h"

int main(int argc, char** argv) {
  using namespace airworthy;
  const auto commands = cli::Commands::of_this_computer();
  std::vector<std::string> arguments{argv + (argc > 0 ? 1 : 0), argv + argc};
  if (arguments.empty()) {
    std::fputs(cli::help_text(commands.list()).c_str(), stderr);
    return EX_USAGE;
  }
  std::string name = arguments.front();
  arguments.erase(arguments.begin());
  if (name == "version" || name == "--version") {
    std::puts("airworthy " AIRWORTHY_VERSION);
    return EX_OK;
  }
  if (name == "--help" || name == "-h" || (name == "help" && arguments.empty())) {
    std::fputs(cli::help_text(commands.list()).c_str(), stdout);
    return EX_OK;
  }
  if (name == "help") {
    name = arguments.front();
    arguments = {"--help"};
  }
  const auto program = commands.find(name);
  if (!program) {
    std::fprintf(stderr, "airworthy: there is no command \"%s\"; \"airworthy --help\" lists them\n",
                 name.c_str());
    return EX_USAGE;
  }
  std::string path = *program;
  std::vector<char*> passed{path.data()};
  for (std::string& argument : arguments) passed.push_back(argument.data());
  passed.push_back(nullptr);
  execv(path.c_str(), passed.data());
  std::fprintf(stderr, "airworthy: cannot run %s: %s\n", path.c_str(), std::strerror(errno));
  return EX_OSERR;
}
