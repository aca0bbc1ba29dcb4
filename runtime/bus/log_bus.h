#pragma once

#include <lcm/eventlog.h>

#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "runtime/bus/bus.h"
#include "runtime/clock/manual_clock.h"

namespace airworthy::rt {

/// A recording as a bus: its messages are dispatched in recorded order on their own time, as fast as
/// possible, into the very objects that run live. What these publish is delivered to the subscribers in this
/// process after the message that caused it, and to the tap.
class LogBus final : public Bus {
 public:
  using ChannelFilter = std::function<bool(std::string_view channel)>;
  using Tap = std::function<void(const std::string& channel, std::span<const std::uint8_t> payload)>;

  struct Summary {
    std::int64_t played = 0;
    std::int64_t filtered = 0;
    std::int64_t skipped_events = 0;  ///< numbers missing in the file
  };

  /// What a recording holds.
  struct Contents {
    std::string vehicle;  ///< of the first channel named <vehicle>/<CHANNEL> that the table knows
    std::map<std::string, std::int64_t, std::less<>> messages;  ///< by full channel name
    [[nodiscard]] bool has(std::string_view channel) const { return messages.contains(channel); }
  };

  [[nodiscard]] static Expected<std::unique_ptr<LogBus>> open(const std::string& path);

  /// Reads through a recording without playing it. No channel of ours in it is an error.
  [[nodiscard]] static Expected<Contents> survey(const std::string& path);

  [[nodiscard]] Expected<void> publish(const std::string& channel,
                                       std::span<const std::uint8_t> payload) override;
  [[nodiscard]] Expected<void> subscribe(const std::string& channel, Handler handler) override;
  void set_tap(Tap tap) { tap_ = std::move(tap); }

  /// Plays every event that the filter passes. `clock` follows the time at which each message was sent. A
  /// truncated or corrupt file is an error that names the offset; what came before it has been played.
  [[nodiscard]] Expected<Summary> play(ManualClock& clock, const ChannelFilter& filter);

 private:
  struct Closer {
    void operator()(lcm_eventlog_t* log) const { lcm_eventlog_destroy(log); }
  };
  struct Pending {
    std::string channel;
    std::vector<std::uint8_t> payload;
  };

  LogBus(lcm_eventlog_t* log, std::string path) : log_{log}, path_{std::move(path)} {}
  void deliver(const std::string& channel, std::span<const std::uint8_t> payload);
  void deliver_pending();

  std::unique_ptr<lcm_eventlog_t, Closer> log_;
  std::string path_;
  std::map<std::string, std::vector<std::shared_ptr<Handler>>, std::less<>> handlers_;
  std::deque<Pending> pending_;
  Tap tap_;
};

/// Vehicle time at which an encoded message was sent, read from the header that every type starts with;
/// negative where the payload is too short.
[[nodiscard]] TimePoint sent_time(std::span<const std::uint8_t> payload);

}  // namespace airworthy::rt
