#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "runtime/error.h"

namespace airworthy::importer {

/// The content of a file from its start to its end; of a file called *.xz, what was compressed.
class ByteSource {
 public:
  [[nodiscard]] static rt::Expected<std::unique_ptr<ByteSource>> open(const std::filesystem::path& path);

  ByteSource() = default;
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;
  virtual ~ByteSource() = default;

  /// Fills the buffer as far as it can, 0 = the end. What is wrong with the file names the byte.
  [[nodiscard]] virtual rt::Expected<std::size_t> read(std::span<char> buffer) = 0;

  /// Bytes of the file consumed so far, and in all.
  [[nodiscard]] virtual std::uint64_t position() const = 0;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
};

/// The whole content at once.
[[nodiscard]] rt::Expected<std::string> read_all(const std::filesystem::path& path);

}  // namespace airworthy::importer
