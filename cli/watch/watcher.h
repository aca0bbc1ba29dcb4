#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "cli/watch/change_lines.h"
#include "cli/watch/feed_message.h"
#include "cli/watch/screen.h"
#include "cli/watch/sequence_check.h"

namespace airworthy::watch {

/// What the user asked for.
struct WatchOptions {
  std::string endpoint = "tcp://127.0.0.1:5710";
  bool json = false;
  std::int64_t count = 0;  ///< end after so many messages; 0 = never
  double timeout_s = 0.0;  ///< end after so long; 0 = never
};

/// Follows a feed. Time is an argument, so that tests need not wait.
class Watcher {
 public:
  using Time = std::chrono::steady_clock::time_point;
  /// A feed sends five times a second; this long without is an event.
  static constexpr std::chrono::milliseconds kSilence{1'500};

  Watcher(const WatchOptions& options, Time start);

  /// Lines to print: of a change, or the message itself with --json. A screen shows `health()` and `feed()`
  /// instead.
  [[nodiscard]] std::vector<std::string> add(const FeedMessage& message, Time now);
  [[nodiscard]] std::vector<std::string> refuse(const std::string& reason);

  /// To be called now and then: finds silence.
  [[nodiscard]] std::vector<std::string> check(Time now);

  [[nodiscard]] const std::optional<HealthView>& health() const { return health_; }
  [[nodiscard]] const FeedState& feed() const { return feed_; }
  [[nodiscard]] bool has_enough() const { return options_.count > 0 && feed_.messages >= options_.count; }
  [[nodiscard]] bool has_waited_enough(Time now) const;

 private:
  const WatchOptions& options_;
  Time start_;
  Time last_message_;
  std::int64_t silence_told_s_{};
  SequenceCheck sequence_;
  ChangeLines changes_;
  std::optional<HealthView> health_;
  FeedState feed_;
};

}  // namespace airworthy::watch
