#include "drivers/mavlink/device_time.h"

#include <limits>

namespace airworthy::drivers {
namespace {

/// 2001-09-09, or 31 years after boot.
constexpr std::uint64_t kFirstEpochStamp_us = 1'000'000'000'000'000;

}  // namespace

std::optional<TimePoint> DeviceTime::of_ms(std::uint32_t stamp_ms, std::uint32_t stream, TimePoint arrival) {
  return read(boot_ms_, stamp_ms, true, stream, arrival);
}

std::optional<TimePoint> DeviceTime::of_us(std::uint32_t stamp_us, std::uint32_t stream, TimePoint arrival) {
  return read(boot_us32_, stamp_us, true, stream, arrival);
}

std::optional<TimePoint> DeviceTime::of_us(std::uint64_t stamp_us, std::uint32_t stream, TimePoint arrival) {
  const bool is_since_boot = stamp_us < kFirstEpochStamp_us;
  return read(is_since_boot ? boot_us64_ : epoch_us64_, stamp_us, is_since_boot, stream, arrival);
}

std::optional<TimePoint> DeviceTime::read(DeviceClock& clock, std::uint64_t stamp, bool is_since_boot,
                                          std::uint32_t stream, TimePoint arrival) {
  if (stamp == 0) {
    counters_.add("time.none_from_device");
    return arrival;
  }
  const auto reading =
      clock.read(stamp, arrival, is_since_boot ? round_trip_.offset_us(arrival) : std::nullopt);
  if (reading.status == DeviceClock::Status::kRejected) {
    counters_.add("refused.time_implausible");
    return std::nullopt;
  }
  if (reading.status == DeviceClock::Status::kRestarted) counters_.add("time.device_restarts");
  const auto time = streams_[stream].next(reading, arrival);
  if (!time) counters_.add("refused.time_not_newer");
  return time;
}

void DeviceTime::add_round_trip(TimePoint sent, TimePoint received, std::int64_t device_us) {
  switch (round_trip_.add(sent, received, device_us)) {
    case RoundTripOffset::Status::kUsed:
      counters_.add("timesync.used");
      break;
    case RoundTripOffset::Status::kRestarted:
      counters_.add("timesync.restarts");
      break;
    case RoundTripOffset::Status::kLongRoundTrip:
      counters_.add("timesync.long_round_trip");
      break;
    case RoundTripOffset::Status::kJump:
      counters_.add("timesync.jumps");
      break;
  }
}

DeviceTime::Summary DeviceTime::summary(TimePoint now) const {
  for (const DeviceClock* clock : {&boot_us64_, &boot_us32_, &boot_ms_}) {
    if (clock->offset_us() && clock->uses_round_trip()) {
      return {"timesync", *clock->offset_us(), round_trip_.uncertainty_us(now)};
    }
  }
  for (const DeviceClock* clock : {&boot_us64_, &boot_us32_, &boot_ms_, &epoch_us64_}) {
    if (clock->offset_us()) return {"arrival", *clock->offset_us(), clock->uncertainty_us(now)};
  }
  if (const auto offset = round_trip_.offset_us(now))
    return {"timesync", *offset, round_trip_.uncertainty_us(now)};
  return {"none", 0, std::numeric_limits<double>::quiet_NaN()};
}

}  // namespace airworthy::drivers
