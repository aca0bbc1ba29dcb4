#include "cli/eval/judgement_log.h"

#include <algorithm>
#include <numeric>

namespace airworthy::eval {

void JudgementLog::note(TimePoint from, TimePoint until, const std::string& why_muted) {
  has_any_ = true;
  const double seconds = to_seconds(until - from);
  if (why_muted.empty()) {
    judged_s_ += seconds;
    return;
  }
  auto cause = std::find_if(muted_.begin(), muted_.end(), [&](const Muted& m) { return m.why == why_muted; });
  if (cause == muted_.end()) cause = muted_.insert(muted_.end(), {why_muted, 0.0, {}});
  cause->seconds += seconds;
  if (!cause->intervals.empty() && cause->intervals.back().until == from) {
    cause->intervals.back().until = until;
  } else {
    cause->intervals.push_back({from, until});
  }
}

double JudgementLog::muted_s() const {
  return std::accumulate(muted_.begin(), muted_.end(), 0.0,
                         [](double sum, const Muted& one) { return sum + one.seconds; });
}

}  // namespace airworthy::eval
