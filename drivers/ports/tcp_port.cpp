#include "drivers/ports/tcp_port.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "drivers/ports/socket_address.h"

namespace airworthy::drivers {

rt::Expected<int> TcpPort::open_descriptor() {
  const SocketAddress where = SocketAddress::of(address());
  const int descriptor = socket(where.storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return rt::fail_with(std::strerror(errno));
  const int yes = 1;
  // Small messages at once; a peer that vanished without a word is noticed by the driver's own silence limit.
  setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  if (connect(descriptor, where.get(), where.size) == 0 || errno == EINPROGRESS) return descriptor;
  const std::string problem = std::strerror(errno);
  ::close(descriptor);
  return rt::fail_with(address().text + ": " + problem);
}

ssize_t TcpPort::send(int descriptor, std::span<const std::uint8_t> bytes) {
  return ::send(descriptor, bytes.data(), bytes.size(), MSG_NOSIGNAL);
}

}  // namespace airworthy::drivers
