#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "runtime/error.h"

namespace airworthy::drivers {

enum class LinkKind : std::uint8_t { kSerial, kUdpListen, kUdp, kTcp };

/// Where a device is reached. Written
///   serial:/dev/ttyAMA0:921600      a serial device and its baud rate
///   udp-listen:0.0.0.0:14540        a local port; answers go to whoever sent last
///   udp:192.168.1.10:14550          a remote port
///   tcp:127.0.0.1:5760              a server
/// Hosts are numeric, IPv6 in brackets: looking up a name would block.
struct LinkAddress {
  LinkKind kind = LinkKind::kSerial;
  std::string target;        ///< device path or numeric address
  std::uint32_t number = 0;  ///< baud rate or port
  std::string text;          ///< as written

  /// The error says what is wrong, without the text itself.
  [[nodiscard]] static rt::Expected<LinkAddress> parse(std::string_view text);
};

}  // namespace airworthy::drivers
