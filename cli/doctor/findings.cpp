#include "cli/doctor/findings.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <iterator>

namespace airworthy::doctor {
namespace {

// For a bus that stays on this computer.
constexpr auto kAddRoute = "ip route replace 224.0.0.0/4 dev lo";
constexpr auto kKeepRoute =
    "with systemd-networkd, a file /etc/systemd/network/10-loopback.network:\n"
    "  [Match]\n  Name=lo\n  [Route]\n  Destination=224.0.0.0/4\n"
    "with ifupdown, in /etc/network/interfaces below 'iface lo inet loopback':\n"
    "  up ip route replace 224.0.0.0/4 dev lo";

constexpr std::int64_t kMebibyte = std::int64_t{1024} * 1024;
constexpr std::int64_t kFewDefaultBuffer_bytes = kMebibyte;
constexpr std::int64_t kLittleDisk_bytes = 1024 * kMebibyte;
constexpr std::int64_t kNoDisk_bytes = 100 * kMebibyte;
constexpr std::int64_t kLittleMemory_bytes = 256 * kMebibyte;
constexpr std::int64_t kNoMemory_bytes = 64 * kMebibyte;

std::string human(std::int64_t bytes) {
  static constexpr std::array kUnits{"B", "KiB", "MiB", "GiB", "TiB"};
  auto value = static_cast<double>(bytes);
  std::size_t unit = 0;
  for (; value >= 1024.0 && unit + 1 < kUnits.size(); ++unit) value /= 1024.0;
  return fmt::format("{:.{}f} {}", value, unit == 0 || value >= 100.0 ? 0 : 1, kUnits.at(unit));
}

Finding ok(std::string id, std::string found) {
  return {std::move(id), Level::kOk, std::move(found), {}, {}, {}};
}

Finding unknown(std::string id, std::string found, std::string why) {
  return {std::move(id), Level::kUnknown, std::move(found), std::move(why), {}, {}};
}

Finding judge_loopback(const MulticastProbe& probe) {
  const std::string id = "multicast.loopback_up";
  if (!probe.loopback_up) {
    return unknown(id, "the network interfaces could not be listed",
                   "the processes talk to each other through the loopback interface");
  }
  if (*probe.loopback_up) return ok(id, "the loopback interface is up");
  return {id,
          Level::kFailure,
          "the loopback interface is down",
          "the processes on this computer talk to each other through it",
          "ip link set lo up",
          "every init system does this at boot; a container or network namespace must do it itself"};
}

Finding judge_route(const MulticastProbe& probe) {
  const std::string id = "multicast.route";
  const auto& group = probe.address.group;
  const bool leaves_computer = probe.address.ttl > 0;
  const std::string cure = leaves_computer ? "ip route replace 224.0.0.0/4 dev INTERFACE" : kAddRoute;
  const std::string permanent =
      leaves_computer ? "INTERFACE is the one that leads to the vehicle's other computers (ip -brief link)"
                      : kKeepRoute;
  if (!probe.address.multicast) return ok(id, "this bus needs no route");
  if (!probe.route_table_read) {
    return unknown(id, "/proc/net/route could not be read", "without a route to the group LCM opens no bus");
  }
  if (!probe.route) {
    return {id,
            Level::kFailure,
            fmt::format("no route to the bus's group {}", group),
            "LCM opens no bus without one, so no process starts",
            cure,
            permanent};
  }
  if (probe.route->rejects) {
    return {
        id,
        Level::kFailure,
        fmt::format("the route to the bus's group {} refuses it (unreachable, prohibit or blackhole)", group),
        "no message leaves its process",
        fmt::format("ip route replace {}/32 dev {}", group, leaves_computer ? "INTERFACE" : "lo"),
        permanent};
  }
  const auto& interface = probe.route->interface;
  if (interface != "lo" && !leaves_computer) {
    return {
        id,
        Level::kWarning,
        fmt::format("messages that stay on this computer are routed through {}", interface),
        fmt::format("when {} goes down, as wireless links do, its route goes and the bus with it", interface),
        cure,
        permanent};
  }
  if (interface == "lo" && leaves_computer) {
    return {
        id,
        Level::kWarning,
        fmt::format("messages meant for other computers (ttl={}) are routed through lo", probe.address.ttl),
        "the vehicle's other computers hear nothing",
        cure,
        permanent};
  }
  return ok(id, fmt::format("{} is routed through {}", group, interface));
}

Finding judge_delivery(const MulticastProbe& probe) {
  using Outcome = Delivery::Outcome;
  const std::string id = "multicast.delivery";
  if (!probe.address.multicast) return ok(id, "this bus needs no multicast");
  const auto failure = [&](std::string found, std::string why, std::string cure, std::string permanent) {
    return Finding{
        id, Level::kFailure, std::move(found), std::move(why), std::move(cure), std::move(permanent)};
  };
  const std::string reason = std::strerror(probe.delivery.error);
  switch (probe.delivery.outcome) {
    case Outcome::kDelivered:
      return ok(id, fmt::format("a datagram sent to {} came back", probe.address.group));
    case Outcome::kNotTried:
      return unknown(id, "not tried: there is no route",
                     "a message must reach every process on this computer");
    case Outcome::kNoSocket:
      return failure(fmt::format("no socket for it: {}", reason), "without sockets no process starts", {},
                     "look for a limit on open files (ulimit -n) or a sandbox around this program");
    case Outcome::kJoinRefused:
      if (probe.delivery.error == ENOBUFS) {
        return failure(fmt::format("the kernel refuses to join {}: too many groups", probe.address.group),
                       "a process that cannot join hears nothing",
                       "sysctl -w net.ipv4.igmp_max_memberships=100",
                       "echo net.ipv4.igmp_max_memberships=100 > /etc/sysctl.d/60-airworthy-groups.conf");
      }
      return failure(fmt::format("the kernel refuses to join {}: {}", probe.address.group, reason),
                     "a process that cannot join hears nothing", kAddRoute, kKeepRoute);
    case Outcome::kSendRefused:
      if (probe.delivery.error == EPERM) {
        return failure(fmt::format("sending to {} is forbidden, by a packet filter", probe.address.group),
                       "no message leaves its process",
                       fmt::format("iptables -I OUTPUT -d {}/32 -j ACCEPT", probe.address.group),
                       "add the rule to the packet filter's own configuration");
      }
      return failure(fmt::format("sending to {} fails: {}", probe.address.group, reason),
                     "no message leaves its process",
                     fmt::format("ip route replace {}/32 dev lo", probe.address.group), kKeepRoute);
    case Outcome::kLost:
      return failure(fmt::format("a datagram sent to {} does not come back: a packet filter drops it",
                                 probe.address.group),
                     "processes start but hear nothing of each other",
                     fmt::format("iptables -I INPUT -d {}/32 -j ACCEPT", probe.address.group),
                     "add the rule to the packet filter's own configuration");
  }
  return unknown(id, "not observed", {});
}

Finding judge_largest_buffer(const ReceiveBufferProbe& probe) {
  const std::string id = "receive_buffer.largest";
  if (!probe.largest_bytes) {
    return unknown(id, "the kernel does not say", "a small buffer loses messages in a burst");
  }
  if (*probe.largest_bytes >= kWantedReceiveBuffer_bytes) {
    return ok(id, fmt::format("a program gets {}", human(*probe.largest_bytes)));
  }
  return {id,
          Level::kWarning,
          fmt::format("a program that asks for {} gets {}", human(kWantedReceiveBuffer_bytes),
                      human(*probe.largest_bytes)),
          "messages that arrive while their reader is busy are lost when the buffer is full",
          fmt::format("sysctl -w net.core.rmem_max={}", kWantedReceiveBuffer_bytes),
          fmt::format("echo net.core.rmem_max={} >> /etc/sysctl.d/60-airworthy.conf",
                      kWantedReceiveBuffer_bytes)};
}

Finding judge_default_buffer(const ReceiveBufferProbe& probe) {
  const std::string id = "receive_buffer.default";
  if (!probe.default_bytes) {
    return unknown(id, "the kernel does not say", "programs that do not ask for a buffer get this one");
  }
  if (*probe.default_bytes >= kFewDefaultBuffer_bytes) {
    return ok(id, fmt::format("{} for a program that does not ask", human(*probe.default_bytes)));
  }
  return {id,
          Level::kWarning,
          fmt::format("{} for a program that does not ask", human(*probe.default_bytes)),
          "lcm-logger takes what it gets and may miss messages in a burst",
          fmt::format("sysctl -w net.core.rmem_default={}", kFewDefaultBuffer_bytes),
          fmt::format("echo net.core.rmem_default={} >> /etc/sysctl.d/60-airworthy.conf",
                      kFewDefaultBuffer_bytes)};
}

Finding judge_utc(const TimeProbe& probe) {
  const std::string id = "time.utc";
  if (!probe.synchronised) {
    return unknown(id, "the kernel does not say whether UTC is synchronised",
                   "reports show UTC; intervals and verdicts do not depend on it");
  }
  if (*probe.synchronised) return ok(id, "UTC is synchronised");
  return {id,
          Level::kWarning,
          "UTC is not synchronised",
          "reports may show a wrong date; intervals and verdicts do not depend on it",
          "timedatectl set-ntp true",
          "needs a time service, such as the package systemd-timesyncd or chrony, and a source it reaches"};
}

Finding judge_boottime(const TimeProbe& probe) {
  const std::string id = "time.boottime";
  const auto& readings = probe.boottime_ns;
  if (readings.size() < 2) {
    return {id,
            Level::kFailure,
            "CLOCK_BOOTTIME cannot be read",
            "it is the vehicle's time: no process can stamp a message",
            {},
            "needs Linux 2.6.39 or newer, outside a sandbox that forbids clock_gettime"};
  }
  const auto back = std::adjacent_find(readings.begin(), readings.end(), std::greater<>{});
  if (back != readings.end()) {
    return {id,
            Level::kFailure,
            fmt::format("CLOCK_BOOTTIME went back by {} ns", *back - *std::next(back)),
            "it is the vehicle's time: a sample from the past is rejected",
            {},
            "choose another clock source: cat "
            "/sys/devices/system/clocksource/clocksource0/available_clocksource"};
  }
  if (readings.front() == readings.back()) {
    return {id,
            Level::kFailure,
            "CLOCK_BOOTTIME stands still",
            "no deadline ever passes",
            {},
            "choose another clock source: cat "
            "/sys/devices/system/clocksource/clocksource0/available_clocksource"};
  }
  return ok(id, fmt::format("CLOCK_BOOTTIME runs and never went back in {} readings", readings.size()));
}

Finding judge_wall_clock(const TimeProbe& probe) {
  const std::string id = "time.wall_clock";
  if (!probe.wall_clock_s) return unknown(id, "the wall clock cannot be read", "reports show a wrong date");
  const auto date = [](std::int64_t time_s) { return fmt::format("{:%Y-%m-%d}", fmt::gmtime(time_s)); };
  if (*probe.wall_clock_s >= probe.build_time_s) return ok(id, "it is " + date(*probe.wall_clock_s));
  return {id,
          Level::kWarning,
          fmt::format("it is {}, before this program was built ({})", date(*probe.wall_clock_s),
                      date(probe.build_time_s)),
          "the date is wrong: flights are filed under it, and certificates and keys look not yet valid",
          "timedatectl set-ntp true",
          "a computer without a battery-backed clock needs a time service and a source it reaches at start"};
}

Finding judge_disk(const ResourceProbe& probe) {
  const std::string id = "disk.log_directory";
  const auto& folder = probe.log_directory;
  if (!probe.disk_free_bytes) {
    return {id,
            Level::kFailure,
            fmt::format("{} is not there", folder),
            "nothing can be recorded",
            fmt::format("mkdir -p '{}'", folder),
            {}};
  }
  if (*probe.disk_free_bytes < kLittleDisk_bytes) {
    return {id,
            *probe.disk_free_bytes < kNoDisk_bytes ? Level::kFailure : Level::kWarning,
            fmt::format("{} free in {}", human(*probe.disk_free_bytes), folder),
            "a full disk ends the recording in flight",
            {},
            "delete or move old recordings, or record elsewhere"};
  }
  if (!probe.log_directory_writable.value_or(false)) {
    return unknown(id,
                   fmt::format("{} free in {}, which the user of this program may not write",
                               human(*probe.disk_free_bytes), folder),
                   "run doctor as the user that records to know whether it can");
  }
  return ok(id, fmt::format("{} free in {}", human(*probe.disk_free_bytes), folder));
}

Finding judge_memory(const ResourceProbe& probe) {
  const std::string id = "memory.available";
  if (!probe.memory_available_bytes) {
    return unknown(id, "/proc/meminfo does not say",
                   "a process killed for want of memory goes missing in flight");
  }
  const auto found = fmt::format("{} available", human(*probe.memory_available_bytes));
  if (*probe.memory_available_bytes >= kLittleMemory_bytes) return ok(id, found);
  return {id,    *probe.memory_available_bytes < kNoMemory_bytes ? Level::kFailure : Level::kWarning,
          found, "a process killed for want of memory goes missing in flight",
          {},    "end other programs: ps -eo rss,comm --sort=-rss | head"};
}

}  // namespace

std::vector<Finding> judge(const Probes& probes) {
  return {judge_loopback(probes.multicast),
          judge_route(probes.multicast),
          judge_delivery(probes.multicast),
          judge_largest_buffer(probes.receive_buffer),
          judge_default_buffer(probes.receive_buffer),
          judge_boottime(probes.time),
          judge_utc(probes.time),
          judge_wall_clock(probes.time),
          judge_disk(probes.resources),
          judge_memory(probes.resources)};
}

}  // namespace airworthy::doctor
