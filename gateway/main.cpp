#include <sysexits.h>

#include "gateway/gateway_service.h"
#include "runtime/process/exit.h"
#include "runtime/process/process.h"

int main(int argc, char** argv) {
  using namespace airworthy;
  const rt::ProgramInfo program{
      "airworthy-gateway", "Joins all verdicts into the health of the vehicle and serves it to the ground."};
  const auto args = rt::Args::parse(argc, argv, program);
  if (!args) return rt::leave(args.error());
  const auto config = gateway::GatewayConfig::load(args->config_path, args->overrides);
  if (!config) return rt::fail(EX_CONFIG, config.error());
  if (args->check_config) return EX_OK;
  auto process = rt::Process::open(*args, program.name, config->vehicle, config->hash);
  if (!process) return rt::fail(EX_UNAVAILABLE, process.error());
  rt::Node& node = (*process)->node();
  auto feed = gateway::FeedPublisher::open(config->feed, config->vehicle, node.identity().session);
  if (!feed) return rt::fail(EX_UNAVAILABLE, feed.error());
  const bool on_ticks = (*process)->on_tick_clock();
  gateway::GatewayService service{node, *config, **feed,
                                  on_ticks ? gateway::TickSource::kBus : gateway::TickSource::kOwn,
                                  !on_ticks && args->time_scale == 1.0};
  return (*process)->run();
}
