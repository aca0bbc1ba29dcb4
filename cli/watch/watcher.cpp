#include "cli/watch/watcher.h"

#include <fmt/format.h>

#include <cmath>

namespace airworthy::watch {

Watcher::Watcher(const WatchOptions& options, Time start)
    : options_{options}, start_{start}, last_message_{start} {
  feed_.endpoint = options.endpoint;
}

std::vector<std::string> Watcher::add(const FeedMessage& message, Time now) {
  std::vector<std::string> lines;
  if (feed_.silent_s) lines.push_back(fmt::format("data again from {}", options_.endpoint));
  feed_.silent_s.reset();
  silence_told_s_ = 0;
  last_message_ = now;
  ++feed_.messages;

  const SequenceCheck::Finding finding = sequence_.add(message.session, message.sequence);
  feed_.lost = sequence_.lost();
  if (finding.restarted) {
    ++feed_.gateway_restarts;
    lines.emplace_back("the gateway restarted");
  }
  if (finding.lost > 0) lines.push_back(fmt::format("lost {} messages", finding.lost));

  if (options_.json) {
    // Escaped down to ASCII: nothing in it can command a terminal, and it is one line.
    return {message.body.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace)};
  }
  if (message.kind == "event") {
    lines.push_back(event_line(event_view(message.body)));
  } else if (message.kind == "health") {
    health_ = health_view(message.body);
    for (std::string& line : changes_.add(*health_)) lines.push_back(std::move(line));
  }
  if (!health_ || health_->utc.empty()) return lines;
  for (std::string& line : lines) line.insert(0, health_->utc + " ");
  return lines;
}

std::vector<std::string> Watcher::refuse(const std::string& reason) {
  ++feed_.refused;
  if (std::exchange(feed_.refusal, reason) == reason) return {};
  return {"message refused: " + reason};
}

std::vector<std::string> Watcher::check(Time now) {
  if (now - last_message_ < kSilence) return {};
  feed_.silent_s = std::chrono::duration<double>(now - last_message_).count();
  // Told after 2, 4, 8 ... seconds: often enough to notice, seldom enough to leave the log readable.
  const auto whole_s = static_cast<std::int64_t>(*feed_.silent_s);
  if (whole_s < 2 || whole_s < 2 * silence_told_s_) return {};
  silence_told_s_ = whole_s;
  return {silence_text(feed_)};
}

bool Watcher::has_waited_enough(Time now) const {
  return options_.timeout_s > 0.0 &&
         std::chrono::duration<double>(now - start_).count() >= options_.timeout_s;
}

}  // namespace airworthy::watch
