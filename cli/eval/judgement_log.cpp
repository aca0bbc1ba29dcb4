#include "cli/eval/judgement_log.h"

#include <algorithm>
#include <numeric>

namespace airworthy::eval {
namespace {

void append(std::vector<JudgementLog::Interval>& intervals, TimePoint from, TimePoint until) {
  if (!intervals.empty() && intervals.back().until == from) {
    intervals.back().until = until;
  } else {
    intervals.push_back({from, until});
  }
}

}  // namespace

void JudgementLog::note(TimePoint from, TimePoint until, const std::string& why_muted) {
  has_any_ = true;
  const double seconds = to_seconds(until - from);
  if (why_muted.empty()) {
    judged_s_ += seconds;
    append(judged_, from, until);
    return;
  }
  auto cause = std::find_if(muted_.begin(), muted_.end(), [&](const Muted& m) { return m.why == why_muted; });
  if (cause == muted_.end()) cause = muted_.insert(muted_.end(), {why_muted, 0.0, {}});
  cause->seconds += seconds;
  append(cause->intervals, from, until);
}

double JudgementLog::judged_s(const Interval& within) const {
  return std::accumulate(judged_.begin(), judged_.end(), 0.0, [&within](double sum, const Interval& one) {
    return sum +
           std::max(0.0, to_seconds(std::min(one.until, within.until) - std::max(one.from, within.from)));
  });
}

double JudgementLog::muted_s() const {
  return std::accumulate(muted_.begin(), muted_.end(), 0.0,
                         [](double sum, const Muted& one) { return sum + one.seconds; });
}

std::string JudgementLog::main_cause() const {
  const auto longest =
      std::max_element(muted_.begin(), muted_.end(),
                       [](const Muted& one, const Muted& other) { return one.seconds < other.seconds; });
  return longest == muted_.end() ? std::string{} : longest->why;
}

}  // namespace airworthy::eval
