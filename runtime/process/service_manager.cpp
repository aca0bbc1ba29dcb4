#include "runtime/process/service_manager.h"

#if AIRWORTHY_HAVE_SYSTEMD
#include <systemd/sd-daemon.h>
#endif

namespace airworthy::rt {

#if AIRWORTHY_HAVE_SYSTEMD

void ServiceManager::ready() {
  sd_notify(0, "READY=1");
  std::uint64_t timeout_us = 0;
  if (sd_watchdog_enabled(0, &timeout_us) <= 0) return;
  watchdog_period_ = std::chrono::microseconds{timeout_us / 2};
  beat();
}

void ServiceManager::stopping() { sd_notify(0, "STOPPING=1"); }

void ServiceManager::beat() {
  sd_notify(0, "WATCHDOG=1");
  watchdog_.expires_after(watchdog_period_);
  watchdog_.async_wait([this](const boost::system::error_code& error) {
    if (!error) beat();
  });
}

#else

void ServiceManager::ready() {}
void ServiceManager::stopping() {}
void ServiceManager::beat() {}

#endif

}  // namespace airworthy::rt
