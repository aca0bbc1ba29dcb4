#pragma once

#include <map>
#include <optional>
#include <string>

#include "airworthy/detector_status_t.hpp"
#include "cli/eval/judgement_log.h"

namespace airworthy::eval {

/// Tells from DETECTOR_STATUS, half a second apart, when a detector judged. The time between two of them counts as
/// judged only if both say so.
class StatusJudgement {
 public:
  void on_status(const detector_status_t& status);

  /// A component at least is judged.
  [[nodiscard]] const JudgementLog& whole() const { return whole_.log; }
  [[nodiscard]] std::map<std::string, JudgementLog> components() const;
  /// Counters of the newest status whose name says that messages do not fit the vehicle file; empty if there are none.
  [[nodiscard]] const std::string& misfits() const { return misfits_; }

 private:
  struct Stream {
    JudgementLog log;
    std::optional<std::string> why_muted;  ///< at the newest status; "" = judged

    void note(TimePoint from, TimePoint until, const std::string& why_muted_now);
  };

  Stream whole_;
  std::map<std::string, Stream> components_;
  std::optional<TimePoint> newest_;
  std::string misfits_;
};

}  // namespace airworthy::eval
