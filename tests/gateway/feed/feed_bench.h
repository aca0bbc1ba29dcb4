#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>
#include <zmq.hpp>
#include <zmq_addon.hpp>

namespace airworthy::gateway {

struct Received {
  std::string topic;
  std::string sequence;
  nlohmann::json body;
};

/// A ground station of the tests.
class Subscriber {
 public:
  Subscriber(zmq::context_t& context, const std::string& endpoint, const std::string& prefix = "airworthy/")
      : socket_{context, zmq::socket_type::sub} {
    socket_.set(zmq::sockopt::rcvtimeo, 2'000);
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::subscribe, prefix);
    socket_.connect(endpoint);
  }

  /// Nothing within the timeout: nothing.
  std::optional<Received> receive() {
    std::vector<zmq::message_t> frames;
    if (!zmq::recv_multipart(socket_, std::back_inserter(frames))) return std::nullopt;
    if (frames.size() != 3) return Received{"", "", "not three frames"};
    return Received{frames[0].to_string(), frames[1].to_string(),
                    nlohmann::json::parse(frames[2].to_string())};
  }

  /// All that is there already.
  std::vector<Received> drain(int wait_ms = 0) {
    socket_.set(zmq::sockopt::rcvtimeo, wait_ms);
    std::vector<Received> all;
    while (auto one = receive()) all.push_back(std::move(*one));
    socket_.set(zmq::sockopt::rcvtimeo, 2'000);
    return all;
  }

 private:
  zmq::socket_t socket_;
};

}  // namespace airworthy::gateway
