#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <memory>
#include <string>

#include "runtime/bus/lcm_bus.h"
#include "runtime/clock/live_clock.h"
#include "runtime/clock/manual_clock.h"
#include "runtime/log/log.h"
#include "runtime/process/args.h"
#include "runtime/process/node.h"
#include "runtime/process/process_status.h"

namespace airworthy::rt {

/// What every process of the system has: one thread with one io_context, the bus, a clock, a node, the life
/// sign, orderly ends on SIGINT and SIGTERM, and word to the service manager.
///
/// With `--clock tick` vehicle time is the time of the newest TICK message, so that a replay of recorded
/// inputs runs on recorded time; such a process publishes no TICK of its own.
class Process {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<Process>> open(const Args& args, const std::string& name,
                                                               const std::string& vehicle,
                                                               const std::string& config_hash);

  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  [[nodiscard]] Node& node() { return *node_; }
  [[nodiscard]] boost::asio::io_context& io() { return io_; }
  [[nodiscard]] ProcessStatus& status() { return *status_; }
  [[nodiscard]] bool on_tick_clock() const { return tick_clock_ != nullptr; }

  /// Runs until a signal or a broken bus; returns the exit code.
  [[nodiscard]] int run();

 private:
  Process(const Args& args, const std::string& name);

  boost::asio::io_context io_;
  boost::asio::signal_set signals_{io_, SIGINT, SIGTERM};
  Log log_;
  std::unique_ptr<LcmBus> bus_;
  std::unique_ptr<LiveClock> live_clock_;
  std::unique_ptr<ManualClock> tick_clock_;
  std::unique_ptr<Node> node_;
  std::unique_ptr<ProcessStatus> status_;
  int exit_code_ = 0;
};

}  // namespace airworthy::rt
