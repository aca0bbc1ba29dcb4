#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "core/protocol/mavlink/message_table.h"
#include "core/protocol/mavlink/messages.h"
#include "core/protocol/mavlink/parser.h"
#include "tests/core/protocol/mavlink_vectors.h"
#include "tests/support/allocation_guard.h"

namespace airworthy::mavlink {
namespace {

using testing::bytes_of;
using Bytes = std::vector<std::uint8_t>;

Bytes operator+(Bytes left, const Bytes& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

Bytes to_bytes(const EncodedFrame& frame) { return {frame.view().begin(), frame.view().end()}; }

/// A frame with an id that no table has, from the sender of the vectors.
Bytes unknown_frame(std::uint8_t sequence, std::size_t length = 20) {
  Frame frame;
  frame.sequence = sequence;
  frame.system_id = frame.component_id = 1;
  frame.message_id = 54321;
  frame.length = static_cast<std::uint8_t>(length);
  std::fill_n(frame.payload.begin(), length, std::uint8_t{0x55});
  return to_bytes(encode_frame(frame, 77));
}

struct Result {
  std::vector<Bytes> frames;  // each frame that was delivered, encoded again
  ParserCounters counters;
  std::size_t pending = 0;
};

Result parse(const Bytes& bytes, bool flush = true, std::size_t chunk = SIZE_MAX) {
  Parser parser;
  Result result;
  const auto sink = [&](const Frame& frame) {
    const MessageInfo* info = find_message(frame.message_id);
    ASSERT_NE(info, nullptr);
    result.frames.push_back(to_bytes(encode_frame(frame, info->crc_extra)));
  };
  for (std::size_t at = 0; at < bytes.size(); at += std::min(chunk, bytes.size() - at)) {
    parser.push(std::span{bytes}.subspan(at, std::min(chunk, bytes.size() - at)), sink);
  }
  if (flush) parser.flush(sink);
  result.counters = parser.counters();
  result.pending = parser.pending_bytes();
  return result;
}

void expect_equal(const ParserCounters& a, const ParserCounters& b) {
  EXPECT_EQ(a.bytes, b.bytes);
  EXPECT_EQ(a.frames_ok, b.frames_ok);
  EXPECT_EQ(a.frames_unverified, b.frames_unverified);
  EXPECT_EQ(a.frames_incompatible, b.frames_incompatible);
  EXPECT_EQ(a.frames_old_esc_info, b.frames_old_esc_info);
  EXPECT_EQ(a.crc_errors, b.crc_errors);
  EXPECT_EQ(a.bytes_skipped, b.bytes_skipped);
  EXPECT_EQ(a.frames_lost, b.frames_lost);
  EXPECT_EQ(a.frames_reordered, b.frames_reordered);
  EXPECT_EQ(a.senders_forgotten, b.senders_forgotten);
}

/// All vectors of system 1 in the order of their sequence numbers, noise from `noise` before, between and
/// after.
template <class Noise>
Bytes stream_with(Noise&& noise) {
  Bytes stream = noise();
  for (const auto& vector : testing::kAllVectors) stream = stream + bytes_of(vector) + noise();
  return stream;
}

TEST(MavlinkParser, DeliversEveryVectorOnce) {
  const auto result = parse(stream_with([] { return Bytes{}; }), false);
  ASSERT_EQ(result.frames.size(), testing::kAllVectors.size());
  for (std::size_t i = 0; i < result.frames.size(); ++i) {
    EXPECT_EQ(result.frames[i], bytes_of(testing::kAllVectors[i]));
  }
  EXPECT_EQ(result.counters.frames_ok, 17U);
  EXPECT_EQ(result.counters.crc_errors, 0U);
  EXPECT_EQ(result.counters.bytes_skipped, 0U);
  EXPECT_EQ(result.pending, 0U);
}

TEST(MavlinkParser, PayloadIsZeroFilledAfterALongerFrame) {
  Parser parser;
  std::vector<Frame> frames;
  const auto keep = [&](const Frame& frame) { frames.push_back(frame); };
  parser.push(bytes_of(testing::kEscInfo), keep);
  parser.push(bytes_of(testing::kServoOutputRaw), keep);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[1].length, 12);
  EXPECT_TRUE(std::all_of(frames[1].payload.begin() + 12, frames[1].payload.end(),
                          [](std::uint8_t byte) { return byte == 0; }));
}

TEST(MavlinkParser, FindsEveryFrameAmongNoise) {
  std::mt19937 random{20261122};
  std::uniform_int_distribution<int> any_byte{0, 255};
  for (int round = 0; round < 300; ++round) {
    const auto noise = [&] {
      Bytes bytes(static_cast<std::size_t>(any_byte(random)) % 40);
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(any_byte(random));
      return bytes;
    };
    EXPECT_EQ(parse(stream_with(noise)).frames.size(), testing::kAllVectors.size()) << "round " << round;
  }
}

// The hardest noise: start bytes and headers that claim messages nobody can check.
TEST(MavlinkParser, FindsEveryFrameAmongFalseHeaders) {
  std::mt19937 random{4};
  for (int round = 0; round < 300; ++round) {
    const auto noise = [&] {
      Bytes bytes;
      for (auto count = random() % 4; count > 0; --count) {
        bytes = bytes + Bytes{random() % 2 == 0 ? kStartByteV1 : kStartByteV2,
                              static_cast<std::uint8_t>(random() % 120),
                              static_cast<std::uint8_t>(random() % 4),
                              0,
                              0,
                              1,
                              1,
                              0x31,
                              0xD4};
        bytes.resize(bytes.size() - random() % 9);
      }
      return bytes;
    };
    EXPECT_EQ(parse(stream_with(noise)).frames.size(), testing::kAllVectors.size()) << "round " << round;
  }
}

TEST(MavlinkParser, AFalseStartByteBeforeEachFrameLosesNone) {
  for (const std::uint8_t start : {kStartByteV1, kStartByteV2}) {
    const auto result = parse(stream_with([start] { return Bytes{start}; }));
    EXPECT_EQ(result.frames.size(), testing::kAllVectors.size());
    EXPECT_EQ(result.counters.bytes_skipped, testing::kAllVectors.size() + 1);
  }
}

TEST(MavlinkParser, RealFramesInsideADamagedOneAreFound) {
  // A length field hit by an error announces 255 bytes; the frames it seems to swallow follow.
  Bytes damaged = bytes_of(testing::kAttitude);
  damaged[1] = 0xFF;
  const auto result = parse(damaged + bytes_of(testing::kHeartbeat) + bytes_of(testing::kVfrHud));
  ASSERT_EQ(result.frames.size(), 2U);
  EXPECT_EQ(result.frames[0], bytes_of(testing::kHeartbeat));
  EXPECT_EQ(result.frames[1], bytes_of(testing::kVfrHud));
}

TEST(MavlinkParser, ResultDoesNotDependOnChunks) {
  std::mt19937 random{7};
  std::uniform_int_distribution<int> any_byte{0, 255};
  const auto noise = [&] {
    Bytes bytes(static_cast<std::size_t>(any_byte(random)) % 9);
    for (auto& byte : bytes) byte = (any_byte(random) & 3) == 0 ? kStartByteV2 : std::uint8_t{1};
    return bytes;
  };
  for (int round = 0; round < 20; ++round) {
    Bytes stream = stream_with(noise) + unknown_frame(40) + stream_with(noise) + unknown_frame(41);
    for (int hit = 0; hit < round; ++hit) {
      stream[static_cast<std::size_t>(any_byte(random) * 256 + any_byte(random)) % stream.size()] ^=
          static_cast<std::uint8_t>(1 << (any_byte(random) % 8));
    }
    const auto whole = parse(stream);
    for (const std::size_t chunk :
         {std::size_t{1}, std::size_t{2}, std::size_t{7}, std::size_t{64}, std::size_t{281}}) {
      const auto cut = parse(stream, true, chunk);
      EXPECT_EQ(cut.frames, whole.frames) << "chunk " << chunk;
      expect_equal(cut.counters, whole.counters);
    }
  }
}

TEST(MavlinkParser, EveryByteIsAccountedFor) {
  std::mt19937 random{99};
  Bytes stream(200'000);
  for (auto& byte : stream) {
    const auto value = random();
    byte = (value & 0x700U) == 0 ? kStartByteV2 : static_cast<std::uint8_t>(value & 0x3FU);
  }
  Parser parser;
  std::uint64_t frame_bytes = 0;
  const auto sink = [&](const Frame& frame) {
    frame_bytes += (frame.version == 2 ? 12U : 8U) + frame.length + (frame.signature ? 13U : 0U);
  };
  parser.push(stream, sink);
  const auto& counters = parser.counters();
  if (counters.frames_unverified + counters.frames_incompatible + counters.frames_old_esc_info == 0) {
    EXPECT_EQ(counters.bytes, counters.bytes_skipped + frame_bytes + parser.pending_bytes());
  }
  parser.flush(sink);
  EXPECT_EQ(parser.pending_bytes(), 0U);
}

TEST(MavlinkParser, NoSingleBitErrorIsAcceptedWithOtherContent) {
  for (const auto& vector : testing::kAllVectors) {
    const Bytes good = bytes_of(vector);
    const std::size_t checked_bits = 8 * (good.size() - (vector.name == "HeartbeatSigned" ? 13 : 0));
    for (std::size_t bit = 0; bit < checked_bits; ++bit) {
      Bytes bad = good;
      bad[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
      // The frames around it make its sender known and complete any longer length the error may announce.
      Bytes tail;
      for (int i = 0; i < 16; ++i) tail = tail + bytes_of(testing::kHeartbeat);
      const auto result = parse(bytes_of(testing::kHeartbeat) + bad + tail);
      std::size_t intact = 0;
      for (const Bytes& frame : result.frames) {
        if (frame == bytes_of(testing::kHeartbeat)) ++intact;
      }
      EXPECT_EQ(intact, result.frames.size()) << vector.name << " bit " << bit;
      EXPECT_EQ(intact, 17U) << vector.name << " bit " << bit;
    }
  }
}

TEST(MavlinkParser, SkipsAnUnknownMessageByLength) {
  const auto result =
      parse(bytes_of(testing::kHeartbeat) + unknown_frame(1) + bytes_of(testing::kStatustext));
  EXPECT_EQ(result.frames.size(), 2U);
  EXPECT_EQ(result.counters.frames_unverified, 1U);
  EXPECT_EQ(result.counters.crc_errors, 0U);
  EXPECT_EQ(result.counters.bytes_skipped, 0U);
}

TEST(MavlinkParser, AnUnknownMessageThatHoldsARealFrameIsAFalseStart) {
  const Bytes inside = bytes_of(testing::kAttitude);
  Bytes unknown = unknown_frame(1, 60);
  std::copy(inside.begin(), inside.end(), unknown.begin() + 20);
  EXPECT_EQ(parse(unknown + bytes_of(testing::kHeartbeat)).frames.size(), 2U);
  // The same when the real frame ends behind the false one, also while its end is still to come.
  // Its 16th byte, behind the end of the false one, looks like a start.
  const Bytes cut = unknown_frame(1, 60);
  const auto overlapping = to_bytes(encode(Attitude{.roll = std::bit_cast<float>(0x3E00FD00U)}, {1, 1}, 0));
  ASSERT_EQ(overlapping[15], kStartByteV2);
  const Bytes stream = Bytes(cut.begin(), cut.end() - 15) + overlapping + bytes_of(testing::kHeartbeat);
  for (const std::size_t chunk : {SIZE_MAX, std::size_t{1}}) {
    const auto result = parse(stream, true, chunk);
    EXPECT_EQ(result.frames.size(), 2U);
    EXPECT_EQ(result.counters.frames_unverified, 0U);
  }
}

TEST(MavlinkParser, AnUnknownMessageNotFollowedByAFrameIsNotTrusted) {
  // Its length is wrong, so what follows is the middle of a real frame.
  Bytes unknown = unknown_frame(1);
  unknown[1] = 60;
  const auto result = parse(bytes_of(testing::kHeartbeat) + unknown + bytes_of(testing::kEscInfo) +
                            bytes_of(testing::kAttitude));
  EXPECT_EQ(result.frames.size(), 3U);
  EXPECT_EQ(result.counters.frames_unverified, 0U);
}

TEST(MavlinkParser, AnUnknownMessageAtTheEndWaitsForTheNextByte) {
  const Bytes stream = bytes_of(testing::kHeartbeat) + unknown_frame(1);
  EXPECT_EQ(parse(stream, false).pending, unknown_frame(1).size());
  EXPECT_EQ(parse(stream, true).counters.frames_unverified, 1U);
}

TEST(MavlinkParser, DropsFramesWithUnknownIncompatibilityFlags) {
  Frame frame = make_frame(Heartbeat{}, {1, 1}, 1);
  frame.incompat_flags = 0x02;
  const auto known = to_bytes(encode_frame(frame, crc_extra_of<Heartbeat>()));
  frame.sequence = 2;
  const auto other_checksum = to_bytes(encode_frame(frame, 0x5A));
  const auto result =
      parse(bytes_of(testing::kHeartbeat) + known + other_checksum + bytes_of(testing::kStatustext));
  EXPECT_EQ(result.frames.size(), 2U);
  EXPECT_EQ(result.counters.frames_incompatible, 2U);
  EXPECT_EQ(result.counters.crc_errors, 0U);
}

TEST(MavlinkParser, TellsAnOldDialectFromDamage) {
  Frame frame;
  frame.system_id = frame.component_id = 1;
  frame.message_id = 290;
  frame.length = 42;
  frame.payload[41] = 7;
  const auto old_frame = to_bytes(encode_frame(frame, 221));
  const auto result = parse(old_frame + bytes_of(testing::kHeartbeat));
  EXPECT_EQ(result.counters.frames_old_esc_info, 1U);
  EXPECT_EQ(result.counters.crc_errors, 0U);
  EXPECT_EQ(result.frames.size(), 1U);
}

TEST(MavlinkParser, AcceptsPayloadsLongerThanItsDefinition) {
  Frame frame = make_frame(Heartbeat{.custom_mode = 5}, {1, 1}, 0);
  frame.length = 12;
  frame.payload[11] = 1;
  Parser parser;
  int frames = 0;
  parser.push(to_bytes(encode_frame(frame, crc_extra_of<Heartbeat>())), [&](const Frame& received) {
    ++frames;
    EXPECT_EQ(decode<Heartbeat>(received).custom_mode, 5U);
  });
  EXPECT_EQ(frames, 1);
}

TEST(MavlinkParser, LongestFrame) {
  Frame frame = make_frame(Heartbeat{}, {1, 1}, 0);
  frame.length = 255;
  frame.payload.fill(kStartByteV2);
  frame.signature = Signature{3, 0xFFFFFFFFFFFF, {1, 2, 3, 4, 5, 6}};
  const auto bytes = to_bytes(encode_frame(frame, crc_extra_of<Heartbeat>()));
  ASSERT_EQ(bytes.size(), kMaxFrame);
  for (const std::size_t chunk : {std::size_t{1}, std::size_t{100}, std::size_t{1000}}) {
    const auto result = parse(bytes + bytes + bytes + bytes + bytes, false, chunk);
    EXPECT_EQ(result.frames, std::vector<Bytes>(5, bytes));
    EXPECT_EQ(result.counters.frames_reordered, 4U);
  }
}

class SequenceTest : public ::testing::Test {
 protected:
  void send(std::uint8_t sequence, std::uint8_t component = 1) {
    parser_.push(to_bytes(encode(Heartbeat{}, {1, component}, sequence)), [](const Frame&) {});
  }
  Parser parser_;
};

TEST_F(SequenceTest, CountsGapsPerSender) {
  send(250);
  send(100, 2);
  send(253);
  send(101, 2);
  send(1);
  EXPECT_EQ(parser_.counters().frames_lost, 2U + 3U);
  EXPECT_EQ(parser_.counters().frames_reordered, 0U);
}

TEST_F(SequenceTest, AnOlderFrameIsNotAGap) {
  send(5);
  send(7);
  send(6);
  send(8);
  EXPECT_EQ(parser_.counters().frames_lost, 1U);
  EXPECT_EQ(parser_.counters().frames_reordered, 1U);
}

TEST_F(SequenceTest, FollowsASenderThatRestarts) {
  send(100);
  for (std::uint8_t i = 0; i < 10; ++i) send(i);
  EXPECT_EQ(parser_.counters().frames_reordered, 2U);
  EXPECT_EQ(parser_.counters().frames_lost, 0U);
}

TEST_F(SequenceTest, MoreSendersThanItsTableHoldsForgetTheOldest) {
  for (int i = 0; i < 40; ++i) send(0, static_cast<std::uint8_t>(i));
  EXPECT_EQ(parser_.counters().senders_forgotten, 8U);
  send(5, 39);
  EXPECT_EQ(parser_.counters().frames_lost, 4U);
  send(5, 0);
  EXPECT_EQ(parser_.counters().frames_lost, 4U) << "forgotten, so its first frame again";
}

TEST(MavlinkParser, ResetForgetsAHalfFrame) {
  Parser parser;
  const auto sink = [](const Frame&) {};
  const Bytes bytes = bytes_of(testing::kAttitude);
  parser.push(std::span{bytes}.first(20), sink);
  parser.reset();
  EXPECT_EQ(parser.pending_bytes(), 0U);
  EXPECT_EQ(parser.counters().bytes_skipped, 20U);
  parser.push(bytes, sink);
  EXPECT_EQ(parser.counters().frames_ok, 1U);
}

TEST(MavlinkParser, NeverTouchesTheHeap) {
  const Bytes stream = stream_with([] {
                         return Bytes{kStartByteV2, 1, 2, 3};
                       }) +
                       unknown_frame(1) + bytes_of(testing::kHeartbeat);
  Parser parser;
  double sum = 0.0;
  std::size_t bytes = 0;
  const test::AllocationGuard guard;
  const auto sink = [&](const Frame& frame) {
    if (frame.message_id == Attitude::kId) sum += static_cast<double>(decode<Attitude>(frame).roll);
    bytes += encode_frame(frame, find_message(frame.message_id)->crc_extra).size;
  };
  parser.push(stream, sink);
  parser.flush(sink);
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_GT(bytes, 0U);
  EXPECT_NEAR(sum, 0.1, 1e-6);
}

// The inputs of the fuzzer, without the fuzzer.
TEST(MavlinkParser, FuzzCorpusIsParsedAlikeInAnyChunks) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator{AIRWORTHY_FUZZ_CORPUS "/mavlink_parser"}) {
    std::ifstream file{entry.path(), std::ios::binary};
    const Bytes bytes{std::istreambuf_iterator<char>{file}, {}};
    const auto whole = parse(bytes);
    EXPECT_EQ(parse(bytes, true, 1).frames, whole.frames) << entry.path();
    EXPECT_GE(whole.frames.size(), 1U) << entry.path();
    ++files;
  }
  EXPECT_GE(files, 18);
}

}  // namespace
}  // namespace airworthy::mavlink
