#pragma once

#include "drivers/ports/port.h"
#include "drivers/ports/socket_address.h"

namespace airworthy::drivers {

/// UDP, either listening on a local port, where answers go to whoever sent last, or connected to a remote
/// one.
class UdpPort final : public Port {
 public:
  UdpPort(boost::asio::io_context& io, LinkAddress address, const Params& params)
      : Port{io, std::move(address), params} {}

 private:
  [[nodiscard]] rt::Expected<int> open_descriptor() override;
  [[nodiscard]] ssize_t receive(int descriptor, std::span<std::uint8_t> buffer) override;
  [[nodiscard]] ssize_t send(int descriptor, std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] bool is_datagram() const override { return true; }

  SocketAddress peer_;  // size 0 = nobody yet
};

}  // namespace airworthy::drivers
