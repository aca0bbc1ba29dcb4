#include "core/estimators/device_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace airworthy {
namespace {

using Status = DeviceClock::Status;

constexpr std::int64_t kOffset_us = 5'000'000'000;  // vehicle minus device
constexpr std::uint64_t kPeriod32 = std::uint64_t{1} << 32U;

/// A device whose stamps reach us after a delay; never delivered out of order.
struct Link {
  DeviceClock clock;
  DeviceStream stream{};
  std::int64_t last_arrival_us = 0;

  DeviceClock::Reading last{};
  std::optional<TimePoint> time{};

  void send(std::uint64_t stamp, std::int64_t true_us, std::int64_t delay_us,
            std::optional<std::int64_t> round_trip = std::nullopt) {
    last_arrival_us = std::max(last_arrival_us, true_us + delay_us);
    last = clock.read(stamp, from_us(last_arrival_us), round_trip);
    time = stream.next(last, from_us(last_arrival_us));
  }
};

TEST(DeviceClock, TimesAreLateByTheSmallestDelayOnly) {
  Link link{DeviceClock{DeviceCounter::kMicroseconds64}};
  std::mt19937 random{1};
  std::exponential_distribution<double> delay_us{1.0 / 3000.0};
  double worst_us = 0.0;
  for (std::int64_t device = 1'000'000; device < 61'000'000; device += 10'000) {
    link.send(static_cast<std::uint64_t>(device), device + kOffset_us,
              500 + static_cast<std::int64_t>(delay_us(random)));
    ASSERT_TRUE(link.time);
    if (device > 3'000'000)
      worst_us = std::max(worst_us, std::abs(static_cast<double>(to_us(*link.time) - device - kOffset_us)));
  }
  // The smallest of 1000 exponential delays of 3 ms mean is 3 µs; a window's first samples may see 100 µs.
  EXPECT_LT(worst_us, 500.0 + 150.0);
  EXPECT_LT(link.clock.uncertainty_us(from_us(link.last_arrival_us)), 6000.0);
}

TEST(DeviceClock, FollowsADriftingDeviceForAnHour) {
  for (const double drift : {-150e-6, 150e-6}) {
    Link link{DeviceClock{DeviceCounter::kMicroseconds64}};
    double worst_us = 0.0;
    for (std::int64_t true_us = 0; true_us < 3'600'000'000; true_us += 100'000) {
      const double device = 1e9 + static_cast<double>(true_us) * (1.0 + drift);
      link.send(static_cast<std::uint64_t>(device), true_us, 1000);
      ASSERT_EQ(link.last.status, Status::kOk);
      worst_us = std::max(worst_us, std::abs(static_cast<double>(to_us(*link.time) - true_us)));
    }
    // 1 ms of delay, and what the device drifts in up to two windows.
    EXPECT_LT(worst_us, 1000.0 + 150e-6 * 20e6 + 10.0);
  }
}

TEST(DeviceClock, ALateBurstMovesNothing) {
  Link link{DeviceClock{DeviceCounter::kMicroseconds64}};
  for (std::int64_t t = 0; t < 20'000'000; t += 10'000) {
    // From 5 s to 9 s the link stalls, then delivers all at once.
    const bool is_stalled = t >= 5'000'000 && t < 9'000'000;
    link.send(static_cast<std::uint64_t>(t + 1), t + kOffset_us, is_stalled ? 9'000'000 - t : 1000);
    ASSERT_TRUE(link.time) << t;
    EXPECT_NEAR(static_cast<double>(to_us(*link.time)), static_cast<double>(t + kOffset_us + 1000), 3.0) << t;
  }
}

TEST(DeviceClock, ABurstAtTheStartIsForgottenWithinAWindow) {
  Link link{DeviceClock{DeviceCounter::kMicroseconds64}};
  std::int64_t last_us = 0;
  for (std::int64_t t = 0; t < 5'000'000; t += 10'000) {
    link.send(static_cast<std::uint64_t>(t), t + kOffset_us, t < 500'000 ? 500'000 - t : 1000);
    if (!link.time) continue;
    EXPECT_GE(to_us(*link.time), last_us);
    last_us = to_us(*link.time);
  }
  EXPECT_NEAR(static_cast<double>(last_us), 4'990'000.0 + kOffset_us + 1000, 2.0);
}

TEST(DeviceClock, ALongerPathIsBelievedAfterAWindow) {
  Link link{DeviceClock{DeviceCounter::kMicroseconds64}};
  for (std::int64_t t = 0; t < 60'000'000; t += 20'000) {
    link.send(static_cast<std::uint64_t>(t), t + kOffset_us, t < 20'000'000 ? 1000 : 301'000);
  }
  EXPECT_NEAR(static_cast<double>(*link.clock.offset_us()), kOffset_us + 301'000, 5000.0);
}

class WrapTest : public ::testing::TestWithParam<DeviceCounter> {};

TEST_P(WrapTest, A32BitCounterRunsThroughItsEnd) {
  const std::int64_t unit_us = GetParam() == DeviceCounter::kMilliseconds32 ? 1000 : 1;
  Link link{DeviceClock{GetParam()}};
  const std::int64_t wrap_us = static_cast<std::int64_t>(kPeriod32) * unit_us;
  std::int64_t last_us = 0;
  for (std::int64_t device = wrap_us - 2'000'000; device < wrap_us + 2'000'000; device += 10'000) {
    link.send(static_cast<std::uint64_t>(device / unit_us) % kPeriod32, device + kOffset_us, 1000);
    ASSERT_EQ(link.last.status, Status::kOk) << device;
    EXPECT_EQ(link.last.epoch, 0);
    EXPECT_EQ(to_us(*link.time), device / unit_us * unit_us + to_us(*link.time) - link.last.device_us);
    if (last_us != 0) {
      EXPECT_EQ(to_us(*link.time) - last_us, 10'000);
    }
    last_us = to_us(*link.time);
  }
}

TEST(DeviceClock, ASilenceOverSeveralWrapsIsNoRestart) {
  Link link{DeviceClock{DeviceCounter::kMicroseconds32}};
  for (const std::int64_t device : {1'000'000LL, 2'000'000LL, 20'000'000'000LL, 20'000'010'000LL}) {
    link.send(static_cast<std::uint64_t>(device) % kPeriod32, device + kOffset_us, 1000);
    EXPECT_EQ(link.last.status, Status::kOk);
    EXPECT_EQ(to_us(*link.time), device + kOffset_us + 1000);
  }
}

TEST_P(WrapTest, AnOlderStampAcrossTheEndIsOlderAndNotFuture) {
  Link link{DeviceClock{GetParam()}};
  link.send(kPeriod32 - 20, 1'000'000, 0);
  link.send(5, 1'000'000 + 25 * (GetParam() == DeviceCounter::kMilliseconds32 ? 1000 : 1), 0);
  EXPECT_EQ(link.last.status, Status::kOk);
  link.send(kPeriod32 - 10, 1'026'000, 0);
  EXPECT_EQ(link.last.status, Status::kOlder);
  EXPECT_FALSE(link.time) << "the stream does not go back";
}

INSTANTIATE_TEST_SUITE_P(Counters, WrapTest,
                         ::testing::Values(DeviceCounter::kMilliseconds32, DeviceCounter::kMicroseconds32));

class RestartTest : public ::testing::TestWithParam<DeviceCounter> {
 protected:
  RestartTest() {
    for (int i = 0; i < 500; ++i) step(600'000'000 + 10'000 * i);
  }
  /// Sends the stamp of a device time, 10 ms of true time after the last.
  void step(std::int64_t device_us) {
    now_us_ += 10'000;
    const std::int64_t unit_us = GetParam() == DeviceCounter::kMilliseconds32 ? 1000 : 1;
    link_.send(static_cast<std::uint64_t>(device_us / unit_us), now_us_, 1000);
    if (link_.time) {
      EXPECT_GE(to_us(*link_.time), last_us_);
      EXPECT_LE(to_us(*link_.time), now_us_ + 1000);
      last_us_ = to_us(*link_.time);
    }
  }
  Link link_{DeviceClock{GetParam()}};
  std::int64_t now_us_ = kOffset_us;
  std::int64_t last_us_ = 0;
};

TEST_P(RestartTest, ARebootIsConfirmedByThreeStamps) {
  step(2'000'000);
  EXPECT_EQ(link_.last.status, Status::kRejected);
  step(2'010'000);
  EXPECT_EQ(link_.last.status, Status::kRejected);
  step(2'020'000);
  EXPECT_EQ(link_.last.status, Status::kRestarted);
  EXPECT_EQ(link_.last.epoch, 1);
  ASSERT_TRUE(link_.time);
  for (int i = 3; i < 300; ++i) {
    step(2'000'000 + 10'000 * i);
    ASSERT_EQ(link_.last.status, Status::kOk);
    EXPECT_EQ(to_us(*link_.time), now_us_ + 1000);
  }
}

TEST_P(RestartTest, ASingleGarbageStampIsRejectedAndLeavesNoTrace) {
  for (const std::int64_t garbage_us : {1LL, 3'000'000'000LL, 609'000'000LL}) {
    const auto offset = link_.clock.offset_us();
    step(garbage_us);
    EXPECT_EQ(link_.last.status, Status::kRejected) << garbage_us;
    EXPECT_FALSE(link_.time);
    step(600'000'000 + (now_us_ - kOffset_us));
    EXPECT_EQ(link_.last.status, Status::kOk) << garbage_us;
    EXPECT_LE(std::abs(*link_.clock.offset_us() - *offset), 10'000);
  }
}

TEST_P(RestartTest, AlternatingGarbageIsNeverBelieved) {
  for (int i = 0; i < 30; ++i) {
    step(100'000'000LL * (i * 7 % 6));
    EXPECT_EQ(link_.last.status, Status::kRejected) << i;
  }
}

TEST_P(RestartTest, ASampleThatArrivesOutOfOrderIsLeftOut) {
  step(605'000'000);
  step(604'990'000);
  EXPECT_EQ(link_.last.status, Status::kOlder);
  EXPECT_FALSE(link_.time);
  step(605'020'000);
  EXPECT_TRUE(link_.time);
}

TEST_P(RestartTest, ARepeatedStampIsNoNewSample) {
  step(605'000'000);
  EXPECT_TRUE(link_.time);
  step(605'000'000);
  EXPECT_FALSE(link_.time);
}

INSTANTIATE_TEST_SUITE_P(Counters, RestartTest,
                         ::testing::Values(DeviceCounter::kMilliseconds32, DeviceCounter::kMicroseconds32,
                                           DeviceCounter::kMicroseconds64));

TEST(DeviceClock, StampsBeyondAnyClockAreRejected) {
  DeviceClock clock{DeviceCounter::kMicroseconds64};
  EXPECT_EQ(clock.read(UINT64_MAX, from_us(1)).status, Status::kRejected);
  EXPECT_FALSE(clock.offset_us());
  EXPECT_TRUE(std::isnan(clock.uncertainty_us(from_us(1))));
  EXPECT_EQ(clock.read(1'700'000'000'000'000, from_us(2)).status, Status::kOk) << "µs since 1970";
}

TEST(DeviceClock, AnAgreeingRoundTripOffsetRemovesTheConstantDelay) {
  Link link{DeviceClock{DeviceCounter::kMicroseconds64}};
  for (std::int64_t t = 0; t < 1'000'000; t += 10'000)
    link.send(static_cast<std::uint64_t>(t), t + kOffset_us, 4000, kOffset_us);
  EXPECT_TRUE(link.clock.uses_round_trip());
  EXPECT_EQ(to_us(*link.time), 990'000 + kOffset_us);
  // A device that stamps with another clock than it answers with.
  link.send(1'000'000, 1'000'000 + kOffset_us, 4000, kOffset_us - 50'000'000);
  EXPECT_FALSE(link.clock.uses_round_trip());
  EXPECT_EQ(to_us(*link.time), 1'000'000 + kOffset_us + 4000);
}

TEST(DeviceClock, WhenTheOffsetFallsTimeGoesOnAtHalfItsPace) {
  Link link{DeviceClock{DeviceCounter::kMicroseconds64}};
  link.send(1'000'000, 1'000'000 + kOffset_us, 50'000);
  const std::int64_t before_us = to_us(*link.time);
  for (std::int64_t i = 1; i <= 20; ++i) {
    link.send(static_cast<std::uint64_t>(1'000'000 + 10'000 * i), 1'000'000 + 10'000 * i + kOffset_us, 50'000,
              kOffset_us);
    const std::int64_t caught_up_us = 1'000'000 + 10'000 * i + kOffset_us;
    EXPECT_EQ(to_us(*link.time), std::max(before_us + 5'000 * i, caught_up_us)) << i;
  }
}

// Property: whatever the stamps, times never go back and never lie after the arrival.
TEST(DeviceClock, TimesAreMonotoneAndNeverFuture) {
  std::mt19937_64 random{20261122};
  for (const auto counter :
       {DeviceCounter::kMilliseconds32, DeviceCounter::kMicroseconds32, DeviceCounter::kMicroseconds64}) {
    Link link{DeviceClock{counter}};
    std::int64_t true_us = 10'000'000;
    std::int64_t device_us = 3'000'000;
    TimePoint last{};
    for (int i = 0; i < 50'000; ++i) {
      const auto step = static_cast<std::int64_t>(random() % 20'000);
      true_us += step;
      device_us += step;
      if (random() % 500 == 0) device_us = static_cast<std::int64_t>(random() % 10'000'000'000);
      const std::uint64_t stamp =
          counter == DeviceCounter::kMilliseconds32 ? static_cast<std::uint64_t>(device_us / 1000) % kPeriod32
          : counter == DeviceCounter::kMicroseconds32 ? static_cast<std::uint64_t>(device_us) % kPeriod32
                                                      : static_cast<std::uint64_t>(device_us);
      link.send(random() % 50 == 0 ? random() : stamp, true_us, static_cast<std::int64_t>(random() % 50'000));
      if (!link.time) continue;
      ASSERT_GE(*link.time, last);
      ASSERT_LE(to_us(*link.time), link.last_arrival_us);
      last = *link.time;
    }
  }
}

TEST(RoundTripOffset, ConvergesToTheOffsetWithinHalfTheRoundTrip) {
  RoundTripOffset estimator;
  EXPECT_FALSE(estimator.offset_us(from_us(0)));
  EXPECT_TRUE(std::isnan(estimator.uncertainty_us(from_us(0))));
  std::mt19937 random{3};
  std::int64_t now_us = 1'000'000;
  for (int i = 0; i < 100; ++i, now_us += 100'000) {
    const auto there = static_cast<std::int64_t>(500 + random() % 1000);
    const auto back = static_cast<std::int64_t>(500 + random() % 1000);
    estimator.add(from_us(now_us), from_us(now_us + there + back), now_us + there - kOffset_us);
  }
  ASSERT_TRUE(estimator.offset_us(from_us(now_us)));
  EXPECT_NEAR(static_cast<double>(*estimator.offset_us(from_us(now_us)) - kOffset_us), 0.0, 300.0);
  EXPECT_LT(estimator.uncertainty_us(from_us(now_us)), 1600.0);
  EXPECT_FALSE(estimator.offset_us(from_us(now_us + 11'000'000))) << "stale";
}

class RoundTripTest : public ::testing::Test {
 protected:
  RoundTripTest() {
    for (int i = 0; i < 20; ++i) EXPECT_EQ(reply(2000, 0), RoundTripOffset::Status::kUsed);
  }
  RoundTripOffset::Status reply(std::int64_t round_trip_us, std::int64_t jump_us) {
    now_us_ += 100'000;
    return estimator_.add(from_us(now_us_ - round_trip_us), from_us(now_us_),
                          now_us_ - round_trip_us / 2 - kOffset_us - jump_us);
  }
  std::int64_t offset_us() { return *estimator_.offset_us(from_us(now_us_)); }
  RoundTripOffset estimator_;
  std::int64_t now_us_ = 1'000'000;
};

TEST_F(RoundTripTest, RejectsLongAndNegativeRoundTrips) {
  EXPECT_EQ(reply(20'000, 0), RoundTripOffset::Status::kLongRoundTrip);
  EXPECT_EQ(reply(900'000, 0), RoundTripOffset::Status::kLongRoundTrip);
  EXPECT_EQ(reply(-5, 0), RoundTripOffset::Status::kLongRoundTrip);
  EXPECT_EQ(offset_us(), kOffset_us);
}

TEST_F(RoundTripTest, AcceptsALinkThatBecameSlower) {
  int tries = 0;
  while (reply(20'000, 0) != RoundTripOffset::Status::kUsed && tries < 100) ++tries;
  EXPECT_LT(tries, 60);
}

TEST_F(RoundTripTest, FiveJumpsInARowAreARestart) {
  for (int i = 0; i < 4; ++i) EXPECT_EQ(reply(2000, 70'000'000), RoundTripOffset::Status::kJump);
  EXPECT_EQ(offset_us(), kOffset_us);
  EXPECT_EQ(reply(2000, 70'000'000), RoundTripOffset::Status::kRestarted);
  EXPECT_EQ(offset_us(), kOffset_us + 70'000'000);
}

TEST_F(RoundTripTest, SingleJumpsAreForgotten) {
  for (int i = 0; i < 20; ++i)
    EXPECT_EQ(reply(2000, i % 2 == 0 ? 50'000 : 0),
              i % 2 == 0 ? RoundTripOffset::Status::kJump : RoundTripOffset::Status::kUsed);
  EXPECT_EQ(offset_us(), kOffset_us);
}

}  // namespace
}  // namespace airworthy
