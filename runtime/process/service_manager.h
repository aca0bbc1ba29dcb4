#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

namespace airworthy::rt {

/// Word to systemd: ready, stopping, and watchdog beats from the event loop, so that a hung loop is
/// restarted. Without systemd, or when built without its library, it does nothing.
class ServiceManager {
 public:
  explicit ServiceManager(boost::asio::io_context& io) : watchdog_{io} {}

  void ready();
  void stopping();

 private:
  void beat();

  boost::asio::steady_timer watchdog_;
  std::chrono::microseconds watchdog_period_{0};
};

}  // namespace airworthy::rt
