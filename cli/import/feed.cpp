#include "cli/import/feed.h"

#include <algorithm>

namespace airworthy::importer {
namespace {

constexpr int kMessagesPerReport = 1000;

void publish(const Truth& truth, FlightLog& log) {
  ground_truth_t message;
  message.component = truth.component;
  message.fault_kind = truth.fault_kind;
  message.onset_us = truth.fault_kind == kNoFault ? -1 : to_us(*truth.time);
  message.magnitude = truth.magnitude;
  log.publish(message, *truth.time);
}

// Gives every truth a time, none before the start, and sorts them.
void place(std::vector<Truth>& truths, TimePoint start) {
  for (Truth& truth : truths) {
    if (truth.after_start) truth.time = start + *truth.after_start;
    truth.time = std::max(truth.time.value_or(start), start);
  }
  std::stable_sort(truths.begin(), truths.end(),
                   [](const Truth& a, const Truth& b) { return *a.time < *b.time; });
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
  place(truths, start);

  auto truth = truths.begin();
  for (int messages = 0; !live.empty(); ++messages) {
    if (messages % kMessagesPerReport == 0) {
      if (auto reported = progress(done_ratio(feeds)); !reported) return reported;
    }
    const auto first = std::min_element(live.begin(), live.end(), earlier);
    for (; truth != truths.end() && *truth->time <= (*first)->time(); ++truth) {
      publish(*truth, log);
    }
    (*first)->publish(log);
    const auto more = (*first)->next();
    if (!more) return tl::unexpected<rt::Error>{more.error()};
    if (!*more) live.erase(first);
  }
  for (; truth != truths.end(); ++truth) publish(*truth, log);
  return progress(1.0);
}

}  // namespace airworthy::importer
