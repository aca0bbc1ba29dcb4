#pragma once

#include <cstdint>
#include <string>

#include "core/time/time.h"

namespace airworthy::rt {

/// What a message header says of its stream.
enum class Arrival {
  kAccepted,
  kDuplicate,      ///< same number as the last one
  kOutOfOrder,     ///< older number, or a straggler of an earlier session
  kTimeBackward,   ///< newer number, older measurement
  kAheadOfStream,  ///< measurement time leapt further ahead than the sender's own clock
  kBadHeader,      ///< negative time or number, empty or overlong producer
};
inline constexpr int kArrivalKinds = 6;

/// Judges the messages of one producer on one channel by their headers alone, never by the local clock, and
/// counts what was lost on the way. Whatever is not accepted must not reach a detector. A stream that stays
/// off for kResynchronise messages in a row is believed: its clock really changed, or a recording was started
/// over.
class StreamMonitor {
 public:
  static constexpr int kResynchronise = 10;
  static constexpr Duration kLeap{1'000'000};

  struct Header {
    TimePoint time;
    TimePoint sent;
    std::int64_t seq = 0;
    std::int64_t session = 0;
  };

  [[nodiscard]] Arrival judge(const Header& header);

  [[nodiscard]] std::int64_t accepted() const { return accepted_; }
  [[nodiscard]] std::int64_t lost() const { return lost_; }          ///< numbers never seen
  [[nodiscard]] std::int64_t restarts() const { return restarts_; }  ///< changes of session
  [[nodiscard]] std::int64_t resynchronised() const { return resynchronised_; }

 private:
  [[nodiscard]] Arrival compare(const Header& header) const;
  void count_gap(const Header& header, Arrival arrival);
  void accept(const Header& header);

  Header last_;  ///< newest accepted
  std::int64_t highest_seq_ = 0;
  int rejected_in_a_row_ = 0;
  std::int64_t accepted_ = 0;
  std::int64_t lost_ = 0;
  std::int64_t restarts_ = 0;
  std::int64_t resynchronised_ = 0;
};

[[nodiscard]] const char* to_string(Arrival arrival);

}  // namespace airworthy::rt
