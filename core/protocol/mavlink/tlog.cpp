#include "core/protocol/mavlink/tlog.h"

#include "core/protocol/mavlink/frame.h"
#include "core/protocol/mavlink/parser.h"

namespace airworthy::mavlink {
namespace {

constexpr std::size_t kTimeSize = 8;
constexpr std::int64_t kDay_us = 86'400'000'000;
constexpr std::int64_t kYear2200_us = 7'258'118'400'000'000;

}  // namespace

TlogStatus TlogReader::next(TlogRecord& record) noexcept {
  record.offset = offset_;
  record.packet = {};
  if (offset_ == data_.size()) return TlogStatus::kEnd;
  if (data_.size() - offset_ <= kTimeSize) return TlogStatus::kTruncated;
  if (!is_plausible_at(offset_)) {
    for (++offset_; offset_ < data_.size(); ++offset_) {
      if (!is_plausible_at(offset_)) continue;
      if (starts_with_verified_frame(data_.subspan(offset_ + kTimeSize))) break;
      const std::size_t next = offset_ + kTimeSize + packet_size_at(offset_);
      if (next == data_.size() || is_plausible_at(next)) break;
    }
    return TlogStatus::kCorrupt;
  }
  const std::size_t size = packet_size_at(offset_);
  if (data_.size() - offset_ - kTimeSize < size) return TlogStatus::kTruncated;
  record.time_us = time_at(offset_);
  record.packet = data_.subspan(offset_ + kTimeSize, size);
  last_time_us_ = record.time_us;
  has_time_ = true;
  offset_ += kTimeSize + size;
  return TlogStatus::kRecord;
}

/// Size of the packet of the record at `offset` as its header tells, 0 if none starts there.
std::size_t TlogReader::packet_size_at(std::size_t offset) const noexcept {
  if (offset > data_.size() || data_.size() - offset <= kTimeSize) return 0;
  const auto packet = data_.subspan(offset + kTimeSize);
  if (packet[0] != kStartByteV1 && packet[0] != kStartByteV2) return 0;
  const bool is_v2 = packet[0] == kStartByteV2;
  const std::size_t header_size = is_v2 ? kHeaderSizeV2 : kHeaderSizeV1;
  // A header cut off by the end of the file: any size that reaches beyond it will do.
  if (packet.size() < header_size) return kMaxFrame;
  const bool is_signed = is_v2 && (packet[2] & kIncompatSigned) != 0;
  return header_size + packet[1] + kChecksumSize + (is_signed ? kSignatureSize : 0);
}

bool TlogReader::is_plausible_at(std::size_t offset) const noexcept {
  if (packet_size_at(offset) == 0) return false;
  const std::int64_t time = time_at(offset);
  if (time < 0 || time > kYear2200_us) return false;
  if (!has_time_) return true;
  return time > last_time_us_ - kDay_us && time < last_time_us_ + kDay_us;
}

std::int64_t TlogReader::time_at(std::size_t offset) const noexcept {
  std::uint64_t time = 0;
  for (std::size_t i = 0; i < kTimeSize; ++i) time = (time << 8U) | data_[offset + i];
  return static_cast<std::int64_t>(time);
}

}  // namespace airworthy::mavlink
