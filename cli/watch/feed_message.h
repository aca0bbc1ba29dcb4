#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "runtime/error.h"

namespace airworthy::watch {

/// One message of a feed; docs/feed.md describes them.
struct FeedMessage {
  static constexpr int kSchema = 1;

  std::string kind;
  std::string vehicle;
  std::int64_t session{};
  std::int64_t sequence{};
  nlohmann::json body;  ///< an object; its other members may be anything
};

/// What a peer sent may be anything: all that identifies the message is checked, or the reason is given.
[[nodiscard]] rt::Expected<FeedMessage> parse_message(std::string_view topic, std::string_view sequence,
                                                      std::string_view body);

}  // namespace airworthy::watch
