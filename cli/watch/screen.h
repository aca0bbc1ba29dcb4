#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/watch/health_view.h"

namespace airworthy::watch {

/// What a watcher knows of the feed itself.
struct FeedState {
  std::string endpoint;
  std::int64_t messages{};
  std::int64_t lost{};
  std::int64_t refused{};
  std::string refusal;  ///< why the last one was refused
  std::int64_t gateway_restarts{};
  std::optional<double> silent_s;  ///< set once nothing came for longer than a healthy feed is quiet
};

/// "12 s", "3 min 20 s", "2 h 5 min", "4 d 1 h".
[[nodiscard]] std::string duration_text(std::int64_t duration_us);

/// "no data from tcp://... for 3 s".
[[nodiscard]] std::string silence_text(const FeedState& feed);

/// The whole picture as lines of at most `columns` characters, at most `rows` of them.
[[nodiscard]] std::vector<std::string> screen(const std::optional<HealthView>& health, const FeedState& feed,
                                              std::size_t columns, std::size_t rows, bool colour);

}  // namespace airworthy::watch
