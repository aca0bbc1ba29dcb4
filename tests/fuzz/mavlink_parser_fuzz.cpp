// Whatever the bytes: no crash, every byte accounted for, the same frames however the bytes are cut, and only
// frames that are in the input.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "core/protocol/mavlink/message_table.h"
#include "core/protocol/mavlink/parser.h"
#include "core/protocol/mavlink/tlog.h"

namespace {

using airworthy::mavlink::Frame;
using airworthy::mavlink::Parser;

void require(bool condition) {
  if (!condition) std::abort();
}

std::vector<std::uint8_t> parse(std::span<const std::uint8_t> input, std::size_t chunk) {
  Parser parser;
  std::vector<std::uint8_t> output;
  const auto sink = [&output](const Frame& frame) {
    const auto* info = airworthy::mavlink::find_message(frame.message_id);
    require(info != nullptr);
    const auto encoded = airworthy::mavlink::encode_frame(frame, info->crc_extra);
    require(airworthy::mavlink::starts_with_verified_frame(encoded.view()));
    output.insert(output.end(), encoded.view().begin(), encoded.view().end());
  };
  for (std::size_t at = 0; at < input.size(); at += chunk) {
    parser.push(input.subspan(at, std::min(chunk, input.size() - at)), sink);
  }
  parser.flush(sink);
  const auto& counters = parser.counters();
  require(parser.pending_bytes() == 0 && counters.bytes == input.size());
  require(output.size() + counters.bytes_skipped <= input.size());
  if (counters.frames_unverified + counters.frames_incompatible + counters.frames_old_esc_info == 0) {
    require(output.size() + counters.bytes_skipped == input.size());
  }
  return output;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span input{data, size};
  const auto whole = parse(input, size == 0 ? 1 : size);
  require(parse(input, 1) == whole);
  require(parse(input, 17) == whole);

  airworthy::mavlink::TlogReader reader{input};
  airworthy::mavlink::TlogRecord record;
  std::size_t last_offset = 0;
  for (;;) {
    const auto status = reader.next(record);
    require(record.offset >= last_offset && record.offset <= size);
    last_offset = record.offset;
    if (status == airworthy::mavlink::TlogStatus::kEnd ||
        status == airworthy::mavlink::TlogStatus::kTruncated)
      return 0;
  }
}
