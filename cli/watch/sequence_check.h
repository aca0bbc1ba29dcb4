#pragma once

#include <cstdint>
#include <optional>

namespace airworthy::watch {

/// Finds what was lost between gateway and here by the sequence numbers.
class SequenceCheck {
 public:
  struct Finding {
    std::int64_t lost{};  ///< messages between the last one and this
    bool restarted{};     ///< another run of the gateway
  };

  Finding add(std::int64_t session, std::int64_t sequence) {
    Finding finding;
    if (session_ && *session_ != session) finding.restarted = true;
    if (session_ == session && sequence > sequence_) finding.lost = sequence - sequence_ - 1;
    session_ = session;
    sequence_ = sequence;
    lost_ += finding.lost;
    return finding;
  }

  [[nodiscard]] std::int64_t lost() const { return lost_; }

 private:
  std::optional<std::int64_t> session_;
  std::int64_t sequence_{};
  std::int64_t lost_{};
};

}  // namespace airworthy::watch
