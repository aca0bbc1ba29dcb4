#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

namespace airworthy::drivers::testing {

/// A descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_{fd} {}
  Descriptor(Descriptor&& other) noexcept : fd_{std::exchange(other.fd_, -1)} {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    close();
    fd_ = std::exchange(other.fd_, -1);
    return *this;
  }
  ~Descriptor() { close(); }
  void close() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

inline sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

/// A socket bound to the loopback, to a free port if 0 is asked for.
inline Descriptor bound_socket(int type, std::uint16_t& port) {
  Descriptor descriptor{socket(AF_INET, type, 0)};
  const int yes = 1;
  setsockopt(descriptor.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address = loopback(port);
  EXPECT_EQ(bind(descriptor.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  socklen_t size = sizeof address;
  getsockname(descriptor.get(), reinterpret_cast<sockaddr*>(&address), &size);
  port = ntohs(address.sin_port);
  if (type == SOCK_STREAM) {
    EXPECT_EQ(listen(descriptor.get(), 1), 0);
  }
  return descriptor;
}

/// A pseudo-terminal at a stable path, so that it can vanish and come back like a USB device.
class FakeDevice {
 public:
  FakeDevice()
      : link_{std::filesystem::temp_directory_path() / ("airworthy_tty_" + std::to_string(getpid()))} {
    plug();
  }
  ~FakeDevice() { unplug(); }
  FakeDevice(const FakeDevice&) = delete;
  FakeDevice& operator=(const FakeDevice&) = delete;
  void plug() {
    int controller = -1;
    int terminal = -1;
    char name[64];
    ASSERT_EQ(openpty(&controller, &terminal, name, nullptr, nullptr), 0);
    ::close(terminal);
    controller_ = Descriptor{controller};
    std::filesystem::create_symlink(name, link_);
  }
  void unplug() {
    std::filesystem::remove(link_);
    controller_.close();
  }
  [[nodiscard]] std::string path() const { return link_.string(); }
  [[nodiscard]] int fd() const { return controller_.get(); }

 private:
  std::filesystem::path link_;
  Descriptor controller_;
};

}  // namespace airworthy::drivers::testing
