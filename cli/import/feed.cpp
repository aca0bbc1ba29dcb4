#include "cli/import/feed.h"

#include <algorithm>
#include <limits>

namespace airworthy::importer {
namespace {

constexpr int kMessagesPerReport = 1000;

void publish(const Truth& truth, TimePoint start, FlightLog& log) {
  ground_truth_t message;
  message.component = truth.component;
  message.fault_kind = truth.fault_kind;
  message.onset_us = truth.fault_kind == kNoFault ? -1 : to_us(truth.onset.value_or(start));
  message.magnitude = std::numeric_limits<double>::quiet_NaN();
  log.publish(message, truth.onset.value_or(start));
}

double done_ratio(const std::vector<std::unique_ptr<Feed>>& feeds) {
  double position = 0.0;
  double size = 0.0;
  for (const auto& feed : feeds) {
    position += static_cast<double>(feed->position());
    size += static_cast<double>(feed->size());
  }
  return size > 0.0 ? position / size : 1.0;
}

}  // namespace

rt::Expected<void> merge(std::vector<std::unique_ptr<Feed>>& feeds, std::vector<Truth> truths, FlightLog& log,
                         const Progress& progress) {
  std::vector<Feed*> live;
  for (const auto& feed : feeds) {
    const auto more = feed->next();
    if (!more) return tl::unexpected<rt::Error>{more.error()};
    if (*more) live.push_back(feed.get());
  }
  const auto earlier = [](const Feed* a, const Feed* b) { return a->time() < b->time(); };
  if (live.empty()) return {};
  const TimePoint start = (*std::min_element(live.begin(), live.end(), earlier))->time();
  // A fault older than the recording is there from its start.
  for (Truth& truth : truths) {
    if (truth.onset && *truth.onset < start) truth.onset.reset();
  }
  std::stable_sort(truths.begin(), truths.end(), [&](const Truth& a, const Truth& b) {
    return a.onset.value_or(start) < b.onset.value_or(start);
  });

  auto truth = truths.begin();
  for (int messages = 0; !live.empty(); ++messages) {
    if (messages % kMessagesPerReport == 0) {
      if (const auto reported = progress(done_ratio(feeds)); !reported) return reported;
    }
    const auto first = std::min_element(live.begin(), live.end(), earlier);
    for (; truth != truths.end() && truth->onset.value_or(start) <= (*first)->time(); ++truth) {
      publish(*truth, start, log);
    }
    (*first)->publish(log);
    const auto more = (*first)->next();
    if (!more) return tl::unexpected<rt::Error>{more.error()};
    if (!*more) live.erase(first);
  }
  for (; truth != truths.end(); ++truth) publish(*truth, start, log);
  return progress(1.0);
}

}  // namespace airworthy::importer
