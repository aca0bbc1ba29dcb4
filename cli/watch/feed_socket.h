#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <zmq.hpp>

#include "cli/watch/feed_message.h"
#include "runtime/error.h"

namespace airworthy::watch {

/// The subscriber's end of a feed. Connects and reconnects by itself.
class FeedSocket {
 public:
  [[nodiscard]] static rt::Expected<std::unique_ptr<FeedSocket>> open(const std::string& endpoint);

  /// The next message, or why it is refused; nothing if none came in time or a signal came first.
  [[nodiscard]] std::optional<rt::Expected<FeedMessage>> receive(std::chrono::milliseconds timeout);

 private:
  FeedSocket() = default;

  zmq::context_t context_;
  zmq::socket_t socket_{context_, zmq::socket_type::sub};
};

}  // namespace airworthy::watch
