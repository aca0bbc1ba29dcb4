#pragma once

#include <sys/socket.h>

#include "drivers/ports/link_address.h"

namespace airworthy::drivers {

/// A numeric address and port as the kernel wants them.
struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;

  [[nodiscard]] const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
  [[nodiscard]] sockaddr* get() { return reinterpret_cast<sockaddr*>(&storage); }
  [[nodiscard]] static SocketAddress of(const LinkAddress& address);
};

}  // namespace airworthy::drivers
