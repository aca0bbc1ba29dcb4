#pragma once

#include <string>

namespace airworthy::gateway {

struct FeedConfig {
  std::string endpoint = "tcp://127.0.0.1:5710";
  bool allow_plain_remote = false;  ///< the feed is not encrypted
  int high_water_mark = 1000;  ///< messages kept for a slow subscriber, beyond which its messages are dropped
  int linger_ms = 200;         ///< how long the end of the program waits for what is not yet sent
};

}  // namespace airworthy::gateway
