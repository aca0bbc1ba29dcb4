#include "gateway/health/link_table.h"

#include <algorithm>
#include <cmath>

namespace airworthy::health {

void LinkTable::apply(const LinkReport& report, Relation relation, bool foreign_clock, TimePoint as_of) {
  if (relation == Relation::kRefused) return;
  if (relation == Relation::kLate) {
    ++counters_.stale_messages;
    return;
  }
  const std::pair key{report.origin.producer, report.link};
  const Stamp stamp = stamp_of(report.origin);
  auto found = links_.find(key);
  if (found == links_.end()) {
    if (links_.size() >= config_.limits.links) {
      ++counters_.refused_table_full;
      return;
    }
    found = links_.emplace(key, Link{}).first;
    found->second.since = as_of;
  } else if (found->second.session == report.origin.session && !(found->second.stamp < stamp)) {
    ++counters_.stale_messages;
    return;
  }
  Link& link = found->second;
  const TimePoint heard = foreign_clock ? as_of : report.origin.sent;
  if (report.connected && (!link.connected || link.session != report.origin.session))
    link.connected_since = heard;
  link.session = report.origin.session;
  link.stamp = stamp;
  link.heard = heard;
  link.connected = report.connected;
  link.detail = report.detail;
  link.seconds_since_data = report.seconds_since_data;
  link.rates = report.rates;
}

void LinkTable::judge_one(const std::string& driver, Link& link, TimePoint as_of, TimePoint grace_from,
                          const ProcessTable& processes) const {
  LinkStatus status = LinkStatus::kOk;
  TimePoint since = as_of;
  link.judged_detail = link.detail;
  const double silence_s = to_seconds(config_.link_silence);
  if (const std::string absence = processes.absence(driver); !absence.empty()) {
    status = LinkStatus::kUnknown;
    link.judged_detail = absence;
  } else if (as_of - std::max(link.heard, grace_from) > config_.link_deadline) {
    status = LinkStatus::kUnknown;
    link.judged_detail = driver + " does not report this link any more";
  } else if (!link.connected) {
    status = LinkStatus::kDown;
    since = link.heard;
  } else if (std::isnan(link.seconds_since_data)) {
    const bool long_enough = as_of - std::max(link.connected_since, grace_from) > config_.link_silence;
    status = long_enough ? LinkStatus::kSilent : LinkStatus::kUnknown;
    since = link.connected_since;
    link.judged_detail = "open, but nothing was ever received";
  } else if (link.seconds_since_data > silence_s) {
    status = LinkStatus::kSilent;
    since = link.heard - from_seconds(link.seconds_since_data);
    link.judged_detail = "open, but nothing is received any more";
  }
  if (status != link.status) {
    link.status = status;
    link.since = since;
  }
}

void LinkTable::judge(TimePoint as_of, TimePoint grace_from, const ProcessTable& processes) {
  for (auto& [key, link] : links_) judge_one(key.first, link, as_of, grace_from, processes);
}

void LinkTable::rebase(TimePoint as_of) {
  for (auto& [key, link] : links_) {
    link.heard = std::min(link.heard, as_of);
    link.connected_since = std::min(link.connected_since, as_of);
    link.since = std::min(link.since, as_of);
  }
}

std::vector<LinkHealth> LinkTable::list() const {
  std::vector<LinkHealth> list;
  for (const auto& [key, link] : links_) {
    list.push_back({key.first, key.second, link.status, link.since, link.judged_detail, link.rates});
  }
  return list;
}

}  // namespace airworthy::health
