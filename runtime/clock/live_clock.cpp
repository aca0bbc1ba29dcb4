#include "runtime/clock/live_clock.h"

#include <ctime>

namespace airworthy::rt {

TimePoint LiveClock::now() const {
  timespec t{};
  clock_gettime(CLOCK_BOOTTIME, &t);
  const std::int64_t us = static_cast<std::int64_t>(t.tv_sec) * 1'000'000 + t.tv_nsec / 1'000;
  if (scale_ == 1.0) return from_us(us);
  return from_us(static_cast<std::int64_t>(static_cast<double>(us) * scale_));
}

void LiveClock::every(Duration period, Callback callback) {
  const auto real_period = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>{to_seconds(period) / scale_});
  Timer& timer =
      timers_.emplace_back(Timer{boost::asio::steady_timer{io_}, real_period, std::move(callback)});
  timer.timer.expires_after(real_period);
  arm(timer);
}

void LiveClock::arm(Timer& timer) {
  timer.timer.async_wait([this, &timer](const boost::system::error_code& error) {
    if (error) return;
    // Keep the grid; after a stall longer than a period start a new one rather than firing a burst.
    const auto next = timer.timer.expiry() + timer.period;
    timer.timer.expires_at(std::max(next, std::chrono::steady_clock::now()));
    timer.callback(now());
    arm(timer);
  });
}

}  // namespace airworthy::rt
