#pragma once

#include "drivers/ports/port.h"

namespace airworthy::drivers {

/// A TCP client.
class TcpPort final : public Port {
 public:
  TcpPort(boost::asio::io_context& io, LinkAddress address, const Params& params)
      : Port{io, std::move(address), params} {}

 private:
  [[nodiscard]] rt::Expected<int> open_descriptor() override;
  [[nodiscard]] bool connects() const override { return true; }
  [[nodiscard]] ssize_t send(int descriptor, std::span<const std::uint8_t> bytes) override;
};

}  // namespace airworthy::drivers
