#pragma once

#include "drivers/ports/port.h"

namespace airworthy::drivers {

/// A serial device in raw mode: 8 data bits, no parity, one stop bit, no flow control, used by nobody else.
class SerialPort final : public Port {
 public:
  SerialPort(boost::asio::io_context& io, LinkAddress address, const Params& params)
      : Port{io, std::move(address), params} {}

  [[nodiscard]] static bool is_supported_baud(std::uint32_t baud);

 private:
  [[nodiscard]] rt::Expected<int> open_descriptor() override;
};

}  // namespace airworthy::drivers
