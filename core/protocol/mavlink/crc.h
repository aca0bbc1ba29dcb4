#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace airworthy::mavlink {

constexpr std::array<std::uint16_t, 256> make_crc16_table() noexcept {
  std::array<std::uint16_t, 256> table{};
  for (std::size_t index = 0; index < table.size(); ++index) {
    auto remainder = static_cast<std::uint16_t>(index);
    for (int bit = 0; bit < 8; ++bit) {
      const bool carry = (remainder & 1U) != 0;
      remainder = static_cast<std::uint16_t>((remainder >> 1U) ^ (carry ? 0x8408U : 0U));
    }
    table[index] = remainder;
  }
  return table;
}

/// CRC-16/MCRF4XX: polynomial 0x1021 reflected (0x8408), initial value 0xFFFF, no final inversion;
/// of "123456789" it is 0x6F91. One table step per byte.
class Crc16 {
 public:
  constexpr void add(std::uint8_t byte) noexcept {
    value_ = static_cast<std::uint16_t>((value_ >> 8U) ^ kTable[(value_ ^ byte) & 0xFFU]);
  }
  constexpr void add(std::span<const std::uint8_t> bytes) noexcept {
    for (const std::uint8_t byte : bytes) add(byte);
  }
  [[nodiscard]] constexpr std::uint16_t value() const noexcept { return value_; }

 private:
  static constexpr std::array<std::uint16_t, 256> kTable = make_crc16_table();

  std::uint16_t value_ = 0xFFFF;
};

}  // namespace airworthy::mavlink
