#include "runtime/process/process.h"

#include <sysexits.h>

#include "runtime/bus/channels.h"
#include "runtime/process/service_manager.h"

namespace airworthy::rt {

Process::Process(const Args& args, const std::string& name) : log_{name, args.log_level} {}

Expected<std::unique_ptr<Process>> Process::open(const Args& args, const std::string& name,
                                                 const std::string& vehicle, const std::string& config_hash) {
  std::unique_ptr<Process> process{new Process{args, name}};
  auto bus = LcmBus::open(args.lcm_url);
  if (!bus) return tl::unexpected{bus.error()};
  process->bus_ = std::move(*bus);

  Clock* clock = nullptr;
  if (args.clock == ClockSource::kTick) {
    process->tick_clock_ = std::make_unique<ManualClock>();
    clock = process->tick_clock_.get();
  } else {
    process->live_clock_ = std::make_unique<LiveClock>(process->io_, args.time_scale);
    clock = process->live_clock_.get();
  }
  process->node_ =
      std::make_unique<Node>(*process->bus_, *clock, process->log_, Identity{vehicle, name, new_session()});
  if (ManualClock* tick_clock = process->tick_clock_.get()) {
    process->node_->subscribe<tick_t>(channel::kTick, [tick_clock](const tick_t& tick) {
      tick_clock->advance_to(from_us(tick.header.time_us));
    });
  }
  process->status_ = std::make_unique<ProcessStatus>(*process->node_, config_hash, args.time_scale);
  return process;
}

int Process::run() {
  bus_->attach(io_, [this](const Error& error) {
    log_.error("bus_broken", {{"cause", error.text}});
    exit_code_ = EX_UNAVAILABLE;
    io_.stop();
  });
  signals_.async_wait([this](const boost::system::error_code& error, int signal) {
    if (error) return;
    log_.info("stopping", {{"signal", signal}});
    io_.stop();
  });
  ServiceManager service_manager{io_};
  service_manager.ready();
  if (status_->state() == ProcessState::kStarting) status_->set(ProcessState::kRunning, "");
  log_.info("started", {{"vehicle", node_->identity().vehicle}, {"session", node_->identity().session}});
  io_.run();
  service_manager.stopping();
  status_->set(ProcessState::kStopping, "");
  log_.info("stopped", {{"exit_code", exit_code_}});
  return exit_code_;
}

}  // namespace airworthy::rt
