#pragma once

#include <lcm/lcm.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <deque>
#include <memory>

#include "runtime/bus/bus.h"

namespace airworthy::rt {

/// LCM transport: udpm:// between processes, memq:// inside one.
///
/// LCM drops silently beyond a subscription's queue, so the queue is long; what is lost all the same shows in
/// the sequence numbers of the message headers (StreamMonitor).
class LcmBus final : public Bus {
 public:
  static constexpr int kQueueCapacity = 4096;

  [[nodiscard]] static Expected<std::unique_ptr<LcmBus>> open(const std::string& url);

  [[nodiscard]] Expected<void> publish(const std::string& channel,
                                       std::span<const std::uint8_t> payload) override;
  [[nodiscard]] Expected<void> subscribe(const std::string& channel, Handler handler) override;

  /// Dispatches what waits, at most `limit` messages. Returns their number.
  [[nodiscard]] Expected<int> dispatch(int limit);

  /// Dispatches whenever LCM's descriptor becomes readable, for as long as `io` runs. `on_failure` is called
  /// once if the transport breaks.
  void attach(boost::asio::io_context& io, std::function<void(const Error&)> on_failure);

 private:
  struct Subscription {
    Handler handler;
  };
  struct LcmDeleter {
    void operator()(lcm_t* lcm) const { lcm_destroy(lcm); }
  };

  explicit LcmBus(lcm_t* lcm, std::string url) : lcm_{lcm}, url_{std::move(url)} {}
  static void on_message(const lcm_recv_buf_t* buffer, const char* channel, void* subscription);
  void wait();

  std::deque<Subscription> subscriptions_;  // stable addresses: LCM keeps pointers to them
  std::unique_ptr<lcm_t, LcmDeleter> lcm_;
  std::string url_;

  // Borrows LCM's descriptor: released, not closed, before LCM goes.
  struct Borrowed {
    Borrowed(boost::asio::io_context& io, int fd) : descriptor{io, fd} {}
    Borrowed(const Borrowed&) = delete;
    Borrowed& operator=(const Borrowed&) = delete;
    boost::asio::posix::stream_descriptor descriptor;
    ~Borrowed() { descriptor.release(); }
  };
  std::unique_ptr<Borrowed> readable_;
  std::function<void(const Error&)> on_failure_;
};

}  // namespace airworthy::rt
