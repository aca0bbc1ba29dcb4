#include "gateway/feed/feed_publisher.h"

#include <fmt/format.h>

#include <utility>

namespace airworthy::gateway {
namespace {

/// A subscriber only ever sends subscriptions; whoever sends more is none.
constexpr std::int64_t kLargestIncoming_bytes = 4096;
/// A vanished ground station must not hold a connection for the hours TCP would.
constexpr int kHeartbeatPeriod_ms = 2'000;
constexpr int kHeartbeatTimeout_ms = 10'000;

}  // namespace

rt::Expected<std::unique_ptr<FeedPublisher>> FeedPublisher::open(const FeedConfig& config,
                                                                 const std::string& vehicle,
                                                                 std::int64_t session) {
  try {
    auto context = std::make_unique<zmq::context_t>();
    auto feed = open(*context, config, vehicle, session);
    if (feed) (*feed)->own_context_ = std::move(context);
    return feed;
  } catch (const zmq::error_t& error) {
    return rt::fail_with(fmt::format("cannot start ZeroMQ: {}", error.what()));
  }
}

rt::Expected<std::unique_ptr<FeedPublisher>> FeedPublisher::open(zmq::context_t& context,
                                                                 const FeedConfig& config,
                                                                 const std::string& vehicle,
                                                                 std::int64_t session) {
  try {
    zmq::socket_t socket{context, zmq::socket_type::pub};
    socket.set(zmq::sockopt::ipv6, true);
    socket.set(zmq::sockopt::sndhwm, config.high_water_mark);
    socket.set(zmq::sockopt::linger, config.linger_ms);
    socket.set(zmq::sockopt::maxmsgsize, kLargestIncoming_bytes);
    socket.set(zmq::sockopt::heartbeat_ivl, kHeartbeatPeriod_ms);
    socket.set(zmq::sockopt::heartbeat_timeout, kHeartbeatTimeout_ms);
    socket.bind(config.endpoint);
    return std::unique_ptr<FeedPublisher>{new FeedPublisher{std::move(socket), vehicle, session}};
  } catch (const zmq::error_t& error) {
    return rt::fail_with(fmt::format("cannot serve the feed at {}: {}", config.endpoint, error.what()));
  }
}

void FeedPublisher::publish(std::string_view kind, nlohmann::json message) {
  message["schema"] = kSchema;
  message["kind"] = kind;
  message["vehicle"] = vehicle_;
  message["session"] = session_;
  message["sequence"] = sent_;
  const std::string topic = fmt::format("airworthy/{}/{}", vehicle_, kind);
  const std::string sequence = fmt::format("{}", sent_);
  const std::string body = message.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  ++sent_;
  try {
    // PUB takes all three frames or drops all three; a refusal of the first is one it reports.
    const bool taken =
        socket_.send(zmq::buffer(topic), zmq::send_flags::sndmore | zmq::send_flags::dontwait) &&
        socket_.send(zmq::buffer(sequence), zmq::send_flags::sndmore | zmq::send_flags::dontwait) &&
        socket_.send(zmq::buffer(body), zmq::send_flags::dontwait);
    if (!taken) ++failed_;
  } catch (const zmq::error_t&) {
    ++failed_;
  }
}

}  // namespace airworthy::gateway
