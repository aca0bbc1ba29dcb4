#include "gateway/feed/feed_time.h"

#include <gtest/gtest.h>

#include <limits>

namespace airworthy::gateway {
namespace {

// Expected values: date -u -d @SECONDS.
TEST(UtcText, KnownInstants) {
  EXPECT_EQ(utc_text(0), "1970-01-01T00:00:00.000000Z");
  EXPECT_EQ(utc_text(951'782'400'000'000), "2000-02-29T00:00:00.000000Z");
  EXPECT_EQ(utc_text(1'700'000'000'123'456), "2023-11-14T22:13:20.123456Z");
  EXPECT_EQ(utc_text(253'402'300'799'999'999), "9999-12-31T23:59:59.999999Z");
}

TEST(UtcText, NoTextForTimesNobodyMeans) {
  EXPECT_EQ(utc_text(-1), "");
  EXPECT_EQ(utc_text(253'402'300'800'000'000), "");
  EXPECT_EQ(utc_text(std::numeric_limits<std::int64_t>::max()), "");
}

TEST(FeedTime, WritesVehicleTimeAndUtcWhereKnown) {
  nlohmann::json object;
  FeedTime{1'700'000'000'000'000}.write(object, "since", from_us(123'456));
  EXPECT_EQ(object.at("since_us"), 123'456);
  EXPECT_EQ(object.at("since_utc"), "2023-11-14T22:13:20.123456Z");
  FeedTime{std::nullopt}.write(object, "since", from_us(5));
  EXPECT_EQ(object.at("since_us"), 5);
}

TEST(FeedTime, UnknownUtcIsNull) {
  nlohmann::json object;
  FeedTime{std::nullopt}.write(object, "since", from_us(5));
  EXPECT_TRUE(object.at("since_utc").is_null());
  FeedTime{std::numeric_limits<std::int64_t>::max()}.write(object, "far", from_us(5));
  EXPECT_TRUE(object.at("far_utc").is_null());
}

TEST(WallClock, TheSameInstantReadsTheSameUntilTheClocksReallyPart) {
  WallClock clock;
  EXPECT_EQ(clock.utc_offset_us(from_us(1'000'000), 501'000'000), 500'000'000);
  EXPECT_EQ(clock.utc_offset_us(from_us(2'000'000), 502'000'007), 500'000'000)
      << "microseconds of reading time";
  EXPECT_EQ(clock.utc_offset_us(from_us(3'000'000), 903'000'000), 900'000'000) << "somebody set the clock";
}

}  // namespace
}  // namespace airworthy::gateway
