#include "cli/watch/feed_socket.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>

namespace airworthy::watch {
namespace {

/// A full vehicle's health is far below 1 MB; a peer that sends more is cut off.
constexpr std::int64_t kLargestMessage_bytes = 16'000'000;
constexpr int kHighWaterMark = 1'000;
constexpr int kLongestReconnectPause_ms = 2'000;
constexpr int kHeartbeatPeriod_ms = 2'000;
constexpr int kHeartbeatTimeout_ms = 6'000;

}  // namespace

rt::Expected<std::unique_ptr<FeedSocket>> FeedSocket::open(const std::string& endpoint) {
  std::unique_ptr<FeedSocket> feed{new FeedSocket};
  try {
    feed->socket_.set(zmq::sockopt::ipv6, true);
    feed->socket_.set(zmq::sockopt::rcvhwm, kHighWaterMark);
    feed->socket_.set(zmq::sockopt::linger, 0);
    feed->socket_.set(zmq::sockopt::maxmsgsize, kLargestMessage_bytes);
    feed->socket_.set(zmq::sockopt::reconnect_ivl_max, kLongestReconnectPause_ms);
    feed->socket_.set(zmq::sockopt::heartbeat_ivl, kHeartbeatPeriod_ms);
    feed->socket_.set(zmq::sockopt::heartbeat_timeout, kHeartbeatTimeout_ms);
    feed->socket_.set(zmq::sockopt::subscribe, "airworthy/");
    feed->socket_.connect(endpoint);
  } catch (const zmq::error_t& error) {
    return rt::fail_with(fmt::format(
        "cannot watch \"{}\": {}; an endpoint is tcp://ADDRESS:PORT or ipc://PATH", endpoint, error.what()));
  }
  return feed;
}

std::optional<rt::Expected<FeedMessage>> FeedSocket::receive(std::chrono::milliseconds timeout) {
  try {
    zmq::pollitem_t item{socket_.handle(), 0, ZMQ_POLLIN, 0};
    if (zmq::poll(&item, 1, timeout) == 0) return std::nullopt;
    std::array<std::string, 3> frames;
    std::size_t count = 0;
    bool more = true;
    while (more) {
      zmq::message_t frame;
      if (!socket_.recv(frame, zmq::recv_flags::dontwait)) return std::nullopt;
      more = frame.more();
      if (count < frames.size()) frames[count] = frame.to_string();
      ++count;
    }
    if (count != frames.size()) return rt::Expected<FeedMessage>{rt::fail_with("not three frames")};
    return parse_message(frames[0], frames[1], frames[2]);
  } catch (const zmq::error_t& error) {
    if (error.num() == EINTR) return std::nullopt;
    return rt::Expected<FeedMessage>{rt::fail_with(error.what())};
  }
}

}  // namespace airworthy::watch
