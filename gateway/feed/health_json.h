#pragma once

#include <nlohmann/json.hpp>

#include "gateway/feed/feed_time.h"
#include "gateway/health/health_snapshot.h"

namespace airworthy::gateway {

/// The feed's words for the states, as docs/feed.md lists them.
[[nodiscard]] const char* to_word(health::Status status);
[[nodiscard]] const char* to_word(health::ProcessStatus status);
[[nodiscard]] const char* to_word(health::LinkStatus status);
[[nodiscard]] const char* to_word(health::FaultPhase phase);
[[nodiscard]] const char* to_word(health::Severity severity);

[[nodiscard]] nlohmann::json to_json(const health::FaultReport& fault, const FeedTime& time);
[[nodiscard]] nlohmann::json to_json(const health::HealthSnapshot& snapshot, const FeedTime& time);

}  // namespace airworthy::gateway
