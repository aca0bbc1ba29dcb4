#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "runtime/error.h"

namespace airworthy::sim {

/// The device side of a serial line: a pseudo-terminal whose other end a driver opens by a symbolic link.
class PseudoTerminal {
 public:
  /// `link` becomes a symbolic link to the terminal; one that is there is replaced, anything else is an error.
  [[nodiscard]] static rt::Expected<std::unique_ptr<PseudoTerminal>> open(const std::filesystem::path& link);
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;
  ~PseudoTerminal();

  /// Like a serial line it drops what nobody reads: whole calls, counted.
  void write(std::span<const std::uint8_t> bytes);
  /// What has arrived, without waiting.
  [[nodiscard]] std::vector<std::uint8_t> read();
  [[nodiscard]] std::int64_t writes_dropped() const { return writes_dropped_; }

 private:
  PseudoTerminal(int device, int line, std::filesystem::path link)
      : device_{device}, line_{line}, link_{std::move(link)} {}

  int device_;
  int line_;  ///< kept open, so that a driver may come and go
  std::filesystem::path link_;
  std::int64_t writes_dropped_ = 0;
};

}  // namespace airworthy::sim
