#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace airworthy::doctor {

struct Route {
  std::string interface;
  bool rejects = false;  ///< unreachable, prohibit or blackhole: the kernel refuses to send
};

/// The route that the kernel takes to an IPv4 address (dotted), according to the text of /proc/net/route: the
/// longest prefix, then the least metric. LCM looks at the same table when it opens a bus.
[[nodiscard]] std::optional<Route> find_route(std::string_view table, const std::string& address);

}  // namespace airworthy::doctor
