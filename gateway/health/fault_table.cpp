#include "gateway/health/fault_table.h"

#include <algorithm>
#include <utility>

namespace airworthy::health {
namespace {

bool is_worse(const FaultReport& a, const FaultReport& b) {
  const auto key = [](const FaultReport& f) {
    return std::make_tuple(-static_cast<int>(f.severity), f.onset, std::string_view{f.origin.producer},
                           f.origin.session, f.number);
  };
  return key(a) < key(b);
}

bool is_same_finding(const FaultReport& a, const FaultReport& b) {
  return a.component == b.component && a.fault_kind == b.fault_kind;
}

}  // namespace

bool FaultTable::is_overtaken(const FaultReport& event, const DetectorTable& detectors) {
  const DetectorTable::Detector* detector = detectors.find(event.origin.producer, event.detector);
  return detector != nullptr && detector->session == event.origin.session &&
         detector->report.active_is_complete && detector->stamp.sent > event.origin.sent;
}

void FaultTable::update(Fault& fault, const FaultReport& report, TimePoint word) {
  const FaultReport before = std::exchange(fault.report, report);
  fault.report.origin.producer = before.origin.producer;
  fault.report.origin.session = before.origin.session;
  fault.report.detected = before.detected;
  fault.word = word;
  fault.event_seq = report.origin.seq;
}

void FaultTable::apply(const FaultReport& event, Relation relation, bool foreign_clock, TimePoint as_of,
                       const DetectorTable& detectors) {
  if (relation == Relation::kRefused) return;
  const Key key{event.origin.producer, event.origin.session, event.number};
  const TimePoint word = event.origin.sent;
  const auto fault = active_.find(key);
  if (fault != active_.end()) {
    // A status of the same instant already carries what the event says; only the event's number can tell.
    const bool newer = word > fault->second.word ||
                       (word == fault->second.word && event.origin.seq > fault->second.event_seq);
    if (!newer) {
      ++counters_.stale_messages;
      return;
    }
    if (event.phase == FaultPhase::kClear) return clear(fault, word);
    update(fault->second, event, word);
    return;
  }
  if (const auto cleared = cleared_.find(key); cleared != cleared_.end()) {
    // Numbers are not used twice, so no event can raise it again; a later status can (clear_absent was
    // mistaken).
    cleared->second = std::max(cleared->second, event.phase == FaultPhase::kClear ? word : TimePoint::min());
    ++counters_.stale_messages;
    return;
  }
  if (event.phase == FaultPhase::kClear) return remember_cleared(key, word);
  if (is_overtaken(event, detectors)) {
    ++counters_.stale_messages;
    return;
  }
  raise(key, event, word, foreign_clock, as_of);
}

void FaultTable::apply(const DetectorReport& report, bool foreign_clock, TimePoint as_of) {
  const TimePoint word = report.origin.sent;
  for (const FaultReport& listed : report.active) {
    if (listed.phase == FaultPhase::kClear) continue;
    const Key key{report.origin.producer, report.origin.session, listed.number};
    if (const auto fault = active_.find(key); fault != active_.end()) {
      if (word > fault->second.word) update(fault->second, listed, word);
      continue;
    }
    if (const auto cleared = cleared_.find(key); cleared != cleared_.end()) {
      if (word <= cleared->second) continue;
      cleared_order_.erase(std::find(cleared_order_.begin(), cleared_order_.end(), key));
      cleared_.erase(cleared);
    }
    FaultReport healed = listed;
    healed.origin.producer = report.origin.producer;
    healed.origin.session = report.origin.session;
    ++counters_.raised_by_status;
    raise(key, healed, word, foreign_clock, as_of);
  }
  clear_absent(report);
  settle_earlier_sessions(report);
}

void FaultTable::raise(const Key& key, const FaultReport& report, TimePoint word, bool foreign_clock,
                       TimePoint as_of) {
  if (!make_room_for(report)) {
    ++counters_.refused_table_full;
    return;
  }
  Fault& fault = active_[key];
  fault = {report, word, report.origin.seq};
  // Dates that mean nothing on our clock would end up before the operator as "failed since".
  if (foreign_clock || fault.report.detected > as_of || to_us(fault.report.detected) <= 0) {
    fault.report.detected = as_of;
  }
}

bool FaultTable::make_room_for(const FaultReport& report) {
  if (active_.size() < config_.limits.active_faults) return true;
  const auto least = std::max_element(active_.begin(), active_.end(), [](const auto& a, const auto& b) {
    return is_worse(a.second.report, b.second.report);
  });
  if (least->second.report.severity >= report.severity) return false;
  active_.erase(least);
  ++counters_.evicted_faults;
  return true;
}

void FaultTable::clear(std::map<Key, Fault>::iterator fault, TimePoint word) {
  const Key key = fault->first;
  active_.erase(fault);
  remember_cleared(key, word);
}

void FaultTable::remember_cleared(const Key& key, TimePoint word) {
  if (!cleared_.emplace(key, word).second) return;
  cleared_order_.push_back(key);
  if (cleared_order_.size() <= config_.limits.cleared_faults) return;
  cleared_.erase(cleared_order_.front());
  cleared_order_.pop_front();
}

void FaultTable::clear_absent(const DetectorReport& report) {
  if (!report.active_is_complete) return;
  for (auto it = active_.begin(); it != active_.end();) {
    const auto fault = it++;
    const FaultReport& known = fault->second.report;
    if (known.origin.producer != report.origin.producer || known.origin.session != report.origin.session ||
        known.detector != report.detector || known.latched || report.origin.sent <= fault->second.word) {
      continue;
    }
    const bool listed =
        std::any_of(report.active.begin(), report.active.end(), [&](const FaultReport& active) {
          return active.number == known.number && active.phase != FaultPhase::kClear;
        });
    if (listed) continue;
    ++counters_.cleared_by_status;
    clear(fault, report.origin.sent);
  }
}

void FaultTable::settle_earlier_sessions(const DetectorReport& report) {
  if (!report.active_is_complete) return;
  for (auto it = active_.begin(); it != active_.end();) {
    const auto fault = it++;
    const FaultReport& known = fault->second.report;
    if (known.origin.producer != report.origin.producer || known.origin.session == report.origin.session ||
        known.detector != report.detector) {
      continue;
    }
    const bool found_again =
        std::any_of(report.active.begin(), report.active.end(),
                    [&](const FaultReport& active) { return is_same_finding(active, known); });
    const bool judged_healthy =
        !known.latched && report.state == DetectorState::kMonitoring &&
        std::any_of(report.components.begin(), report.components.end(), [&](const Assessment& assessment) {
          return assessment.judged && assessment.component == known.component;
        });
    if (found_again || judged_healthy) clear(fault, report.origin.sent);
  }
}

std::vector<ActiveFault> FaultTable::list(const ProcessTable& processes,
                                          const DetectorTable& detectors) const {
  std::vector<ActiveFault> list;
  for (const auto& [key, fault] : active_) {
    const Origin& origin = fault.report.origin;
    ActiveFault active{fault.report, processes.absence(origin.producer)};
    const DetectorTable::Detector* detector = detectors.find(origin.producer, fault.report.detector);
    const bool current = processes.is_current(origin.producer, origin.session);
    if (active.unconfirmed.empty() && current && detector != nullptr) active.unconfirmed = detector->silence;
    if (active.unconfirmed.empty() && !current) {
      const bool reported = detector != nullptr && processes.is_current(origin.producer, detector->session);
      active.unconfirmed =
          origin.producer + (reported && fault.report.latched
                                 ? " restarted and does not report it any more, but it is latched"
                                 : " restarted and has not judged it yet");
    }
    list.push_back(std::move(active));
  }
  std::sort(list.begin(), list.end(),
            [](const ActiveFault& a, const ActiveFault& b) { return is_worse(a.report, b.report); });
  return list;
}

}  // namespace airworthy::health
