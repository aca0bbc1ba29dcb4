#include "core/protocol/mavlink/frame.h"

#include <algorithm>

#include "core/protocol/mavlink/crc.h"

namespace airworthy::mavlink {

EncodedFrame encode_frame(const Frame& frame, std::uint8_t crc_extra) noexcept {
  EncodedFrame out;
  const auto put = [&out](std::uint8_t byte) { out.bytes[out.size++] = byte; };
  const auto put_low_bytes = [&put](std::uint64_t value, unsigned count) {
    for (unsigned i = 0; i < count; ++i) put(static_cast<std::uint8_t>(value >> (8U * i)));
  };

  if (frame.version == 1) {
    put(kStartByteV1);
    put(frame.length);
  } else {
    const auto incompat = static_cast<std::uint8_t>((frame.incompat_flags & ~unsigned{kIncompatSigned}) |
                                                    (frame.signature ? kIncompatSigned : 0U));
    put(kStartByteV2);
    put(frame.length);
    put(incompat);
    put(frame.compat_flags);
  }
  put(frame.sequence);
  put(frame.system_id);
  put(frame.component_id);
  put_low_bytes(frame.message_id, frame.version == 1 ? 1 : 3);
  for (std::size_t i = 0; i < frame.length; ++i) put(frame.payload[i]);

  Crc16 crc;
  crc.add(std::span{out.bytes}.subspan(1, out.size - 1));
  crc.add(crc_extra);
  put_low_bytes(crc.value(), kChecksumSize);

  if (frame.version != 1 && frame.signature) {
    put(frame.signature->link_id);
    put_low_bytes(frame.signature->timestamp, 6);
    for (const std::uint8_t byte : frame.signature->digest) put(byte);
  }
  return out;
}

}  // namespace airworthy::mavlink
