#include <sysexits.h>

#include "runtime/process/exit.h"
#include "runtime/process/process.h"
#include "services/actuator/actuator_service.h"

int main(int argc, char** argv) {
  using namespace airworthy;
  const rt::ProgramInfo program{"airworthy-actuator",
                                "Estimates what is left of each rotor and control axis of a multirotor."};
  const auto args = rt::Args::parse(argc, argv, program);
  if (!args) return rt::leave(args.error());
  const auto config = actuator::ActuatorConfig::load(args->config_path, args->overrides);
  if (!config) return rt::fail(EX_CONFIG, config.error());
  if (args->check_config) return EX_OK;
  auto process = rt::Process::open(*args, program.name, config->vehicle, config->hash);
  if (!process) return rt::fail(EX_UNAVAILABLE, process.error());
  actuator::ActuatorService service{(*process)->node(), *config};
  return (*process)->run();
}
