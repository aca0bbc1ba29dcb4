#include "runtime/process/node.h"

#include <random>

namespace airworthy::rt {

std::int64_t new_session() {
  std::random_device random;
  const std::uint64_t bits = (std::uint64_t{random()} << 32U) | random();
  constexpr std::uint64_t kMask = (std::uint64_t{1} << 48U) - 1;
  return static_cast<std::int64_t>(std::max<std::uint64_t>(bits & kMask, 1));
}

void Node::every(Duration period, Clock::Callback callback) {
  clock_.every(period, [this, callback = std::move(callback)](TimePoint now) {
    const StepMeter::Step step{step_meter_};
    callback(now);
  });
}

void Node::send(const std::string& channel, std::span<const std::uint8_t> payload) {
  const auto sent = bus_.publish(channel, payload);
  if (sent) return;
  counters_.add("publish_failed");
  log_.error("publish_failed", {{"channel", channel}, {"cause", sent.error().text}});
}

bool Node::admit(const ChannelInfo& channel, Streams& streams, const header_t& header) {
  ++received_;
  const auto count = [&](const char* cause, std::int64_t amount = 1) {
    counters_.add(std::string{channel.name} + "." + cause, amount);
  };
  if (header.producer.empty() || header.producer.size() > Streams::kLongestProducer) {
    count(to_string(Arrival::kBadHeader));
    return false;
  }
  auto found = streams.by_producer.find(header.producer);
  if (found == streams.by_producer.end()) {
    if (streams.by_producer.size() >= Streams::kMostProducers) {
      count("too_many_producers");
      return false;
    }
    found = streams.by_producer.emplace(header.producer, StreamMonitor{}).first;
  }
  StreamMonitor& monitor = found->second;
  const std::int64_t lost_before = monitor.lost();
  const std::int64_t resynchronised_before = monitor.resynchronised();
  const Arrival arrival =
      monitor.judge({from_us(header.time_us), from_us(header.sent_us), header.seq, header.session});
  if (monitor.lost() > lost_before) count("lost", monitor.lost() - lost_before);
  if (monitor.resynchronised() > resynchronised_before) count("resynchronised");
  if (arrival == Arrival::kAccepted) return true;
  count(to_string(arrival));
  log_.warning("message_refused", {{"channel", channel.name},
                                   {"producer", header.producer},
                                   {"cause", to_string(arrival)},
                                   {"seq", header.seq},
                                   {"time_us", header.time_us}});
  return false;
}

void Node::count_undecodable(const ChannelInfo& channel, std::size_t size) {
  counters_.add(std::string{channel.name} + ".undecodable");
  log_.warning("message_undecodable", {{"channel", channel.name}, {"bytes", size}});
}

}  // namespace airworthy::rt
