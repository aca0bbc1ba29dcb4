#include "gateway/feed/endpoint.h"

#include <fmt/format.h>

#include <boost/asio/ip/address.hpp>
#include <boost/system/error_code.hpp>
#include <charconv>
#include <string_view>

namespace airworthy::gateway {
namespace {

constexpr std::string_view kTcp = "tcp://";
constexpr std::string_view kIpc = "ipc://";
constexpr std::string_view kInproc = "inproc://";
/// Of the kernel, for the path of a local socket, with its closing zero.
constexpr std::size_t kLongestSocketPath = 107;

struct TcpAddress {
  std::string host;
  std::string_view port;
};

std::optional<TcpAddress> split(std::string_view endpoint) {
  const std::string_view rest = endpoint.substr(kTcp.size());
  const std::size_t colon = rest.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return std::nullopt;
  std::string_view host = rest.substr(0, colon);
  if (host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  return TcpAddress{std::string{host}, rest.substr(colon + 1)};
}

}  // namespace

std::optional<std::string> endpoint_error(const std::string& endpoint) {
  if (endpoint.starts_with(kIpc)) {
    const std::size_t length = endpoint.size() - kIpc.size();
    if (length == 0) return fmt::format("{} names no path", endpoint);
    if (length > kLongestSocketPath) {
      return fmt::format("the path has {} characters; a local socket takes at most {}", length,
                         kLongestSocketPath);
    }
    return std::nullopt;
  }
  if (endpoint.starts_with(kInproc) && endpoint.size() > kInproc.size()) return std::nullopt;
  if (!endpoint.starts_with(kTcp)) {
    return fmt::format("\"{}\" is no endpoint: must be tcp://ADDRESS:PORT or ipc://PATH", endpoint);
  }
  const auto tcp = split(endpoint);
  if (!tcp || tcp->host.empty())
    return fmt::format("\"{}\" is no endpoint: must be tcp://ADDRESS:PORT", endpoint);
  unsigned port = 0;
  const auto [end, error] = std::from_chars(tcp->port.data(), tcp->port.data() + tcp->port.size(), port);
  if (error != std::errc{} || end != tcp->port.data() + tcp->port.size() || port < 1 || port > 65'535) {
    return fmt::format("\"{}\" is no port: must be 1 to 65535", tcp->port);
  }
  return std::nullopt;
}

bool is_local_endpoint(const std::string& endpoint) {
  if (endpoint.starts_with(kIpc) || endpoint.starts_with(kInproc)) return true;
  if (!endpoint.starts_with(kTcp)) return false;
  const auto tcp = split(endpoint);
  if (!tcp) return false;
  if (tcp->host == "localhost" || tcp->host == "lo") return true;
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(tcp->host, error);
  return !error && address.is_loopback();
}

}  // namespace airworthy::gateway
