#include "core/estimators/device_clock.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace airworthy {
namespace {

constexpr double kMinGain = 0.1;
constexpr double kShortestGrowth = 1.05;
constexpr double kDelayGain = 0.02;

/// Beyond this (292 000 years of µs halved) differences could overflow; no clock reads it.
constexpr std::uint64_t kMaxStamp64 = std::uint64_t{1} << 61U;

constexpr std::int64_t unit_us(DeviceCounter counter) noexcept {
  return counter == DeviceCounter::kMilliseconds32 ? 1000 : 1;
}

constexpr double resolution_us(DeviceCounter counter) noexcept {
  return static_cast<double>(unit_us(counter));
}

constexpr std::uint64_t max_stamp(DeviceCounter counter) noexcept {
  return counter == DeviceCounter::kMicroseconds64 ? kMaxStamp64 : std::numeric_limits<std::uint32_t>::max();
}

constexpr bool is_32_bit(DeviceCounter counter) noexcept { return counter != DeviceCounter::kMicroseconds64; }

}  // namespace

RoundTripOffset::Status RoundTripOffset::add(TimePoint sent, TimePoint received,
                                             std::int64_t device_us) noexcept {
  const Duration round_trip = received - sent;
  const auto round_trip_us = static_cast<double>(round_trip.count());
  if (round_trip < Duration{0} || round_trip > params_.max_round_trip) return Status::kLongRoundTrip;
  if (used_ > 0 && round_trip_us > 2.0 * shortest_us_ + 1000.0) {
    shortest_us_ = (shortest_us_ + 1.0) * kShortestGrowth;
    return Status::kLongRoundTrip;
  }
  const std::int64_t sample_us = to_us(sent) + round_trip.count() / 2 - device_us;  // (1)
  Status status = Status::kUsed;
  if (used_ > 0) {
    const std::int64_t change_us = sample_us - offset_us_;
    const std::int64_t limit_us = params_.jump_threshold.count() + round_trip.count() / 2;
    if (change_us > limit_us || change_us < -limit_us) {
      if (++jumps_ < params_.jumps_to_restart) return Status::kJump;
      used_ = 0;
      status = Status::kRestarted;
    }
  }
  jumps_ = 0;
  shortest_us_ = used_ == 0 ? round_trip_us : std::min(round_trip_us, shortest_us_ * kShortestGrowth);
  ++used_;
  const double gain = std::max(1.0 / used_, kMinGain);
  if (used_ == 1) {
    offset_us_ = sample_us;
  } else {
    offset_us_ +=
        static_cast<std::int64_t>(std::lround(gain * static_cast<double>(sample_us - offset_us_)));  // (2)
  }
  last_round_trip_us_ = round_trip_us;
  last_good_ = received;
  return status;
}

std::optional<std::int64_t> RoundTripOffset::offset_us(TimePoint now) const noexcept {
  if (used_ == 0 || now - last_good_ > params_.stale_after) return std::nullopt;
  return offset_us_;
}

double RoundTripOffset::uncertainty_us(TimePoint now) const noexcept {
  if (!offset_us(now)) return std::numeric_limits<double>::quiet_NaN();
  return 0.5 * last_round_trip_us_ +
         params_.max_drift_ratio * static_cast<double>((now - last_good_).count());
}

DeviceClock::Reading DeviceClock::read(std::uint64_t stamp, TimePoint arrival,
                                       std::optional<std::int64_t> round_trip_offset_us) noexcept {
  Reading reading;
  reading.epoch = epoch_;
  if (stamp > max_stamp(counter_)) return reading;
  if (!started_) {
    started_ = true;
    newest_us_ = static_cast<std::int64_t>(stamp) * unit_us(counter_);
    newest_arrival_ = arrival;
    restart_envelope(to_us(arrival) - newest_us_, arrival);
  }

  const std::int64_t device_us = unwrap(stamp, arrival);
  const std::int64_t sample_us = to_us(arrival) - device_us;
  const std::int64_t step_us = device_us - newest_us_;
  if (step_us < -params_.max_backward.count() || sample_us < offset_us_ - params_.early_tolerance.count()) {
    reading = judge_jump(stamp, device_us, arrival);
    if (reading.status == Status::kRejected) return reading;
  } else {
    suspects_ = 0;
    reading.device_us = device_us;
    reading.status = step_us < 0 ? Status::kOlder : Status::kOk;
    if (step_us >= 0) {
      newest_us_ = device_us;
      newest_arrival_ = arrival;
      follow_envelope(sample_us, arrival);
    }
  }

  uses_round_trip_ = false;
  used_offset_us_ = offset_us_;
  if (round_trip_offset_us) {
    const std::int64_t path_us = offset_us_ - *round_trip_offset_us;
    if (path_us >= -params_.round_trip_slack.count() && path_us <= params_.max_path_delay.count()) {
      uses_round_trip_ = true;
      used_offset_us_ = *round_trip_offset_us;
    }
  }
  reading.time = std::min(from_us(reading.device_us + used_offset_us_), arrival);
  return reading;
}

/// The value congruent to the stamp that is nearest to what the arrivals predict.
std::int64_t DeviceClock::unwrap(std::uint64_t stamp, TimePoint arrival) const noexcept {
  if (!is_32_bit(counter_)) return static_cast<std::int64_t>(stamp);
  const std::int64_t expected = (newest_us_ + (arrival - newest_arrival_).count()) / unit_us(counter_);
  const auto distance =
      static_cast<std::int32_t>(static_cast<std::uint32_t>(stamp) - static_cast<std::uint32_t>(expected));
  return (expected + distance) * unit_us(counter_);
}

/// A stamp that does not fit. It is believed when it is the last of several in a row that agree.
DeviceClock::Reading DeviceClock::judge_jump(std::uint64_t stamp, std::int64_t device_us,
                                             TimePoint arrival) noexcept {
  const std::int64_t since_suspect_us =
      (static_cast<std::int64_t>(stamp) - static_cast<std::int64_t>(suspect_stamp_)) * unit_us(counter_);
  const std::int64_t disagreement_us = since_suspect_us - (arrival - suspect_arrival_).count();
  const bool agrees = suspects_ > 0 && since_suspect_us >= 0 &&
                      disagreement_us <= params_.agreement.count() &&
                      disagreement_us >= -params_.agreement.count();
  suspects_ = agrees ? suspects_ + 1 : 1;
  suspect_stamp_ = stamp;
  suspect_arrival_ = arrival;
  Reading reading;
  reading.epoch = epoch_;
  if (suspects_ < params_.confirmations) return reading;

  suspects_ = 0;
  const bool is_restart = device_us < newest_us_;
  if (is_restart) ++epoch_;
  reading.status = is_restart ? Status::kRestarted : Status::kOk;
  reading.epoch = epoch_;
  // After a restart the counter itself is the time: the device has not wrapped yet.
  newest_us_ = is_restart ? static_cast<std::int64_t>(stamp) * unit_us(counter_) : device_us;
  newest_arrival_ = arrival;
  reading.device_us = newest_us_;
  restart_envelope(to_us(arrival) - newest_us_, arrival);
  return reading;
}

void DeviceClock::restart_envelope(std::int64_t sample_us, TimePoint arrival) noexcept {
  offset_us_ = window_min_us_ = previous_min_us_ = sample_us;
  window_start_ = touched_ = arrival;
  mean_delay_us_ = 0.0;
}

void DeviceClock::follow_envelope(std::int64_t sample_us, TimePoint arrival) noexcept {
  window_min_us_ = std::min(window_min_us_, sample_us);
  if (arrival - window_start_ >= params_.window) {
    if (window_min_us_ - offset_us_ > params_.step_threshold.count()) offset_us_ = window_min_us_;
    previous_min_us_ = window_min_us_;
    window_min_us_ = sample_us;
    // The allowance for drift is spent once a window, which keeps its rounding away from single samples.
    const auto rise_us = static_cast<std::int64_t>(
        std::lround(params_.max_drift_ratio * static_cast<double>((arrival - window_start_).count())));
    window_start_ = arrival;
    const std::int64_t target_us = std::min(previous_min_us_, window_min_us_);  // (2)
    if (target_us > offset_us_) {
      offset_us_ = std::min(target_us, offset_us_ + rise_us);  // (3)
      touched_ = arrival;
    }
  }
  if (sample_us <= offset_us_) {
    offset_us_ = sample_us;  // (3)
    touched_ = arrival;
  }
  mean_delay_us_ += kDelayGain * (static_cast<double>(sample_us - offset_us_) - mean_delay_us_);
}

std::optional<std::int64_t> DeviceClock::offset_us() const noexcept {
  if (!started_) return std::nullopt;
  return used_offset_us_;
}

double DeviceClock::uncertainty_us(TimePoint now) const noexcept {
  if (!started_) return std::numeric_limits<double>::quiet_NaN();
  return resolution_us(counter_) + mean_delay_us_ +
         params_.max_drift_ratio * static_cast<double>((now - touched_).count());
}

std::optional<TimePoint> DeviceStream::next(const DeviceClock::Reading& reading, TimePoint arrival) noexcept {
  if (reading.status == DeviceClock::Status::kRejected) return std::nullopt;
  TimePoint time = reading.time;
  if (started_ && reading.epoch == epoch_) {
    const std::int64_t step_us = reading.device_us - last_device_us_;
    if (step_us <= 0) return std::nullopt;
    time = std::max(time, last_ + Duration{step_us / 2});
  } else if (started_) {
    time = std::max(time, last_ + Duration{1});
  }
  time = std::min(time, arrival);
  started_ = true;
  epoch_ = reading.epoch;
  last_device_us_ = reading.device_us;
  last_ = std::max(last_, time);
  return last_;
}

}  // namespace airworthy
