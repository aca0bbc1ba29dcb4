#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "cli/import/flight_log.h"

namespace airworthy::importer {

/// One source of messages in order of time: a topic's file, a telemetry log.
class Feed {
 public:
  Feed() = default;
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;
  virtual ~Feed() = default;

  /// Moves to the next message; false at the end.
  [[nodiscard]] virtual rt::Expected<bool> next() = 0;
  /// Of the current message.
  [[nodiscard]] virtual TimePoint time() const = 0;
  virtual void publish(FlightLog& log) = 0;

  /// Bytes of input consumed so far, and in all.
  [[nodiscard]] virtual std::uint64_t position() const = 0;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
};

/// Told how far the import is, in 0..1; an error stops it.
using Progress = std::function<rt::Expected<void>(double done_ratio)>;

/// What really happened, and when. Without a time it was so from the start.
struct Truth {
  std::string component;  ///< empty = whole flight healthy
  std::string fault_kind;
  std::optional<TimePoint> time;        ///< onset, or with kNoFault the end of a fault
  std::optional<Duration> after_start;  ///< the same, counted from the first message
  double magnitude = std::numeric_limits<double>::quiet_NaN();
};
inline constexpr const char* kNoFault = "none";

/// Publishes everything in order of time; at equal times truth first, then in order of the feeds.
[[nodiscard]] rt::Expected<void> merge(std::vector<std::unique_ptr<Feed>>& feeds, std::vector<Truth> truths,
                                       FlightLog& log, const Progress& progress);

}  // namespace airworthy::importer
