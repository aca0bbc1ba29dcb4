#include "drivers/ports/udp_port.h"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace airworthy::drivers {

rt::Expected<int> UdpPort::open_descriptor() {
  const SocketAddress where = SocketAddress::of(address());
  const int descriptor = socket(where.storage.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return rt::fail_with(std::strerror(errno));
  const bool listens = address().kind == LinkKind::kUdpListen;
  peer_ = listens ? SocketAddress{} : where;
  const int result =
      listens ? bind(descriptor, where.get(), where.size) : connect(descriptor, where.get(), where.size);
  if (result == 0) return descriptor;
  const std::string problem = std::strerror(errno);
  ::close(descriptor);
  return rt::fail_with(address().text + ": " + problem);
}

ssize_t UdpPort::receive(int descriptor, std::span<std::uint8_t> buffer) {
  SocketAddress sender;
  sender.size = sizeof sender.storage;
  const ssize_t count = recvfrom(descriptor, buffer.data(), buffer.size(), 0, sender.get(), &sender.size);
  if (count > 0 && address().kind == LinkKind::kUdpListen) peer_ = sender;
  return count;
}

ssize_t UdpPort::send(int descriptor, std::span<const std::uint8_t> bytes) {
  if (peer_.size == 0) {
    errno = EDESTADDRREQ;
    return -1;
  }
  if (address().kind == LinkKind::kUdp) return ::send(descriptor, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  return sendto(descriptor, bytes.data(), bytes.size(), MSG_NOSIGNAL, peer_.get(), peer_.size);
}

}  // namespace airworthy::drivers
