#include "gateway/feed/feed_time.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <ctime>

namespace airworthy::gateway {

std::string utc_text(std::int64_t utc_us) {
  constexpr std::int64_t kEndOfYear9999_us = 253'402'300'800'000'000;
  if (utc_us < 0 || utc_us >= kEndOfYear9999_us) return {};
  using std::chrono::duration_cast;
  const std::chrono::microseconds since_epoch{utc_us};
  const auto days = duration_cast<std::chrono::days>(since_epoch);
  const std::chrono::year_month_day date{std::chrono::sys_days{days}};
  const std::int64_t of_day_us = (since_epoch - days).count();
  const std::int64_t second = of_day_us / 1'000'000;
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:06}Z", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()), second / 3600,
                     second / 60 % 60, second % 60, of_day_us % 1'000'000);
}

std::int64_t WallClock::utc_offset_us(TimePoint now) {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  return utc_offset_us(now, static_cast<std::int64_t>(t.tv_sec) * 1'000'000 + t.tv_nsec / 1'000);
}

std::int64_t WallClock::utc_offset_us(TimePoint now, std::int64_t wall_us) {
  const std::int64_t offset_us = wall_us - to_us(now);
  if (!offset_us_ || std::abs(offset_us - *offset_us_) >= kStep_us) offset_us_ = offset_us;
  return *offset_us_;
}

void FeedTime::write(nlohmann::json& object, const std::string& name, TimePoint time) const {
  const std::int64_t time_us = to_us(time);
  object[name + "_us"] = time_us;
  nlohmann::json& utc = object[name + "_utc"];
  std::int64_t utc_us = 0;
  if (!utc_offset_us_ || __builtin_add_overflow(time_us, *utc_offset_us_, &utc_us)) return;
  const std::string text = utc_text(utc_us);
  if (!text.empty()) utc = text;
}

}  // namespace airworthy::gateway
