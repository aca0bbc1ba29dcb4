#include "runtime/bus/log_bus.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "runtime/bus/channels.h"

namespace airworthy::rt {
namespace {

constexpr std::size_t kSentOffset = 16;  // after the 8-byte fingerprint and header.time_us

}  // namespace

TimePoint sent_time(std::span<const std::uint8_t> payload) {
  if (payload.size() < kSentOffset + 8) return from_us(-1);
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < 8; ++i) bits = (bits << 8U) | payload[kSentOffset + i];
  return from_us(static_cast<std::int64_t>(bits));
}

Expected<std::unique_ptr<LogBus>> LogBus::open(const std::string& path) {
  errno = 0;
  lcm_eventlog_t* log = lcm_eventlog_create(path.c_str(), "r");
  if (log == nullptr) return fail_with(fmt::format("{}: {}", path, std::strerror(errno)));
  std::unique_ptr<LogBus> bus{new LogBus{log, path}};
  struct stat about {};
  if (::fstat(::fileno(log->f), &about) == 0 && S_ISDIR(about.st_mode)) {
    return fail_with(fmt::format("{}: {}", path, std::strerror(EISDIR)));  // it opens, and cannot be read
  }
  return bus;
}

Expected<LogBus::Contents> LogBus::survey(const std::string& path) {
  auto bus = open(path);
  if (!bus) return tl::unexpected{bus.error()};
  Contents contents;
  ManualClock clock;
  const auto played = (*bus)->play(clock, [&contents](std::string_view channel) {
    ++contents.messages[std::string{channel}];
    const std::size_t slash = channel.find('/');
    if (contents.vehicle.empty() && slash != std::string_view::npos) {
      for (const ChannelInfo& info : channel::kAll) {
        if (info.name == channel.substr(slash + 1)) contents.vehicle = channel.substr(0, slash);
      }
    }
    return false;
  });
  if (!played) return tl::unexpected{played.error()};
  if (contents.vehicle.empty()) {
    return fail_with(fmt::format("{}: no channel <vehicle>/<CHANNEL> of lcmtypes/channels.toml in it", path));
  }
  return contents;
}

Expected<void> LogBus::publish(const std::string& channel, std::span<const std::uint8_t> payload) {
  pending_.push_back({channel, {payload.begin(), payload.end()}});
  return {};
}

Expected<void> LogBus::subscribe(const std::string& channel, Handler handler) {
  handlers_[channel].push_back(std::make_shared<Handler>(std::move(handler)));
  return {};
}

Expected<LogBus::Summary> LogBus::play(ManualClock& clock, const ChannelFilter& filter) {
  Summary summary;
  std::int64_t next_number = -1;
  std::int64_t good_until = 0;
  for (;;) {
    lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log_.get());
    if (event == nullptr) break;
    const std::unique_ptr<lcm_eventlog_event_t, void (*)(lcm_eventlog_event_t*)> owned{
        event, lcm_eventlog_free_event};
    good_until = std::ftell(log_->f);
    if (next_number >= 0 && event->eventnum > next_number) {
      summary.skipped_events += event->eventnum - next_number;
    }
    next_number = event->eventnum + 1;
    const std::string channel{event->channel, static_cast<std::size_t>(event->channellen)};
    if (!filter(channel)) {
      ++summary.filtered;
      continue;
    }
    ++summary.played;
    const std::span<const std::uint8_t> payload{static_cast<const std::uint8_t*>(event->data),
                                                static_cast<std::size_t>(event->datalen)};
    const TimePoint sent = sent_time(payload);
    if (sent > TimePoint{}) clock.advance_to(sent);
    deliver_pending();
    deliver(channel, payload);
    deliver_pending();
  }
  std::fseek(log_->f, 0, SEEK_END);
  const std::int64_t size = std::ftell(log_->f);
  if (good_until != size) {
    return fail_with(
        fmt::format("{}: not a whole event at byte {} of {}: truncated or corrupt", path_, good_until, size));
  }
  return summary;
}

void LogBus::deliver(const std::string& channel, std::span<const std::uint8_t> payload) {
  const auto found = handlers_.find(channel);
  if (found == handlers_.end()) return;
  const auto handlers = found->second;  // a copy: a handler may subscribe
  for (const auto& handler : handlers) (*handler)(payload);
}

void LogBus::deliver_pending() {
  while (!pending_.empty()) {
    const Pending message = std::move(pending_.front());
    pending_.pop_front();
    if (tap_) tap_(message.channel, message.payload);
    deliver(message.channel, message.payload);
  }
}

}  // namespace airworthy::rt
