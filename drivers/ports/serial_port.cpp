#include "drivers/ports/serial_port.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace airworthy::drivers {
namespace {

struct BaudRate {
  std::uint32_t baud;
  speed_t speed;
};
constexpr std::array kBaudRates{
    BaudRate{9600, B9600},       BaudRate{19200, B19200},     BaudRate{38400, B38400},
    BaudRate{57600, B57600},     BaudRate{115200, B115200},   BaudRate{230400, B230400},
    BaudRate{460800, B460800},   BaudRate{500000, B500000},   BaudRate{576000, B576000},
    BaudRate{921600, B921600},   BaudRate{1000000, B1000000}, BaudRate{1500000, B1500000},
    BaudRate{2000000, B2000000}, BaudRate{2500000, B2500000}, BaudRate{3000000, B3000000}};

const BaudRate* find_baud(std::uint32_t baud) {
  const auto* found = std::find_if(kBaudRates.begin(), kBaudRates.end(),
                                   [baud](const BaudRate& rate) { return rate.baud == baud; });
  return found == kBaudRates.end() ? nullptr : found;
}

/// Empty if the descriptor is now a raw serial line.
std::string configure(int descriptor, speed_t speed) {
  termios settings{};
  if (tcgetattr(descriptor, &settings) != 0) return std::strerror(errno);
  cfmakeraw(&settings);
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  settings.c_cflag |= static_cast<tcflag_t>(CLOCAL | CREAD);
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  if (cfsetspeed(&settings, speed) != 0 || tcsetattr(descriptor, TCSANOW, &settings) != 0) {
    return std::strerror(errno);
  }
  // What lay in the buffers is of unknown age.
  if (tcflush(descriptor, TCIOFLUSH) != 0) return std::strerror(errno);
  if (ioctl(descriptor, TIOCEXCL) != 0) return std::strerror(errno);
  return {};
}

}  // namespace

bool SerialPort::is_supported_baud(std::uint32_t baud) { return find_baud(baud) != nullptr; }

rt::Expected<int> SerialPort::open_descriptor() {
  const int descriptor = ::open(address().target.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return rt::fail_with(address().target + ": " + std::strerror(errno));
  const BaudRate* rate = find_baud(address().number);
  const std::string problem = rate == nullptr ? "unsupported baud rate" : configure(descriptor, rate->speed);
  if (problem.empty()) return descriptor;
  ::close(descriptor);
  return rt::fail_with(address().target + ": " + problem);
}

}  // namespace airworthy::drivers
