#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <list>

#include "runtime/clock/clock.h"

namespace airworthy::rt {

/// CLOCK_BOOTTIME, times `scale` in a demonstration or test that runs faster than life: every process of the
/// system must then be started with the same scale, and all agree without talking because the origin is the
/// boot.
class LiveClock final : public Clock {
 public:
  LiveClock(boost::asio::io_context& io, double scale) : io_{io}, scale_{scale} {}

  [[nodiscard]] TimePoint now() const override;
  void every(Duration period, Callback callback) override;
  [[nodiscard]] double scale() const { return scale_; }

 private:
  struct Timer {
    boost::asio::steady_timer timer;
    std::chrono::steady_clock::duration period;
    Callback callback;
  };

  void arm(Timer& timer);

  boost::asio::io_context& io_;
  double scale_;
  std::list<Timer> timers_;
};

}  // namespace airworthy::rt
