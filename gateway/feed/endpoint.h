#pragma once

#include <optional>
#include <string>

namespace airworthy::gateway {

/// Why the feed cannot be served at this ZeroMQ endpoint, or nothing. tcp://ADDRESS:PORT, ipc://PATH and
/// inproc://NAME are known; ADDRESS is numeric, `localhost`, an interface or `*`.
[[nodiscard]] std::optional<std::string> endpoint_error(const std::string& endpoint);

/// True only if no other computer can reach the endpoint.
[[nodiscard]] bool is_local_endpoint(const std::string& endpoint);

}  // namespace airworthy::gateway
