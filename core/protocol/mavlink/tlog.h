#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace airworthy::mavlink {

/// One packet of a telemetry log.
struct TlogRecord {
  std::int64_t time_us = 0;              ///< Unix time at which the ground station received it
  std::size_t offset = 0;                ///< of the record (its time) in the file
  std::span<const std::uint8_t> packet;  ///< from the start byte through checksum and signature; not verified
};

enum class TlogStatus {
  kRecord,     ///< a record was read
  kEnd,        ///< the file ends here, cleanly
  kTruncated,  ///< the file ends inside the record that starts at the record's offset
  kCorrupt,    ///< no record starts at the record's offset; reading continues at the next plausible one
};

/// Reads the telemetry log of a ground station: for each packet 8 bytes of time, most significant first, then
/// the packet. After damage it goes on at the next place that looks like a record: a time before 2200 and
/// within one day of the last good one, then a packet that is intact, or that ends where another such record
/// starts or the file ends. The data must outlive the reader.
class TlogReader {
 public:
  explicit TlogReader(std::span<const std::uint8_t> data) noexcept : data_{data} {}

  /// Reads the next record. Whatever the status, record.offset says where in the file it holds. kEnd and
  /// kTruncated repeat.
  TlogStatus next(TlogRecord& record) noexcept;

 private:
  [[nodiscard]] std::size_t packet_size_at(std::size_t offset) const noexcept;
  [[nodiscard]] bool is_plausible_at(std::size_t offset) const noexcept;
  [[nodiscard]] std::int64_t time_at(std::size_t offset) const noexcept;

  std::span<const std::uint8_t> data_;
  std::size_t offset_ = 0;
  std::int64_t last_time_us_ = 0;
  bool has_time_ = false;
};

}  // namespace airworthy::mavlink
