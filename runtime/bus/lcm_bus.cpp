#include "runtime/bus/lcm_bus.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

namespace airworthy::rt {
namespace {

constexpr int kMessagesPerWakeup = 256;  // then timers and signals get their turn

}  // namespace

Expected<std::unique_ptr<LcmBus>> LcmBus::open(const std::string& url) {
  lcm_t* lcm = lcm_create(url.c_str());
  if (lcm == nullptr) {
    return fail_with(fmt::format(
        "cannot open the LCM bus {}: no multicast route or bad URL; 'airworthy doctor' tells the cure", url));
  }
  return std::unique_ptr<LcmBus>{new LcmBus{lcm, url}};
}

Expected<void> LcmBus::publish(const std::string& channel, std::span<const std::uint8_t> payload) {
  errno = 0;
  if (lcm_publish(lcm_.get(), channel.c_str(), payload.data(), static_cast<unsigned>(payload.size())) != 0) {
    return fail_with(fmt::format("cannot publish {} bytes on {} over {}: {}", payload.size(), channel, url_,
                                 std::strerror(errno)));
  }
  return {};
}

Expected<void> LcmBus::subscribe(const std::string& channel, Handler handler) {
  Subscription& subscription = subscriptions_.emplace_back(Subscription{std::move(handler)});
  lcm_subscription_t* handle = lcm_subscribe(lcm_.get(), channel.c_str(), &LcmBus::on_message, &subscription);
  if (handle == nullptr || lcm_subscription_set_queue_capacity(handle, kQueueCapacity) != 0) {
    return fail_with(fmt::format("cannot subscribe to {} over {}", channel, url_));
  }
  return {};
}

void LcmBus::on_message(const lcm_recv_buf_t* buffer, const char* /*channel*/, void* subscription) {
  static_cast<Subscription*>(subscription)
      ->handler({static_cast<const std::uint8_t*>(buffer->data), buffer->data_size});
}

Expected<int> LcmBus::dispatch(int limit) {
  for (int count = 0; count < limit; ++count) {
    const int result = lcm_handle_timeout(lcm_.get(), 0);
    if (result < 0) return fail_with(fmt::format("the LCM bus {} broke", url_));
    if (result == 0) return count;
  }
  return limit;
}

void LcmBus::attach(boost::asio::io_context& io, std::function<void(const Error&)> on_failure) {
  on_failure_ = std::move(on_failure);
  readable_ = std::make_unique<Borrowed>(io, lcm_get_fileno(lcm_.get()));
  wait();
}

void LcmBus::wait() {
  readable_->descriptor.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                                   [this](const boost::system::error_code& error) {
                                     if (error) return;
                                     const auto dispatched = dispatch(kMessagesPerWakeup);
                                     if (!dispatched) {
                                       on_failure_(dispatched.error());
                                       return;
                                     }
                                     wait();
                                   });
}

}  // namespace airworthy::rt
