#include "drivers/ports/link_address.h"

#include <arpa/inet.h>

#include <charconv>

#include "drivers/ports/serial_port.h"

namespace airworthy::drivers {
namespace {

constexpr std::string_view kForms =
    "must be serial:DEVICE:BAUD, udp-listen:ADDRESS:PORT, udp:ADDRESS:PORT or tcp:ADDRESS:PORT";

bool is_numeric_address(const std::string& text) {
  in6_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1 || inet_pton(AF_INET6, text.c_str(), &address) == 1;
}

}  // namespace

rt::Expected<LinkAddress> LinkAddress::parse(std::string_view text) {
  LinkAddress address;
  address.text = text;
  const auto first = text.find(':');
  const auto last = text.rfind(':');
  if (first == std::string_view::npos || first == last) return rt::fail_with(std::string{kForms});
  const std::string_view kind = text.substr(0, first);
  if (kind == "serial") {
    address.kind = LinkKind::kSerial;
  } else if (kind == "udp-listen") {
    address.kind = LinkKind::kUdpListen;
  } else if (kind == "udp") {
    address.kind = LinkKind::kUdp;
  } else if (kind == "tcp") {
    address.kind = LinkKind::kTcp;
  } else {
    return rt::fail_with(std::string{kForms});
  }
  std::string_view target = text.substr(first + 1, last - first - 1);
  const std::string_view number = text.substr(last + 1);
  const auto parsed = std::from_chars(number.data(), number.data() + number.size(), address.number);
  const bool is_number = parsed.ec == std::errc{} && parsed.ptr == number.data() + number.size();

  if (address.kind == LinkKind::kSerial) {
    if (target.empty()) return rt::fail_with("the serial device is missing");
    if (!is_number || !SerialPort::is_supported_baud(address.number)) {
      return rt::fail_with(
          "the baud rate must be one that serial ports know, such as 57600, 115200 or 921600");
    }
  } else {
    if (target.size() >= 2 && target.front() == '[' && target.back() == ']') {
      target = target.substr(1, target.size() - 2);
    }
    if (!is_numeric_address(std::string{target})) return rt::fail_with("the address must be numeric");
    if (!is_number || address.number == 0 || address.number > 65535) {
      return rt::fail_with("the port must lie in [1, 65535]");
    }
  }
  address.target = target;
  return address;
}

}  // namespace airworthy::drivers
