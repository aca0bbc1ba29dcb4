#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace airworthy::mavlink {

/// What the parser must know of a message to check it, whether or not anything decodes it.
struct MessageInfo {
  std::uint32_t id;
  std::string_view name;
  std::uint8_t crc_extra;   ///< seed of the checksum, a hash of the message's definition
  std::uint8_t min_length;  ///< bytes of the base fields: the payload of a version 1 frame
  std::uint8_t max_length;  ///< bytes with all extension fields
};

/// The public dialects' messages, sorted by id. A frame outside this table cannot be checked, and unchecked
/// frames are how noise swallows real ones: so the table holds far more than messages.h decodes.
[[nodiscard]] std::span<const MessageInfo> message_table() noexcept;

/// Row of a message, null if the table has none. O(log n).
[[nodiscard]] const MessageInfo* find_message(std::uint32_t id) noexcept;

}  // namespace airworthy::mavlink
