#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/protocol/mavlink/frame.h"

namespace airworthy::mavlink {

/// Whether the bytes start with a complete frame whose message is in message_table() and whose checksum is
/// right.
[[nodiscard]] bool starts_with_verified_frame(std::span<const std::uint8_t> bytes) noexcept;

/// Monotonic counts since construction. Every byte is in exactly one place: part of a counted frame, in
/// bytes_skipped, or still pending.
struct ParserCounters {
  std::uint64_t bytes = 0;      ///< pushed
  std::uint64_t frames_ok = 0;  ///< checksum verified and delivered
  std::uint64_t frames_unverified =
      0;  ///< message id outside message_table(): skipped by length, not delivered
  std::uint64_t frames_incompatible = 0;  ///< unknown incompatibility flag: dropped by length
  std::uint64_t frames_old_esc_info =
      0;                         ///< ESC_INFO as defined before 2021-08-25: the device's dialect is too old
  std::uint64_t crc_errors = 0;  ///< candidates whose checksum failed: damaged frames and false start bytes
  std::uint64_t bytes_skipped = 0;      ///< belong to no frame
  std::uint64_t frames_lost = 0;        ///< gaps in the sequence numbers of each sender
  std::uint64_t frames_reordered = 0;   ///< sequence number repeated or older than the last one
  std::uint64_t senders_forgotten = 0;  ///< pushed out of the table of the last kMaxSenders heard
};

/// Finds MAVLink 1 and 2 frames in a byte stream. No heap; what it reports depends on the bytes alone, never
/// on how they were cut into calls of push().
///
/// A start byte opens a candidate, which waits until all bytes its length field announces are there. If the
/// checksum fails, the search goes on at the byte after the false start, so a real frame that noise seemed to
/// contain is found. Some candidates cannot be checked: those with a message id outside message_table() or an
/// unknown incompatibility flag. They are skipped as a whole only if the byte after them is a start byte and
/// no verified frame starts inside them, which may take a wait for that frame's end; otherwise they too are a
/// false start. So noise never costs a verified frame; the price is that a frame tunnelled in the payload of
/// an unknown message is taken for one of the link. Only verified frames are delivered.
class Parser {
 public:
  /// Senders whose sequence numbers are followed: those heard last.
  static constexpr std::size_t kMaxSenders = 32;

  /// Appends bytes and calls `sink(const Frame&)` for each frame they complete. The sink must not call
  /// push().
  template <class Sink>
  void push(std::span<const std::uint8_t> bytes, Sink&& sink) {
    while (!bytes.empty()) {
      bytes = bytes.subspan(append(bytes));
      deliver(sink, false);
    }
  }

  /// Declares that nothing more will complete what is pending: the end of a datagram or file, or a long
  /// silence. An incomplete candidate becomes a false start, and real frames inside it are delivered.
  template <class Sink>
  void flush(Sink&& sink) {
    deliver(sink, true);
  }

  /// Forgets pending bytes and sequence numbers, as after reconnecting; the pending bytes count as skipped.
  void reset() noexcept;

  [[nodiscard]] const ParserCounters& counters() const noexcept { return counters_; }
  /// Bytes of a candidate that is not complete yet.
  [[nodiscard]] std::size_t pending_bytes() const noexcept { return end_ - begin_; }

 private:
  struct SenderSequence {
    std::uint8_t system_id;
    std::uint8_t component_id;
    std::uint8_t last;
    bool was_behind;  // the frame before was older than `last`
  };
  enum class Step { kFrame, kAgain, kNeedMore };

  template <class Sink>
  void deliver(Sink& sink, bool is_final) {
    for (;;) {
      const Step step = advance(is_final);
      if (step == Step::kNeedMore) return;
      if (step == Step::kFrame) sink(static_cast<const Frame&>(frame_));
    }
  }

  std::size_t append(std::span<const std::uint8_t> bytes) noexcept;
  Step advance(bool is_final) noexcept;
  Step reject_start() noexcept;
  Step skip_frame(std::uint64_t& count, std::size_t size) noexcept;
  Step weigh_uncheckable(std::uint64_t& count, std::size_t size, bool is_final) noexcept;
  [[nodiscard]] SenderSequence* find_sender(const Frame& frame) noexcept;
  void follow_sequence(const Frame& frame) noexcept;
  // Several of the longest frame: each refill moves the unfinished candidate to the front.
  std::array<std::uint8_t, 4 * kMaxFrame> buffer_{};
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  Frame frame_{};
  std::array<SenderSequence, kMaxSenders> senders_{};  // the one heard last comes first
  std::size_t sender_count_ = 0;
  ParserCounters counters_{};
};

}  // namespace airworthy::mavlink
