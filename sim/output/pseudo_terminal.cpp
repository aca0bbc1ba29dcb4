#include "sim/output/pseudo_terminal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace airworthy::sim {
namespace {

constexpr int kPatience_ms = 2;  // for a driver that is about to read

}  // namespace

rt::Expected<std::unique_ptr<PseudoTerminal>> PseudoTerminal::open(const std::filesystem::path& link) {
  std::error_code error;
  if (std::filesystem::is_symlink(link, error)) {
    std::filesystem::remove(link, error);
  } else if (std::filesystem::exists(link, error)) {
    return rt::fail_with(fmt::format("{}: exists and is not a symbolic link", link.string()));
  }
  int device = -1;
  int line = -1;
  if (openpty(&device, &line, nullptr, nullptr, nullptr) != 0) {
    return rt::fail_with(fmt::format("no pseudo-terminal: {}", std::strerror(errno)));
  }
  // Owned from here on, whatever fails below.
  std::unique_ptr<PseudoTerminal> terminal{new PseudoTerminal{device, line, link}};
  termios raw{};
  std::array<char, 256> name{};
  if (tcgetattr(line, &raw) != 0 || ttyname_r(line, name.data(), name.size()) != 0) {
    return rt::fail_with(fmt::format("pseudo-terminal: {}", std::strerror(errno)));
  }
  cfmakeraw(&raw);
  if (tcsetattr(line, TCSANOW, &raw) != 0 ||
      fcntl(device, F_SETFL, fcntl(device, F_GETFL) | O_NONBLOCK) != 0) {
    return rt::fail_with(fmt::format("pseudo-terminal: {}", std::strerror(errno)));
  }
  std::filesystem::create_symlink(name.data(), link, error);
  if (error) return rt::fail_with(fmt::format("{}: {}", link.string(), error.message()));
  return terminal;
}

PseudoTerminal::~PseudoTerminal() {
  std::error_code ignored;
  std::filesystem::remove(link_, ignored);
  close(line_);
  close(device_);
}

void PseudoTerminal::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(device_, bytes.data(), bytes.size());
    if (written > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
      continue;
    }
    pollfd waiting{device_, POLLOUT, 0};
    if (errno == EINTR) continue;
    if (errno != EAGAIN || poll(&waiting, 1, kPatience_ms) <= 0) {
      ++writes_dropped_;
      return;
    }
  }
}

std::vector<std::uint8_t> PseudoTerminal::read() {
  std::vector<std::uint8_t> result(4096);
  const ssize_t got = ::read(device_, result.data(), result.size());
  result.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  return result;
}

}  // namespace airworthy::sim
