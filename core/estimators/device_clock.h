#pragma once

#include <cstdint>
#include <optional>

#include "core/time/time.h"

namespace airworthy {

/// A device's time stamp as it arrives.
enum class DeviceCounter {
  kMilliseconds32,  ///< wraps after 49.7 days
  kMicroseconds32,  ///< wraps after 71.6 minutes
  kMicroseconds64,
};

/// Offset between a device's clock and vehicle time from request-reply round trips.
///   Model       a request leaves at a, the device reads its clock d, the reply arrives at b:
///               vehicle − device = (a + b)/2 − d + e,  |e| <= (b − a)/2                                 (1)
///   Update      offset <- offset + g·(sample − offset),  g = max(1/n, g_min)                            (2)
///   Rejects     round trips much longer than the shortest lately; samples that leave the estimate, unless
///               several in a row do: then the device restarted or stepped its clock, and the estimate starts
///               anew
class RoundTripOffset {
 public:
  struct Params {
    Duration max_round_trip{500'000};  ///< longer ones say nothing
    Duration jump_threshold{10'000};   ///< beyond the round trip's own uncertainty
    int jumps_to_restart = 5;
    Duration stale_after{10'000'000};  ///< no offset after this long without a good reply
    double max_drift_ratio = 200e-6;   ///< of the device's clock against ours
  };
  enum class Status { kUsed, kRestarted, kLongRoundTrip, kJump };

  explicit RoundTripOffset(const Params& params) noexcept : params_{params} {}
  RoundTripOffset() noexcept : RoundTripOffset{Params{}} {}

  /// A reply: when the request left, when the reply came, and what the device's clock read.
  Status add(TimePoint sent, TimePoint received, std::int64_t device_us) noexcept;

  /// Vehicle time minus device time; empty before the first reply and when the last good one is stale.
  [[nodiscard]] std::optional<std::int64_t> offset_us(TimePoint now) const noexcept;

  /// Bound on its error: half the round trip plus the drift since; NaN when there is no offset.
  [[nodiscard]] double uncertainty_us(TimePoint now) const noexcept;

 private:
  Params params_;
  std::int64_t offset_us_ = 0;
  double shortest_us_ = 0.0;  // shortest round trip lately; grows slowly so that it follows a slower link
  double last_round_trip_us_ = 0.0;
  TimePoint last_good_{};
  int used_ = 0;
  int jumps_ = 0;
};

/// Maps one device counter to vehicle time: unwraps it, judges each stamp, and follows the offset by the
/// lower envelope of the arrivals.
///   Model       arrival − device = offset + delay,  delay >= smallest delay >= 0                        (1)
///   Envelope    m = smallest (arrival − device) in the last one to two windows                          (2)
///   Offset      falls to m at once; rises to m by at most max_drift_ratio·Δt, or at once when a whole
///               window lies more than step_threshold above it (the path itself has become longer)       (3)
///   Not seen    the constant part of the delay: times are late by the smallest delay. A round-trip offset
///   that
///               agrees with the envelope replaces it and removes that error.
/// A stamp more than max_backward older than the newest, or more than early_tolerance ahead of the envelope,
/// is rejected until `confirmations` stamps in a row agree with each other: then the device restarted, or its
/// clock stepped. So a single bad stamp never moves the estimate, a late burst does no harm, and a wrap is
/// none of these because unwrapping takes the value nearest to what the arrivals predict.
class DeviceClock {
 public:
  struct Params {
    Duration max_backward{1'000'000};
    Duration early_tolerance{1'000'000};
    Duration agreement{2'000'000};  ///< between stamps that confirm each other, device time against arrival
    int confirmations = 3;
    Duration window{10'000'000};
    Duration step_threshold{100'000};
    double max_drift_ratio = 200e-6;
    Duration max_path_delay{1'000'000};  ///< largest smallest delay that a round-trip offset may imply ...
    Duration round_trip_slack{100'000};  ///< ... and how far below zero its own error may put that
  };
  enum class Status {
    kOk,
    kOlder,      ///< older than the newest by at most max_backward: another message overtook it
    kRestarted,  ///< the device's time began anew; `epoch` went up
    kRejected,   ///< implausible and not confirmed: do not use
  };
  struct Reading {
    Status status = Status::kRejected;
    std::int64_t device_us = 0;  ///< unwrapped
    TimePoint time{};            ///< vehicle time; never later than the arrival
    std::int32_t epoch = 0;      ///< number of restarts
  };

  DeviceClock(DeviceCounter counter, const Params& params) noexcept : counter_{counter}, params_{params} {}
  explicit DeviceClock(DeviceCounter counter) noexcept : DeviceClock{counter, Params{}} {}

  /// One stamp. `arrival` must not go backwards from call to call.
  [[nodiscard]] Reading read(std::uint64_t stamp, TimePoint arrival,
                             std::optional<std::int64_t> round_trip_offset_us = std::nullopt) noexcept;

  /// Vehicle time minus device time as last used; empty before the first stamp.
  [[nodiscard]] std::optional<std::int64_t> offset_us() const noexcept;
  /// True if the last reading used the round-trip offset.
  [[nodiscard]] bool uses_round_trip() const noexcept { return uses_round_trip_; }
  /// Scale of the offset's error, without the constant delay: the counter's resolution, the drift since the
  /// envelope was last touched, and the mean delay above the envelope. NaN before the first stamp.
  [[nodiscard]] double uncertainty_us(TimePoint now) const noexcept;

 private:
  [[nodiscard]] std::int64_t unwrap(std::uint64_t stamp, TimePoint arrival) const noexcept;
  [[nodiscard]] Reading judge_jump(std::uint64_t stamp, std::int64_t device_us, TimePoint arrival) noexcept;
  void restart_envelope(std::int64_t sample_us, TimePoint arrival) noexcept;
  void follow_envelope(std::int64_t sample_us, TimePoint arrival) noexcept;

  DeviceCounter counter_;
  Params params_;
  bool started_ = false;
  std::int32_t epoch_ = 0;
  std::int64_t newest_us_ = 0;
  TimePoint newest_arrival_{};

  std::int64_t offset_us_ = 0;
  std::int64_t window_min_us_ = 0;
  std::int64_t previous_min_us_ = 0;
  TimePoint window_start_{};
  TimePoint touched_{};
  double mean_delay_us_ = 0.0;
  std::int64_t used_offset_us_ = 0;
  bool uses_round_trip_ = false;

  int suspects_ = 0;
  std::uint64_t suspect_stamp_ = 0;
  TimePoint suspect_arrival_{};
};

/// Vehicle times of one stream of samples: never backwards. When the offset falls, time goes on at half its
/// pace until the estimate has caught up.
class DeviceStream {
 public:
  /// Time of the sample, empty if the device's stamp was rejected, repeated or older than the stream's last
  /// one.
  [[nodiscard]] std::optional<TimePoint> next(const DeviceClock::Reading& reading,
                                              TimePoint arrival) noexcept;

 private:
  bool started_ = false;
  std::int32_t epoch_ = 0;
  std::int64_t last_device_us_ = 0;
  TimePoint last_{};
};

}  // namespace airworthy
