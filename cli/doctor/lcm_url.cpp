#include "cli/doctor/lcm_url.h"

#include <arpa/inet.h>

#include <charconv>
#include <optional>

namespace airworthy::doctor {
namespace {

std::optional<int> to_int(std::string_view text, int low, int high) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < low || value > high)
    return std::nullopt;
  return value;
}

/// Text before `mark`, which is removed from `rest` together with the mark; everything if there is none.
std::string_view take_until(char mark, std::string_view& rest) {
  const auto at = rest.find(mark);
  const auto head = rest.substr(0, at);
  rest = at == std::string_view::npos ? std::string_view{} : rest.substr(at + 1);
  return head;
}

}  // namespace

rt::Expected<BusAddress> parse_lcm_url(std::string_view url) {
  BusAddress address;
  if (url.empty()) return address;
  const auto invalid = [whole = std::string{url}](const std::string& reason) {
    return rt::fail_with("LCM URL '" + whole + "': " + reason);
  };

  const auto scheme_end = url.find("://");
  if (scheme_end == std::string_view::npos) return invalid("must look like udpm://239.255.76.67:7667?ttl=0");
  if (url.substr(0, scheme_end) != "udpm") {
    address.multicast = false;
    return address;
  }

  auto options = url.substr(scheme_end + 3);
  auto port = take_until('?', options);
  const auto group = take_until(':', port);
  if (!group.empty()) {
    address.group = group;
    in_addr parsed{};
    if (inet_pton(AF_INET, address.group.c_str(), &parsed) != 1 || !IN_MULTICAST(ntohl(parsed.s_addr))) {
      return invalid("'" + address.group + "' is not a multicast address (224.0.0.0 to 239.255.255.255)");
    }
  }
  if (!port.empty()) {
    const auto number = to_int(port, 1, 65535);
    if (!number) return invalid("port '" + std::string{port} + "' must be 1 to 65535");
    address.port = static_cast<std::uint16_t>(*number);
  }
  while (!options.empty()) {
    auto value = take_until('&', options);
    if (take_until('=', value) != "ttl") continue;
    const auto number = to_int(value, 0, 255);
    if (!number) return invalid("ttl '" + std::string{value} + "' must be 0 to 255");
    address.ttl = *number;
  }
  return address;
}

}  // namespace airworthy::doctor
