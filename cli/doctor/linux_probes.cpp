#include "cli/doctor/linux_probes.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <ctime>
#include <fstream>
#include <sstream>

namespace airworthy::doctor {
namespace {

class Socket {
 public:
  Socket() : descriptor_{socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)} {}
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  [[nodiscard]] int get() const { return descriptor_; }
  [[nodiscard]] bool open() const { return descriptor_ >= 0; }

 private:
  int descriptor_;
};

std::optional<std::string> read_file(const char* path) {
  std::ifstream file{path};
  if (!file) return std::nullopt;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::optional<bool> is_loopback_up() {
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return std::nullopt;
  std::optional<bool> up;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if ((entry->ifa_flags & IFF_LOOPBACK) != 0) up = up.value_or(false) || (entry->ifa_flags & IFF_UP) != 0;
  }
  freeifaddrs(list);
  return up;
}

Delivery refused(Delivery::Outcome outcome) { return {outcome, errno}; }

Delivery try_delivery(const BusAddress& address) {
  using Outcome = Delivery::Outcome;
  const Socket receiver;
  const Socket sender;
  sockaddr_in target{};
  socklen_t size = sizeof target;
  target.sin_family = AF_INET;
  target.sin_addr.s_addr = htonl(INADDR_ANY);
  target.sin_port = 0;  // the kernel chooses a port that nobody uses
  if (!receiver.open() || !sender.open() ||
      bind(receiver.get(), reinterpret_cast<const sockaddr*>(&target), sizeof target) != 0 ||
      getsockname(receiver.get(), reinterpret_cast<sockaddr*>(&target), &size) != 0) {
    return refused(Outcome::kNoSocket);
  }

  ip_mreq membership{};
  inet_pton(AF_INET, address.group.c_str(), &membership.imr_multiaddr);
  if (setsockopt(receiver.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
    return refused(Outcome::kJoinRefused);
  }
  const unsigned char ttl = 0;  // whatever the bus does, this datagram stays here
  if (setsockopt(sender.get(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl) != 0) {
    return refused(Outcome::kNoSocket);
  }

  target.sin_addr = membership.imr_multiaddr;
  constexpr int kAttempts = 3;
  constexpr int kPatience_ms = 300;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    const std::array<std::int64_t, 3> sent{now.tv_sec, now.tv_nsec, getpid()};
    if (sendto(sender.get(), sent.data(), sizeof sent, 0, reinterpret_cast<const sockaddr*>(&target),
               sizeof target) != static_cast<ssize_t>(sizeof sent)) {
      return refused(Outcome::kSendRefused);
    }
    pollfd wait{receiver.get(), POLLIN, 0};
    while (poll(&wait, 1, kPatience_ms) == 1) {
      std::array<std::int64_t, 3> got{};
      if (recv(receiver.get(), got.data(), sizeof got, MSG_DONTWAIT) == static_cast<ssize_t>(sizeof got) &&
          got == sent) {
        return {Outcome::kDelivered, 0};
      }
    }
  }
  return {Outcome::kLost, 0};
}

MulticastProbe probe_multicast(const BusAddress& address) {
  MulticastProbe probe;
  probe.address = address;
  probe.loopback_up = is_loopback_up();
  if (!address.multicast) return probe;
  if (const auto table = read_file("/proc/net/route")) {
    probe.route_table_read = true;
    probe.route = find_route(*table, address.group);
  }
  if (probe.route || !probe.route_table_read) probe.delivery = try_delivery(address);
  return probe;
}

std::optional<std::int64_t> receive_buffer_bytes(const Socket& socket) {
  int bytes = 0;
  socklen_t size = sizeof bytes;
  if (getsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &bytes, &size) != 0) return std::nullopt;
  return bytes;
}

/// Asks the kernel for a buffer rather than reading /proc/sys/net/core, which a network namespace does not
/// show.
ReceiveBufferProbe probe_receive_buffer() {
  const Socket socket;
  if (!socket.open()) return {};
  ReceiveBufferProbe probe;
  probe.default_bytes = receive_buffer_bytes(socket);
  const int wanted = static_cast<int>(kWantedReceiveBuffer_bytes);
  if (setsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &wanted, sizeof wanted) != 0) return probe;
  // socket(7): the kernel doubles what was asked for, for its own bookkeeping, and returns the doubled value.
  if (const auto granted = receive_buffer_bytes(socket)) probe.largest_bytes = *granted / 2;
  return probe;
}

TimeProbe probe_time() {
  TimeProbe probe;
  probe.build_time_s = AIRWORTHY_BUILD_TIME_S;
  timex state{};
  const int clock_state = adjtimex(&state);
  if (clock_state >= 0) probe.synchronised = clock_state != TIME_ERROR && (state.status & STA_UNSYNC) == 0;
  constexpr int kReadings = 1000;
  for (int reading = 0; reading < kReadings; ++reading) {
    timespec now{};
    if (clock_gettime(CLOCK_BOOTTIME, &now) != 0) break;
    probe.boottime_ns.push_back(static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec);
  }
  timespec wall{};
  if (clock_gettime(CLOCK_REALTIME, &wall) == 0) probe.wall_clock_s = wall.tv_sec;
  return probe;
}

std::optional<std::int64_t> available_memory_bytes() {
  std::ifstream file{"/proc/meminfo"};
  std::string key;
  std::int64_t kibibytes = 0;
  std::string unit;
  while (file >> key >> kibibytes) {
    if (key == "MemAvailable:") return kibibytes * 1024;
    std::getline(file, unit);
  }
  return std::nullopt;
}

ResourceProbe probe_resources(const std::string& log_directory) {
  ResourceProbe probe;
  probe.log_directory = log_directory;
  struct statvfs disk {};
  if (statvfs(log_directory.c_str(), &disk) == 0) {
    probe.disk_free_bytes =
        static_cast<std::int64_t>(disk.f_bavail) * static_cast<std::int64_t>(disk.f_frsize);
    probe.log_directory_writable = access(log_directory.c_str(), W_OK) == 0;
  }
  probe.memory_available_bytes = available_memory_bytes();
  return probe;
}

}  // namespace

Probes probe_this_computer(const BusAddress& address, const std::string& log_directory) {
  return {probe_multicast(address), probe_receive_buffer(), probe_time(), probe_resources(log_directory)};
}

}  // namespace airworthy::doctor
