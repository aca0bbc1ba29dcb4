#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/doctor/lcm_url.h"
#include "cli/doctor/route_table.h"

namespace airworthy::doctor {

// What was observed, without judgement. An empty optional could not be observed.

struct Delivery {
  enum class Outcome {
    kNotTried,
    kDelivered,
    kNoSocket,
    kJoinRefused,  ///< the kernel does not let the receiver join the group
    kSendRefused,
    kLost,  ///< sent, but nothing arrived
  };
  Outcome outcome = Outcome::kNotTried;
  int error = 0;  ///< errno where something was refused
};

struct MulticastProbe {
  BusAddress address;
  std::optional<bool> loopback_up;
  bool route_table_read = false;
  std::optional<Route> route;
  Delivery delivery;  ///< a datagram sent to the group on a port of our own, received by ourselves
};

struct ReceiveBufferProbe {
  std::optional<std::int64_t>
      largest_bytes;  ///< granted to a program that asks for kWantedReceiveBuffer_bytes
  std::optional<std::int64_t> default_bytes;  ///< of a socket that does not ask
};

struct TimeProbe {
  std::optional<bool> synchronised;          ///< UTC, as the kernel sees it
  std::vector<std::int64_t> boottime_ns;     ///< CLOCK_BOOTTIME read in a row; empty where there is none
  std::optional<std::int64_t> wall_clock_s;  ///< UTC since 1970
  std::int64_t build_time_s = 0;             ///< UTC since 1970 when this program was configured
};

struct ResourceProbe {
  std::string log_directory;
  std::optional<std::int64_t> disk_free_bytes;
  std::optional<bool> log_directory_writable;
  std::optional<std::int64_t> memory_available_bytes;
};

struct Probes {
  MulticastProbe multicast;
  ReceiveBufferProbe receive_buffer;
  TimeProbe time;
  ResourceProbe resources;
};

/// What a process of ours asks for, so that a burst of messages survives a pause of its reader.
inline constexpr std::int64_t kWantedReceiveBuffer_bytes = std::int64_t{4} * 1024 * 1024;

}  // namespace airworthy::doctor
