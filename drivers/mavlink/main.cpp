#include <sysexits.h>

#include "drivers/mavlink/mavlink_driver.h"
#include "runtime/process/exit.h"
#include "runtime/process/process.h"

int main(int argc, char** argv) {
  using namespace airworthy;
  const rt::ProgramInfo program{"airworthy-mavlink", "Reads a flight controller over MAVLink."};
  const auto args = rt::Args::parse(argc, argv, program);
  if (!args) return rt::leave(args.error());
  const auto config = drivers::MavlinkConfig::load(args->config_path, args->overrides);
  if (!config) return rt::fail(EX_CONFIG, config.error());
  if (args->check_config) return EX_OK;
  auto process = rt::Process::open(*args, program.name, config->vehicle, config->hash);
  if (!process) return rt::fail(EX_UNAVAILABLE, process.error());
  drivers::MavlinkDriver driver{(*process)->node(), (*process)->io(), *config, (*process)->status()};
  return (*process)->run();
}
