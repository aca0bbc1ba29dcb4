#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "core/estimators/device_clock.h"
#include "runtime/process/counters.h"

namespace airworthy::drivers {

/// The flight controller's time stamps, of whatever width, as vehicle time. Stamps of one width share one
/// clock, so that messages keep their distance to each other; 64-bit stamps are told apart by magnitude into
/// time since boot and time since 1970.
class DeviceTime {
 public:
  explicit DeviceTime(rt::Counters& counters) : counters_{counters} {}

  /// Vehicle time of one message of a stream: the arrival if the device gave no time (0), nothing if its
  /// stamp is implausible or no newer than the stream's last one. `stream` tells message kind and sensor
  /// apart.
  [[nodiscard]] std::optional<TimePoint> of_ms(std::uint32_t stamp_ms, std::uint32_t stream,
                                               TimePoint arrival);
  [[nodiscard]] std::optional<TimePoint> of_us(std::uint32_t stamp_us, std::uint32_t stream,
                                               TimePoint arrival);
  [[nodiscard]] std::optional<TimePoint> of_us(std::uint64_t stamp_us, std::uint32_t stream,
                                               TimePoint arrival);

  /// A TIMESYNC round trip.
  void add_round_trip(TimePoint sent, TimePoint received, std::int64_t device_us);

  struct Summary {
    std::string source;           ///< timesync, arrival, none
    std::int64_t offset_us = 0;   ///< vehicle time minus device time since boot
    double uncertainty_us = 0.0;  ///< NaN while unknown
  };
  [[nodiscard]] Summary summary(TimePoint now) const;

 private:
  [[nodiscard]] std::optional<TimePoint> read(DeviceClock& clock, std::uint64_t stamp, bool is_since_boot,
                                              std::uint32_t stream, TimePoint arrival);

  rt::Counters& counters_;
  DeviceClock boot_ms_{DeviceCounter::kMilliseconds32};
  DeviceClock boot_us32_{DeviceCounter::kMicroseconds32};
  DeviceClock boot_us64_{DeviceCounter::kMicroseconds64};
  DeviceClock epoch_us64_{DeviceCounter::kMicroseconds64};
  RoundTripOffset round_trip_;
  std::map<std::uint32_t, DeviceStream> streams_;
};

}  // namespace airworthy::drivers
