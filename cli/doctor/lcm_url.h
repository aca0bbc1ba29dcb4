#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "runtime/error.h"

namespace airworthy::doctor {

/// Where a bus URL sends messages. Only udpm:// has a group; memq:// and file:// stay inside a process or a
/// file.
struct BusAddress {
  bool multicast = true;
  std::string group = "239.255.76.67";
  std::uint16_t port = 7667;
  int ttl = 0;  ///< 0 = messages do not leave the computer
};

/// Reads LCM's notation udpm://[GROUP][:PORT][?ttl=N&...]; what is left out has LCM's default. An empty URL
/// is the default bus.
[[nodiscard]] rt::Expected<BusAddress> parse_lcm_url(std::string_view url);

}  // namespace airworthy::doctor
