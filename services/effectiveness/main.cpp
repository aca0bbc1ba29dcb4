#include <sysexits.h>

#include "runtime/process/exit.h"
#include "runtime/process/process.h"
#include "services/effectiveness/effectiveness_service.h"

int main(int argc, char** argv) {
  using namespace airworthy;
  const rt::ProgramInfo program{"airworthy-effectiveness", "Finds rotors that have lost thrust."};
  const auto args = rt::Args::parse(argc, argv, program);
  if (!args) return rt::leave(args.error());
  const auto config = effectiveness::EffectivenessConfig::load(args->config_path, args->overrides);
  if (!config) return rt::fail(EX_CONFIG, config.error());
  if (args->check_config) return EX_OK;
  auto process = rt::Process::open(*args, program.name, config->vehicle, config->hash);
  if (!process) return rt::fail(EX_UNAVAILABLE, process.error());
  effectiveness::EffectivenessService service{(*process)->node(), *config};
  return (*process)->run();
}
