#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace airworthy {

/// Length in bytes of the valid UTF-8 character at `i`; 0 if there is none. Overlong forms, surrogates and
/// what lies beyond U+10FFFF are none [RFC 3629, section 4].
constexpr std::size_t utf8_length(std::string_view text, std::size_t i) noexcept {
  const auto byte = [&](std::size_t k) {
    return static_cast<unsigned>(static_cast<unsigned char>(text[i + k]));
  };
  const unsigned lead = byte(0);
  if (lead < 0x80) return 1;
  std::size_t length = 0;
  if (lead >= 0xC2 && lead <= 0xDF) length = 2;
  if (lead >= 0xE0 && lead <= 0xEF) length = 3;
  if (lead >= 0xF0 && lead <= 0xF4) length = 4;
  if (length == 0 || text.size() - i < length) return 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xC0U) != 0x80U) return 0;
  }
  const unsigned second = byte(1);
  if (lead == 0xE0 && second < 0xA0) return 0;
  if (lead == 0xED && second > 0x9F) return 0;
  if (lead == 0xF0 && second < 0x90) return 0;
  if (lead == 0xF4 && second > 0x8F) return 0;
  return length;
}

/// Is the character of this length at `i` one that a terminal could obey: C0, DEL or C1?
constexpr bool is_control(std::string_view text, std::size_t i, std::size_t length) noexcept {
  const auto lead = static_cast<unsigned char>(text[i]);
  if (length == 1) return lead < 0x20 || lead == 0x7F;
  return lead == 0xC2 && static_cast<unsigned char>(text[i + 1]) < 0xA0;
}

/// Printable, valid UTF-8 of at most `max_bytes`: control characters become spaces, broken bytes '?'.
/// `String` is any string type with append(): core itself has none.
template <class String>
String clean_text(std::string_view text, std::size_t max_bytes) {
  String out;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    const bool plain = length > 0 && !is_control(text, i, length);
    const std::string_view written =
        plain ? text.substr(i, length) : std::string_view{length == 0 ? "?" : " "};
    if (out.size() + written.size() > max_bytes) break;
    out.append(written);
    i += std::max<std::size_t>(length, 1);
  }
  return out;
}

}  // namespace airworthy
