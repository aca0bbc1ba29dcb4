// Parser and log reader on real flights, against an independent count of the same files.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/protocol/mavlink/parser.h"
#include "core/protocol/mavlink/tlog.h"
#include "tests/support/recorded_data.h"

namespace airworthy::mavlink {
namespace {

/// Standard output of a command, empty if it fails.
std::optional<std::vector<std::uint8_t>> output_of(const std::string& command) {
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return std::nullopt;
  std::vector<std::uint8_t> output;
  std::array<std::uint8_t, 65536> block{};
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), pipe)) {
    output.insert(output.end(), block.begin(), block.begin() + static_cast<std::ptrdiff_t>(count));
  }
  if (pclose(pipe) != 0) return std::nullopt;
  return output;
}

std::string quoted(const std::filesystem::path& path) { return "'" + path.string() + "'"; }

struct Count {
  std::map<std::string, std::uint64_t> messages;
  std::map<std::string, std::uint64_t> senders;
  ParserCounters counters;

  void add(const Frame& frame) {
    ++messages[std::to_string(frame.message_id)];
    ++senders[std::to_string(frame.system_id) + "/" + std::to_string(frame.component_id)];
  }
};

TEST(MavlinkRecorded, CountsOfEveryFlightEqualTheIndependentOnes) {
  const auto folder = testing::recorded_data() / "alfa_mavlink";
  if (!std::filesystem::is_directory(folder)) {
    GTEST_SKIP() << "no recorded flights in " << folder
                 << "; set AIRWORTHY_DATA to the folder that holds them";
  }
  const auto reference = testing::recorded_data() / "mavlink_ref" / "crc_extra.csv";
  int files = 0;
  std::uint64_t packets = 0;
  for (const auto& entry : std::filesystem::directory_iterator{folder}) {
    if (entry.path().extension() != ".xz") continue;
    SCOPED_TRACE(entry.path().filename());
    const auto log = output_of("xz -dc " + quoted(entry.path()));
    const auto oracle = output_of("/usr/bin/python3 " AIRWORTHY_SUPPORT "/mavlink_count.py " +
                                  quoted(entry.path()) + " --reference " + quoted(reference));
    ASSERT_TRUE(log && oracle);
    const auto expected = nlohmann::json::parse(*oracle);
    const auto messages = expected["messages"].get<std::map<std::string, std::uint64_t>>();
    const auto senders = expected["senders"].get<std::map<std::string, std::uint64_t>>();

    // Packet by packet, as the log frames them.
    Count by_record;
    Parser parser;
    const auto add = [&](const Frame& frame) { by_record.add(frame); };
    TlogReader reader{*log};
    TlogRecord record;
    TlogStatus status{};
    while ((status = reader.next(record)) == TlogStatus::kRecord) parser.push(record.packet, add);
    EXPECT_EQ(status, TlogStatus::kEnd) << "at byte " << record.offset;
    EXPECT_EQ(by_record.messages, messages);
    EXPECT_EQ(by_record.senders, senders);
    EXPECT_EQ(parser.counters().crc_errors, expected["bad_checksum"]);
    EXPECT_EQ(parser.counters().bytes_skipped, 0U);

    // The whole file as one byte stream: the 8 time bytes before each packet are noise, and no packet may be
    // lost.
    Count by_stream;
    Parser stream_parser;
    stream_parser.push(*log, [&](const Frame& frame) { by_stream.add(frame); });
    stream_parser.flush([&](const Frame& frame) { by_stream.add(frame); });
    EXPECT_EQ(by_stream.messages, messages);
    EXPECT_EQ(by_stream.senders, senders);

    ++files;
    packets += parser.counters().frames_ok;
  }
  EXPECT_GT(files, 0);
  RecordProperty("files", files);
  RecordProperty("packets", static_cast<int>(packets));
  std::printf("%d flights, %llu packets\n", files, static_cast<unsigned long long>(packets));
}

}  // namespace
}  // namespace airworthy::mavlink
