#include "core/estimators/unbalance/speed_track.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace airworthy {
namespace {

using Track = SpeedTrack<double>;

TEST(SpeedTrack, KnowsNothingAtFirst) {
  Track track;
  EXPECT_TRUE(track.is_empty());
  EXPECT_FALSE(track.at(from_us(0)).has_value());
}

TEST(SpeedTrack, DrawsStraightLinesAndHoldsTheEnds) {
  Track track;
  ASSERT_TRUE(track.add(from_us(1'000'000), 100.0));
  ASSERT_TRUE(track.add(from_us(1'020'000), 110.0));
  ASSERT_TRUE(track.add(from_us(1'120'000), 60.0));
  const auto expect = [&track](std::int64_t us, double speed_rad_s, double spacing_s) {
    const auto value = track.at(from_us(us));
    ASSERT_TRUE(value.has_value());
    EXPECT_NEAR(value->speed_rad_s, speed_rad_s, 1e-12) << us;
    EXPECT_NEAR(value->spacing_s, spacing_s, 1e-12) << us;
  };
  expect(1'000'000, 100.0, 0.020);
  expect(1'005'000, 102.5, 0.020);
  expect(1'020'000, 110.0, 0.100);
  expect(1'070'000, 85.0, 0.100);
  expect(1'120'000, 60.0, 0.100);
  expect(1'150'000, 60.0, 0.100);
  expect(1'320'000, 60.0, 0.200);  // beyond the newest: its age
  expect(990'000, 100.0, 0.010);   // before the oldest
}

TEST(SpeedTrack, OneReportHasNoSpacingButItsAge) {
  Track track;
  ASSERT_TRUE(track.add(from_us(1'000'000), 100.0));
  EXPECT_EQ(track.at(from_us(1'000'000))->spacing_s, 0.0);
  EXPECT_NEAR(track.at(from_us(1'040'000))->spacing_s, 0.04, 1e-12);
}

TEST(SpeedTrack, RefusesWhatIsNotNewer) {
  Track track;
  ASSERT_TRUE(track.add(from_us(1000), 1.0));
  EXPECT_FALSE(track.add(from_us(1000), 2.0));
  EXPECT_FALSE(track.add(from_us(999), 2.0));
  EXPECT_EQ(track.newest_time(), from_us(1000));
  EXPECT_EQ(track.at(from_us(1000))->speed_rad_s, 1.0);
  track.reset();
  EXPECT_TRUE(track.is_empty());
  EXPECT_TRUE(track.add(from_us(5), 3.0));
  EXPECT_EQ(track.at(from_us(7))->speed_rad_s, 3.0);
}

// Beside a search through all reports, far beyond what the track can hold.
TEST(SpeedTrack, RemembersTheNewestReportsAndNoOther) {
  std::mt19937 random{5};
  std::uniform_int_distribution<std::int64_t> step_us{1, 20'000};
  std::uniform_real_distribution<double> speed{100.0, 900.0};
  Track track;
  std::vector<std::pair<std::int64_t, double>> all;
  std::int64_t now_us = 0;
  for (int i = 0; i < 500; ++i) {
    now_us += step_us(random);
    all.emplace_back(now_us, speed(random));
    ASSERT_TRUE(track.add(from_us(now_us), all.back().second));
    const std::size_t first = all.size() > Track::kReports ? all.size() - Track::kReports : 0;
    for (int k = 0; k < 10; ++k) {
      const std::int64_t us = std::uniform_int_distribution<std::int64_t>{all[first].first, now_us}(random);
      double expected = all[first].second;
      for (std::size_t n = first; n + 1 < all.size(); ++n) {
        const auto& [t0, w0] = all[n];
        const auto& [t1, w1] = all[n + 1];
        if (t0 <= us && us <= t1) {
          expected = w0 + (w1 - w0) * static_cast<double>(us - t0) / static_cast<double>(t1 - t0);
        }
      }
      ASSERT_NEAR(track.at(from_us(us))->speed_rad_s, expected, 1e-9);
    }
  }
}

}  // namespace
}  // namespace airworthy
