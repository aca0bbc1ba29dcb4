#include "core/protocol/mavlink/parser.h"

#include <algorithm>
#include <cstring>

#include "core/protocol/mavlink/crc.h"
#include "core/protocol/mavlink/message_table.h"

namespace airworthy::mavlink {
namespace {

// ESC_INFO before its temperature grew from 8 to 16 bits.
constexpr std::uint32_t kEscInfoId = 290;
constexpr std::uint8_t kOldEscInfoCrcExtra = 221;
constexpr std::size_t kOldEscInfoLength = 42;

constexpr bool is_start_byte(std::uint8_t byte) noexcept {
  return byte == kStartByteV1 || byte == kStartByteV2;
}

std::uint32_t message_id_v2(std::span<const std::uint8_t> bytes) noexcept {
  return bytes[7] | static_cast<std::uint32_t>(bytes[8]) << 8U | static_cast<std::uint32_t>(bytes[9]) << 16U;
}

bool checksum_matches(const Crc16& body, std::uint8_t crc_extra, std::uint16_t received) noexcept {
  Crc16 crc = body;
  crc.add(crc_extra);
  return crc.value() == received;
}

enum class Verdict {
  kNone,          // no start byte
  kIncomplete,    // more bytes are needed
  kFailed,        // the checksum is wrong
  kVerified,      // the checksum is right
  kOldEscInfo,    // right for ESC_INFO as it once was
  kIncompatible,  // right, but an unknown incompatibility flag is set
  kUncheckable,   // unknown message
  kUncheckableIncompatible,
};

struct Candidate {
  Verdict verdict = Verdict::kNone;
  std::size_t header_size = 0;
  std::size_t size = 0;  // of the whole frame
};

/// Judges the frame that may start with the first byte.
Candidate examine(std::span<const std::uint8_t> bytes) noexcept {
  Candidate candidate;
  if (bytes.empty() || !is_start_byte(bytes[0])) return candidate;
  candidate.verdict = Verdict::kIncomplete;
  const bool is_v2 = bytes[0] == kStartByteV2;
  candidate.header_size = is_v2 ? kHeaderSizeV2 : kHeaderSizeV1;
  if (bytes.size() < candidate.header_size) return candidate;
  const std::size_t checksum_at = candidate.header_size + bytes[1];
  const unsigned incompat_flags = is_v2 ? bytes[2] : 0U;
  const bool is_signed = (incompat_flags & kIncompatSigned) != 0;
  const bool is_incompatible = (incompat_flags & ~unsigned{kIncompatSigned}) != 0;
  candidate.size = checksum_at + kChecksumSize + (is_signed ? kSignatureSize : 0);
  if (bytes.size() < candidate.size) return candidate;

  const std::uint32_t id = is_v2 ? message_id_v2(bytes) : bytes[5];
  const MessageInfo* info = find_message(id);
  if (info == nullptr) {
    candidate.verdict = is_incompatible ? Verdict::kUncheckableIncompatible : Verdict::kUncheckable;
    return candidate;
  }
  Crc16 crc;
  crc.add(bytes.subspan(1, checksum_at - 1));
  const auto received = read_number<std::uint16_t>(bytes.data() + checksum_at);
  if (checksum_matches(crc, info->crc_extra, received)) {
    candidate.verdict = is_incompatible ? Verdict::kIncompatible : Verdict::kVerified;
  } else if (is_incompatible) {
    // The unknown flag may have changed the checksum too.
    candidate.verdict = Verdict::kUncheckableIncompatible;
  } else if (id == kEscInfoId && bytes[1] <= kOldEscInfoLength &&
             checksum_matches(crc, kOldEscInfoCrcExtra, received)) {
    candidate.verdict = Verdict::kOldEscInfo;
  } else {
    candidate.verdict = Verdict::kFailed;
  }
  return candidate;
}

void read_header(std::span<const std::uint8_t> bytes, Frame& frame) noexcept {
  const bool is_v2 = bytes[0] == kStartByteV2;
  frame.version = is_v2 ? 2 : 1;
  frame.length = bytes[1];
  frame.incompat_flags = is_v2 ? bytes[2] : 0;
  frame.compat_flags = is_v2 ? bytes[3] : 0;
  const auto address = bytes.subspan(is_v2 ? 4 : 2);
  frame.sequence = address[0];
  frame.system_id = address[1];
  frame.component_id = address[2];
  frame.message_id = is_v2 ? message_id_v2(bytes) : bytes[5];
}

Signature read_signature(std::span<const std::uint8_t> bytes) noexcept {
  Signature signature;
  signature.link_id = bytes[0];
  for (unsigned i = 0; i < 6; ++i) {
    signature.timestamp |= static_cast<std::uint64_t>(bytes[1 + i]) << (8U * i);
    signature.digest[i] = bytes[7 + i];
  }
  return signature;
}

}  // namespace

bool starts_with_verified_frame(std::span<const std::uint8_t> bytes) noexcept {
  return examine(bytes).verdict == Verdict::kVerified;
}

std::size_t Parser::append(std::span<const std::uint8_t> bytes) noexcept {
  if (begin_ != 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  const std::size_t count = std::min(bytes.size(), buffer_.size() - end_);
  std::memcpy(buffer_.data() + end_, bytes.data(), count);
  end_ += count;
  counters_.bytes += count;
  return count;
}

Parser::Step Parser::advance(bool is_final) noexcept {
  const std::size_t searched_from = begin_;
  while (begin_ < end_ && !is_start_byte(buffer_[begin_])) ++begin_;
  counters_.bytes_skipped += begin_ - searched_from;

  const auto bytes = std::span{buffer_}.subspan(begin_, end_ - begin_);
  const Candidate candidate = examine(bytes);
  switch (candidate.verdict) {
    case Verdict::kNone:
      return Step::kNeedMore;
    case Verdict::kIncomplete:
      return is_final ? reject_start() : Step::kNeedMore;
    case Verdict::kFailed:
      ++counters_.crc_errors;
      return reject_start();
    case Verdict::kVerified:
      break;
    case Verdict::kOldEscInfo:
      return skip_frame(counters_.frames_old_esc_info, candidate.size);
    case Verdict::kIncompatible:
      return skip_frame(counters_.frames_incompatible, candidate.size);
    case Verdict::kUncheckable:
    case Verdict::kUncheckableIncompatible:
      return weigh_uncheckable(candidate.verdict == Verdict::kUncheckable ? counters_.frames_unverified
                                                                          : counters_.frames_incompatible,
                               candidate.size, is_final);
  }

  read_header(bytes, frame_);
  std::memcpy(frame_.payload.data(), bytes.data() + candidate.header_size, frame_.length);
  std::memset(frame_.payload.data() + frame_.length, 0, frame_.payload.size() - frame_.length);
  frame_.signature.reset();
  if ((frame_.incompat_flags & kIncompatSigned) != 0) {
    frame_.signature = read_signature(bytes.subspan(candidate.size - kSignatureSize));
  }
  ++counters_.frames_ok;
  follow_sequence(frame_);
  begin_ += candidate.size;
  return Step::kFrame;
}

Parser::Step Parser::reject_start() noexcept {
  ++begin_;
  ++counters_.bytes_skipped;
  return Step::kAgain;
}

Parser::Step Parser::skip_frame(std::uint64_t& count, std::size_t size) noexcept {
  ++count;
  Frame header;
  read_header(std::span{buffer_}.subspan(begin_, size), header);
  if (find_sender(header) != nullptr) follow_sequence(header);
  begin_ += size;
  return Step::kAgain;
}

/// Decides between a frame that cannot be checked and a false start that real frames follow.
Parser::Step Parser::weigh_uncheckable(std::uint64_t& count, std::size_t size, bool is_final) noexcept {
  const auto bytes = std::span{buffer_}.subspan(begin_, end_ - begin_);
  if (bytes.size() == size) {
    if (!is_final) return Step::kNeedMore;
  } else if (!is_start_byte(bytes[size])) {
    return reject_start();
  }
  for (std::size_t at = 1; at < size; ++at) {
    const Verdict inside = examine(bytes.subspan(at)).verdict;
    if (inside == Verdict::kVerified || inside == Verdict::kIncompatible) return reject_start();
    if (inside == Verdict::kIncomplete && !is_final) return Step::kNeedMore;
  }
  return skip_frame(count, size);
}

Parser::SenderSequence* Parser::find_sender(const Frame& frame) noexcept {
  const auto end = senders_.begin() + static_cast<std::ptrdiff_t>(sender_count_);
  const auto found = std::find_if(senders_.begin(), end, [&frame](const SenderSequence& sender) {
    return sender.system_id == frame.system_id && sender.component_id == frame.component_id;
  });
  return found == end ? nullptr : &*found;
}

void Parser::follow_sequence(const Frame& frame) noexcept {
  SenderSequence* found = find_sender(frame);
  if (found == nullptr) {
    if (sender_count_ == senders_.size()) {
      ++counters_.senders_forgotten;
    } else {
      ++sender_count_;
    }
    found = &senders_[sender_count_ - 1];
    *found = {frame.system_id, frame.component_id, frame.sequence, false};
  } else {
    // More than half the number range ahead is rather an older frame, or one received twice. Two such frames
    // in a row mean that the sender restarted its count.
    const auto step = static_cast<std::uint8_t>(frame.sequence - found->last);
    const bool is_behind = step == 0 || step > 128;
    if (is_behind) {
      ++counters_.frames_reordered;
    } else {
      counters_.frames_lost += step - 1U;
    }
    if (!is_behind || found->was_behind) found->last = frame.sequence;
    found->was_behind = is_behind;
  }
  std::rotate(senders_.data(), found, found + 1);
}

void Parser::reset() noexcept {
  counters_.bytes_skipped += end_ - begin_;
  begin_ = end_ = 0;
  sender_count_ = 0;
}

}  // namespace airworthy::mavlink
