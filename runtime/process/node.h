#pragma once

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "airworthy/header_t.hpp"
#include "core/assert.h"
#include "runtime/bus/bus.h"
#include "runtime/bus/channel.h"
#include "runtime/bus/stream_monitor.h"
#include "runtime/clock/clock.h"
#include "runtime/log/log.h"
#include "runtime/process/counters.h"
#include "runtime/process/step_meter.h"

namespace airworthy::rt {

/// Who speaks on the bus.
struct Identity {
  std::string vehicle;   ///< [A-Za-z0-9_-]{1,16}; prefix of every channel
  std::string producer;  ///< process name
  std::int64_t session;  ///< start nonce in [1, 2^48)
};

/// A random session number; 48 bits, so that it survives a JSON number.
[[nodiscard]] std::int64_t new_session();

class Node;

/// Publishes one message type on one channel and fills its header. Cheap to move, outlived by its node.
template <class Message>
class Publisher {
 public:
  /// `time` is when the content was measured or decided. A failure is counted and logged, never thrown.
  void publish(Message& message, TimePoint time);

 private:
  friend class Node;
  Publisher(Node& node, std::string channel) : node_{&node}, channel_{std::move(channel)} {}

  Node* node_;
  std::string channel_;
  std::int64_t next_seq_ = 0;
  std::vector<std::uint8_t> buffer_;
};

/// A process's place on the bus: typed channels, headers, loss accounting, timers. The same object live, in a
/// test and on a recording, because bus and clock are interfaces. Outlives everything that publishes through
/// it.
class Node {
 public:
  Node(Bus& bus, Clock& clock, Log& log, Identity identity)
      : bus_{bus}, clock_{clock}, log_{log}, identity_{std::move(identity)} {}
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  template <class Message>
  [[nodiscard]] Publisher<Message> advertise(const Channel<Message>& channel) {
    return Publisher<Message>{*this, full_name(channel.info)};
  }

  /// Calls back for every message that the stream's header accepts; the rest is counted by cause. An
  /// exception out of the handler is a bug and ends the program: LCM's C code lies below.
  template <class Message>
  void subscribe(const Channel<Message>& channel, std::function<void(const Message&)> handler);

  /// Timer on vehicle time.
  void every(Duration period, Clock::Callback callback);

  [[nodiscard]] Clock& clock() { return clock_; }
  [[nodiscard]] Log& log() { return log_; }
  [[nodiscard]] const Identity& identity() const { return identity_; }
  [[nodiscard]] Counters& counters() { return counters_; }
  [[nodiscard]] StepMeter& step_meter() { return step_meter_; }
  [[nodiscard]] std::string full_name(const ChannelInfo& channel) const {
    return identity_.vehicle + "/" + std::string{channel.name};
  }

 private:
  template <class>
  friend class Publisher;

  // The streams of one channel. Bounded, so that a flood of invented producers cannot grow it.
  struct Streams {
    static constexpr std::size_t kMostProducers = 32;
    static constexpr std::size_t kLongestProducer = 64;
    std::map<std::string, StreamMonitor> by_producer;
  };

  void send(const std::string& channel, std::span<const std::uint8_t> payload);
  [[nodiscard]] bool admit(const ChannelInfo& channel, Streams& streams, const header_t& header);
  void count_undecodable(const ChannelInfo& channel, std::size_t size);

  Bus& bus_;
  Clock& clock_;
  Log& log_;
  Identity identity_;
  Counters counters_;
  std::int64_t& received_ = counters_["received"];
  StepMeter step_meter_;
};

template <class Message>
void Publisher<Message>::publish(Message& message, TimePoint time) {
  message.header.time_us = to_us(time);
  message.header.sent_us = to_us(node_->clock().now());
  message.header.seq = next_seq_++;
  message.header.producer = node_->identity().producer;
  message.header.session = node_->identity().session;
  const int size = message.getEncodedSize();
  buffer_.resize(static_cast<std::size_t>(size));
  AW_ASSERT(message.encode(buffer_.data(), 0, size) == size);
  node_->send(channel_, buffer_);
}

template <class Message>
void Node::subscribe(const Channel<Message>& channel, std::function<void(const Message&)> handler) {
  auto streams = std::make_shared<Streams>();
  const auto subscribed = bus_.subscribe(
      full_name(channel.info), [this, info = channel.info, streams, handler = std::move(handler)](
                                   std::span<const std::uint8_t> payload) noexcept {
        const StepMeter::Step step{step_meter_};
        Message message;
        bool decoded = false;
        try {
          decoded = message.decode(payload.data(), 0, static_cast<int>(payload.size())) ==
                    static_cast<int>(payload.size());
        } catch (const std::exception&) {  // a length field gone wild: bad_alloc, length_error
        }
        if (!decoded) {
          count_undecodable(info, payload.size());
          return;
        }
        if (admit(info, *streams, message.header)) handler(message);
      });
  AW_ASSERT(subscribed.has_value());  // names come from the channel table and a validated vehicle name
}

}  // namespace airworthy::rt
