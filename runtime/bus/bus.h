#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "runtime/error.h"

namespace airworthy::rt {

/// Publish-subscribe transport of encoded messages. Three implementations: LcmBus (udpm:// and memq://) and
/// LogBus (a recording). Handlers run on the thread that dispatches; they may publish and subscribe, and must
/// not throw, because LCM calls them from C.
class Bus {
 public:
  using Handler = std::function<void(std::span<const std::uint8_t> payload)>;

  Bus() = default;
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;
  virtual ~Bus() = default;

  /// `channel` is the full name with the vehicle prefix, at most 63 characters.
  [[nodiscard]] virtual Expected<void> publish(const std::string& channel,
                                               std::span<const std::uint8_t> payload) = 0;

  /// Exact name, no pattern. The subscription lives as long as the bus.
  [[nodiscard]] virtual Expected<void> subscribe(const std::string& channel, Handler handler) = 0;
};

}  // namespace airworthy::rt
