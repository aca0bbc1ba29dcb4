#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "core/protocol/mavlink/crc.h"

namespace airworthy::mavlink {

/// One field of a message. A message lists its fields once, in wire order; reading, writing, lengths and the
/// checksum seed all follow from that list, so they cannot disagree.
template <class Message, class T>
struct Field {
  std::string_view name;
  T Message::*member;
  bool is_extension;
};

template <class Message, class T>
constexpr Field<Message, T> base(std::string_view name, T Message::*member) noexcept {
  return {name, member, false};
}

/// Extension fields follow the base fields, are absent from version 1 frames and do not enter the checksum
/// seed.
template <class Message, class T>
constexpr Field<Message, T> extension(std::string_view name, T Message::*member) noexcept {
  return {name, member, true};
}

/// Wire properties of a field's C++ type: a number, or an array of numbers.
template <class T>
struct WireType {
  using Element = T;
  static constexpr std::size_t kCount = 1;
  static constexpr bool kIsArray = false;
};
template <class T, std::size_t N>
struct WireType<std::array<T, N>> {
  using Element = T;
  static constexpr std::size_t kCount = N;
  static constexpr bool kIsArray = true;
};

/// The dialect's name of a type, which the checksum seed is computed over.
template <class T>
constexpr std::string_view wire_type_name() noexcept {
  if constexpr (std::is_same_v<T, char>) {
    return "char";
  } else if constexpr (std::is_same_v<T, std::uint8_t>) {
    return "uint8_t";
  } else if constexpr (std::is_same_v<T, std::int8_t>) {
    return "int8_t";
  } else if constexpr (std::is_same_v<T, std::uint16_t>) {
    return "uint16_t";
  } else if constexpr (std::is_same_v<T, std::int16_t>) {
    return "int16_t";
  } else if constexpr (std::is_same_v<T, std::uint32_t>) {
    return "uint32_t";
  } else if constexpr (std::is_same_v<T, std::int32_t>) {
    return "int32_t";
  } else if constexpr (std::is_same_v<T, std::uint64_t>) {
    return "uint64_t";
  } else if constexpr (std::is_same_v<T, std::int64_t>) {
    return "int64_t";
  } else if constexpr (std::is_same_v<T, float>) {
    return "float";
  } else {
    static_assert(std::is_same_v<T, double>, "not a type of the wire");
    return "double";
  }
}

template <std::size_t Size>
struct UnsignedOfSize;
template <>
struct UnsignedOfSize<1> {
  using Type = std::uint8_t;
};
template <>
struct UnsignedOfSize<2> {
  using Type = std::uint16_t;
};
template <>
struct UnsignedOfSize<4> {
  using Type = std::uint32_t;
};
template <>
struct UnsignedOfSize<8> {
  using Type = std::uint64_t;
};

/// Little-endian number at `bytes`, which has at least sizeof(T) bytes.
template <class T>
constexpr T read_number(const std::uint8_t* bytes) noexcept {
  using Bits = typename UnsignedOfSize<sizeof(T)>::Type;
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) bits |= static_cast<std::uint64_t>(bytes[i]) << (8U * i);
  return std::bit_cast<T>(static_cast<Bits>(bits));
}

template <class T>
constexpr void write_number(T value, std::uint8_t* bytes) noexcept {
  const std::uint64_t bits = std::bit_cast<typename UnsignedOfSize<sizeof(T)>::Type>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes[i] = static_cast<std::uint8_t>(bits >> (8U * i));
}

/// Calls `visit(field)` for each field of the message, in wire order.
template <class Message, class Visitor>
constexpr void for_each_field(Visitor&& visit) {
  std::apply([&visit](const auto&... field) { (visit(field), ...); }, Message::fields());
}

template <class Message>
constexpr std::size_t length_of(bool with_extensions) noexcept {
  std::size_t length = 0;
  for_each_field<Message>([&]<class Owner, class T>(const Field<Owner, T>& field) {
    if (field.is_extension && !with_extensions) return;
    length += sizeof(typename WireType<T>::Element) * WireType<T>::kCount;
  });
  return length;
}

template <class Message>
inline constexpr std::size_t kMinLength = length_of<Message>(false);
template <class Message>
inline constexpr std::size_t kMaxLength = length_of<Message>(true);

/// Fills a message from a payload that is zero-filled to at least kMaxLength bytes.
template <class Message>
constexpr Message decode_payload(std::span<const std::uint8_t> payload) noexcept {
  Message message;
  const std::uint8_t* at = payload.data();
  for_each_field<Message>([&]<class Owner, class T>(const Field<Owner, T>& field) {
    if constexpr (WireType<T>::kIsArray) {
      for (auto& element : message.*field.member) {
        element = read_number<typename T::value_type>(at);
        at += sizeof(typename T::value_type);
      }
    } else {
      message.*field.member = read_number<T>(at);
      at += sizeof(T);
    }
  });
  return message;
}

/// Writes the message, extensions included, to a payload of at least kMaxLength bytes.
template <class Message>
constexpr void encode_payload(const Message& message, std::span<std::uint8_t> payload) noexcept {
  std::uint8_t* at = payload.data();
  for_each_field<Message>([&]<class Owner, class T>(const Field<Owner, T>& field) {
    if constexpr (WireType<T>::kIsArray) {
      for (const auto& element : message.*field.member) {
        write_number(element, at);
        at += sizeof(typename T::value_type);
      }
    } else {
      write_number(message.*field.member, at);
      at += sizeof(T);
    }
  });
}

/// Checksum seed of a message, from its definition: the checksum over its name and, for each base field,
/// type, name and array length, folded to one byte.
template <class Message>
constexpr std::uint8_t crc_extra_of() noexcept {
  Crc16 crc;
  const auto add_word = [&crc](std::string_view word) {
    for (const char letter : word) crc.add(static_cast<std::uint8_t>(letter));
    crc.add(std::uint8_t{' '});
  };
  add_word(Message::kName);
  for_each_field<Message>([&]<class Owner, class T>(const Field<Owner, T>& field) {
    if (field.is_extension) return;
    add_word(wire_type_name<typename WireType<T>::Element>());
    add_word(field.name);
    if constexpr (WireType<T>::kIsArray) crc.add(static_cast<std::uint8_t>(WireType<T>::kCount));
  });
  return static_cast<std::uint8_t>((crc.value() & 0xFFU) ^ (crc.value() >> 8U));
}

}  // namespace airworthy::mavlink
