#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <zmq.hpp>

#include "gateway/feed/feed_config.h"
#include "runtime/error.h"

namespace airworthy::gateway {

/// The ground's view of the vehicle: a ZeroMQ PUB socket. docs/feed.md describes what it sends.
///
/// Never blocks: what a subscriber does not take in time is dropped for that subscriber alone, which sees it
/// in the sequence numbers.
class FeedPublisher {
 public:
  static constexpr int kSchema = 1;

  /// `session` tells one run of the gateway from the next.
  [[nodiscard]] static rt::Expected<std::unique_ptr<FeedPublisher>> open(const FeedConfig& config,
                                                                         const std::string& vehicle,
                                                                         std::int64_t session);
  /// The same in a context at hand, which must outlive it: for inproc:// endpoints.
  [[nodiscard]] static rt::Expected<std::unique_ptr<FeedPublisher>> open(zmq::context_t& context,
                                                                         const FeedConfig& config,
                                                                         const std::string& vehicle,
                                                                         std::int64_t session);

  /// Completes the object with schema, kind, vehicle, session and sequence, and sends it.
  void publish(std::string_view kind, nlohmann::json message);

  [[nodiscard]] std::int64_t sent() const { return sent_; }
  [[nodiscard]] std::int64_t failed() const { return failed_; }

 private:
  FeedPublisher(zmq::socket_t socket, std::string vehicle, std::int64_t session)
      : socket_{std::move(socket)}, vehicle_{std::move(vehicle)}, session_{session} {}

  std::unique_ptr<zmq::context_t> own_context_;  // ends after the socket
  zmq::socket_t socket_;
  std::string vehicle_;
  std::int64_t session_;
  std::int64_t sent_{};
  std::int64_t failed_{};
};

}  // namespace airworthy::gateway
