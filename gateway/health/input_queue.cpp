#include "gateway/health/input_queue.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace airworthy::health {
namespace {

auto order_of(const InputQueue::Released& released) {
  const Origin& origin = origin_of(released.input);
  return std::make_tuple(origin.sent, std::string_view{origin.producer}, released.input.index(),
                         origin.session, origin.seq);
}

std::size_t items_in(const Input& input) {
  const auto* report = std::get_if<DetectorReport>(&input);
  return report == nullptr ? 1 : 1 + report->active.size() + report->components.size();
}

}  // namespace

void InputQueue::push(Input input, HealthCounters& counters) {
  const std::string& producer = origin_of(input).producer;
  if (producer.empty()) {
    ++counters.refused_unnamed;
    return;
  }
  const std::size_t items = items_in(input);
  if (items_ + items > config_.limits.queued_items) {
    ++counters.refused_queue_full;
    return;
  }
  std::size_t& of_producer = items_per_producer_[producer];
  if (of_producer + items > config_.limits.queued_items_per_producer) {
    ++counters.refused_queue_full;
    return;
  }
  of_producer += items;
  items_ += items;
  waiting_.push_back({std::move(input), false});
}

std::vector<InputQueue::Released> InputQueue::take(TimePoint previous, TimePoint tick,
                                                   HealthCounters& counters) {
  std::vector<Released> own;
  std::vector<Released> foreign;
  std::vector<Waiting> still_waiting;
  for (Waiting& waiting : waiting_) {
    const TimePoint sent = origin_of(waiting.input).sent;
    const bool near =
        sent >= previous - config_.foreign_clock && sent <= std::max(tick, previous) + config_.foreign_clock;
    if (!waiting.own_clock && !near) {
      foreign.push_back({std::move(waiting.input), true});
    } else if (sent <= previous) {
      own.push_back({std::move(waiting.input), false});
    } else {
      still_waiting.push_back({std::move(waiting.input), true});
    }
  }
  waiting_ = std::move(still_waiting);
  items_ = 0;
  items_per_producer_.clear();
  for (const Waiting& waiting : waiting_) {
    const std::size_t items = items_in(waiting.input);
    items_ += items;
    items_per_producer_[origin_of(waiting.input).producer] += items;
  }

  std::stable_sort(own.begin(), own.end(),
                   [](const Released& a, const Released& b) { return order_of(a) < order_of(b); });
  counters.foreign_clock += static_cast<std::int64_t>(foreign.size());
  own.insert(own.end(), std::make_move_iterator(foreign.begin()), std::make_move_iterator(foreign.end()));
  return own;
}

std::vector<InputQueue::Released> InputQueue::take_all(HealthCounters& counters) {
  std::vector<Released> all;
  all.reserve(waiting_.size());
  for (Waiting& waiting : waiting_) all.push_back({std::move(waiting.input), true});
  waiting_.clear();
  items_ = 0;
  items_per_producer_.clear();
  counters.foreign_clock += static_cast<std::int64_t>(all.size());
  return all;
}

}  // namespace airworthy::health
