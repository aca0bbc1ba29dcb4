#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/protocol/mavlink/field.h"

namespace airworthy::mavlink {

inline constexpr std::uint8_t kStartByteV1 = 0xFE;
inline constexpr std::uint8_t kStartByteV2 = 0xFD;
inline constexpr std::size_t kHeaderSizeV1 = 6;
inline constexpr std::size_t kHeaderSizeV2 = 10;
inline constexpr std::size_t kChecksumSize = 2;
inline constexpr std::size_t kSignatureSize = 13;
inline constexpr std::size_t kMaxPayload = 255;
inline constexpr std::size_t kMaxFrame = kHeaderSizeV2 + kMaxPayload + kChecksumSize + kSignatureSize;

/// Incompatibility flags: a receiver that does not know a set bit must drop the frame.
inline constexpr std::uint8_t kIncompatSigned = 0x01;

/// The 13 bytes after a signed frame. Read and written, never verified: this program holds no signing key.
struct Signature {
  std::uint8_t link_id = 0;
  std::uint64_t timestamp = 0;  ///< 48 bits, units of 10 µs since 2015-01-01 UTC
  std::array<std::uint8_t, 6> digest{};
};

/// One frame. The payload is zero-filled beyond `length`, so every message decodes at fixed offsets whatever
/// the sender cut off.
struct Frame {
  std::uint8_t version = 2;  ///< 1 or 2
  std::uint8_t incompat_flags = 0;
  std::uint8_t compat_flags = 0;
  std::uint8_t sequence = 0;
  std::uint8_t system_id = 0;
  std::uint8_t component_id = 0;
  std::uint32_t message_id = 0;  ///< 24 bits; 8 bits in version 1
  std::uint8_t length = 0;       ///< payload bytes on the wire
  std::array<std::uint8_t, kMaxPayload> payload{};
  std::optional<Signature> signature{};
};

/// Who sends, and how.
struct Sender {
  std::uint8_t system_id;
  std::uint8_t component_id;
  std::uint8_t version = 2;
};

/// The message of a frame whose message_id is Message::kId.
template <class Message>
[[nodiscard]] constexpr Message decode(const Frame& frame) noexcept {
  static_assert(kMaxLength<Message> <= kMaxPayload);
  return decode_payload<Message>(frame.payload);
}

/// Frame of a message: base fields only in version 1, trailing zero bytes cut (but never the first byte) in
/// version 2.
template <class Message>
[[nodiscard]] constexpr Frame make_frame(const Message& message, const Sender& sender,
                                         std::uint8_t sequence) noexcept {
  static_assert(kMaxLength<Message> <= kMaxPayload);
  Frame frame;
  frame.version = sender.version;
  frame.sequence = sequence;
  frame.system_id = sender.system_id;
  frame.component_id = sender.component_id;
  frame.message_id = Message::kId;
  encode_payload(message, frame.payload);
  std::size_t length = kMinLength<Message>;
  if (sender.version == 1) {
    for (std::size_t i = length; i < kMaxLength<Message>; ++i) frame.payload[i] = 0;
  } else {
    length = kMaxLength<Message>;
    while (length > 1 && frame.payload[length - 1] == 0) --length;
  }
  frame.length = static_cast<std::uint8_t>(length);
  return frame;
}

/// A frame's bytes.
struct EncodedFrame {
  std::array<std::uint8_t, kMaxFrame> bytes{};
  std::size_t size = 0;

  [[nodiscard]] std::span<const std::uint8_t> view() const noexcept { return std::span{bytes}.first(size); }
};

/// Bytes of a frame, its `length` payload bytes as they are. `crc_extra` is the checksum seed of its message.
/// A signature is appended as given (version 2 only) and sets its flag.
[[nodiscard]] EncodedFrame encode_frame(const Frame& frame, std::uint8_t crc_extra) noexcept;

/// Bytes of a message.
template <class Message>
[[nodiscard]] EncodedFrame encode(const Message& message, const Sender& sender,
                                  std::uint8_t sequence) noexcept {
  return encode_frame(make_frame(message, sender, sequence), crc_extra_of<Message>());
}

}  // namespace airworthy::mavlink
