#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/protocol/mavlink/tlog.h"
#include "tests/core/protocol/mavlink_vectors.h"

namespace airworthy::mavlink {
namespace {

using testing::bytes_of;
using Bytes = std::vector<std::uint8_t>;

constexpr std::int64_t kStart_us = 1'531'927'911'000'000;

void append_record(Bytes& log, std::int64_t time_us, const Bytes& packet) {
  for (int shift = 56; shift >= 0; shift -= 8) {
    log.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(time_us) >> shift));
  }
  log.insert(log.end(), packet.begin(), packet.end());
}

Bytes log_of_all_vectors() {
  Bytes log;
  std::int64_t time_us = kStart_us;
  for (const auto& vector : testing::kAllVectors) append_record(log, time_us += 10'000, bytes_of(vector));
  return log;
}

struct Contents {
  std::vector<Bytes> packets;
  std::vector<std::int64_t> times_us;
  std::vector<std::size_t> corrupt_at;
  TlogStatus end = TlogStatus::kEnd;
  std::size_t end_offset = 0;
};

Contents read(const Bytes& log) {
  TlogReader reader{log};
  TlogRecord record;
  Contents contents;
  for (;;) {
    const TlogStatus status = reader.next(record);
    if (status == TlogStatus::kRecord) {
      contents.packets.emplace_back(record.packet.begin(), record.packet.end());
      contents.times_us.push_back(record.time_us);
    } else if (status == TlogStatus::kCorrupt) {
      contents.corrupt_at.push_back(record.offset);
    } else {
      contents.end = status;
      contents.end_offset = record.offset;
      EXPECT_EQ(reader.next(record), status) << "the end repeats";
      return contents;
    }
  }
}

TEST(MavlinkTlog, ReadsEveryPacketAndTime) {
  const auto contents = read(log_of_all_vectors());
  ASSERT_EQ(contents.packets.size(), testing::kAllVectors.size());
  for (std::size_t i = 0; i < contents.packets.size(); ++i) {
    EXPECT_EQ(contents.packets[i], bytes_of(testing::kAllVectors[i]));
    EXPECT_EQ(contents.times_us[i], kStart_us + 10'000 * static_cast<std::int64_t>(i + 1));
  }
  EXPECT_EQ(contents.end, TlogStatus::kEnd);
  EXPECT_TRUE(contents.corrupt_at.empty());
}

TEST(MavlinkTlog, EmptyLogEnds) { EXPECT_EQ(read({}).end, TlogStatus::kEnd); }

TEST(MavlinkTlog, TellsWhereALogCutAtAnyByteStops) {
  Bytes log;
  append_record(log, kStart_us, bytes_of(testing::kHeartbeat));
  const std::size_t second = log.size();
  append_record(log, kStart_us + 1, bytes_of(testing::kEscInfo));
  for (std::size_t size = second + 1; size < log.size(); ++size) {
    const auto contents = read(Bytes(log.begin(), log.begin() + static_cast<std::ptrdiff_t>(size)));
    EXPECT_EQ(contents.packets.size(), 1U) << size;
    EXPECT_EQ(contents.end, TlogStatus::kTruncated) << size;
    EXPECT_EQ(contents.end_offset, second) << size;
  }
}

TEST(MavlinkTlog, GoesOnBehindDamageAndTellsItsPlace) {
  Bytes log;
  append_record(log, kStart_us, bytes_of(testing::kHeartbeat));
  const std::size_t damaged_at = log.size();
  append_record(log, kStart_us + 1000, bytes_of(testing::kAttitude));
  const std::size_t third = log.size();
  append_record(log, kStart_us + 2000, bytes_of(testing::kVfrHud));
  append_record(log, kStart_us + 3000, bytes_of(testing::kEscInfo));
  std::fill_n(log.begin() + static_cast<std::ptrdiff_t>(damaged_at), 12, std::uint8_t{0xAA});
  const auto contents = read(log);
  EXPECT_EQ(contents.corrupt_at, std::vector<std::size_t>{damaged_at});
  ASSERT_EQ(contents.packets.size(), 3U);
  EXPECT_EQ(contents.packets[1], bytes_of(testing::kVfrHud));
  EXPECT_EQ(contents.end, TlogStatus::kEnd);
  EXPECT_GT(third, damaged_at);
}

TEST(MavlinkTlog, BytesInsertedBetweenRecordsLoseNone) {
  Bytes log = {1, 2, 3, kStart_us & 0xFF, 0xFD, 0xFD};
  std::int64_t time_us = kStart_us;
  for (const auto& vector : testing::kAllVectors) {
    append_record(log, time_us += 10'000, bytes_of(vector));
    log.insert(log.end(), {0x00, 0xFE, 0x09});
  }
  append_record(log, time_us + 1, bytes_of(testing::kHeartbeat));
  const auto contents = read(log);
  EXPECT_EQ(contents.packets.size(), testing::kAllVectors.size() + 1);
  EXPECT_EQ(contents.corrupt_at.size(), testing::kAllVectors.size() + 1);
}

TEST(MavlinkTlog, NoiseEndsWithoutARecord) {
  Bytes noise(5000);
  std::uint32_t state = 1;
  for (auto& byte : noise) byte = static_cast<std::uint8_t>((state = state * 1664525U + 1013904223U) >> 24U);
  const auto contents = read(noise);
  EXPECT_TRUE(contents.packets.empty());
}

}  // namespace
}  // namespace airworthy::mavlink
