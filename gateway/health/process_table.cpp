#include "gateway/health/process_table.h"

#include <algorithm>

namespace airworthy::health {
namespace {

constexpr Duration kConflictShown{2'000'000};

}  // namespace

ProcessTable::ProcessTable(const HealthConfig& config, HealthCounters& counters)
    : config_{config}, counters_{counters} {
  for (const std::string& name : config.expected_processes) processes_[name].expected = true;
}

void ProcessTable::start(TimePoint as_of) {
  start_ = as_of;
  for (auto& [name, process] : processes_) process.since = as_of;
}

ProcessTable::Process* ProcessTable::find_or_add(const std::string& name) {
  if (const auto found = processes_.find(name); found != processes_.end()) return &found->second;
  if (processes_.size() >= config_.limits.processes) {
    // One that is gone and that nobody expects makes room.
    auto oldest = processes_.end();
    for (auto it = processes_.begin(); it != processes_.end(); ++it) {
      const Process& process = it->second;
      const bool gone =
          process.status == ProcessStatus::kMissing || process.status == ProcessStatus::kStopped;
      if (process.expected || !gone) continue;
      if (oldest == processes_.end() || process.last_seen < oldest->second.last_seen) oldest = it;
    }
    if (oldest == processes_.end()) return nullptr;
    processes_.erase(oldest);
  }
  return &processes_[name];
}

Relation ProcessTable::note(const Origin& origin, bool foreign_clock, TimePoint as_of) {
  Process* process = find_or_add(origin.producer);
  if (process == nullptr) {
    ++counters_.refused_table_full;
    return Relation::kRefused;
  }
  if (process->session == origin.session) {
    process->newest_sent = std::max(process->newest_sent, origin.sent);
    process->foreign_clock = foreign_clock;
    return Relation::kCurrent;
  }
  const bool comparable = !foreign_clock && !process->foreign_clock;
  if (process->session && comparable && origin.sent <= process->newest_sent) return Relation::kLate;

  if (process->session) {
    auto& earlier = process->earlier_sessions;
    if (std::find(earlier.begin(), earlier.end(), std::optional{origin.session}) != earlier.end()) {
      ++counters_.session_conflicts;
      process->conflict = as_of;
    } else {
      ++process->restarts;
    }
    earlier[process->next_earlier] = process->session;
    process->next_earlier = (process->next_earlier + 1) % earlier.size();
  }
  process->session = origin.session;
  process->newest_sent = origin.sent;
  process->foreign_clock = foreign_clock;
  process->sign.reset();
  return Relation::kNewSession;
}

void ProcessTable::apply(const ProcessSign& sign, Relation relation, bool foreign_clock, TimePoint as_of) {
  if (relation == Relation::kRefused) return;
  Process& process = processes_.at(sign.origin.producer);
  const Stamp stamp = stamp_of(sign.origin);
  if (relation == Relation::kLate || (process.sign && !(*process.sign < stamp))) {
    ++counters_.stale_messages;
    return;
  }
  process.sign = stamp;
  process.last_seen = foreign_clock ? as_of : sign.origin.sent;
  process.state = sign.state;
  process.detail = sign.detail;
}

ProcessStatus ProcessTable::judged(const Process& process, TimePoint as_of, TimePoint grace_from) const {
  if (!process.last_seen) return ProcessStatus::kNeverSeen;
  if (process.state == ProcessState::kStopping) return ProcessStatus::kStopped;
  if (as_of - std::max(*process.last_seen, grace_from) > config_.process_deadline)
    return ProcessStatus::kMissing;
  if (process.state == ProcessState::kDegraded) return ProcessStatus::kDegraded;
  if (process.conflict && as_of - *process.conflict <= kConflictShown) return ProcessStatus::kDegraded;
  return ProcessStatus::kRunning;
}

std::string ProcessTable::detail_of(const Process& process, TimePoint as_of) const {
  switch (process.status) {
    case ProcessStatus::kNeverSeen:
      return grace_is_over(as_of) ? "expected, but never seen" : "not seen yet";
    case ProcessStatus::kMissing:
      return "no life sign";
    case ProcessStatus::kStopped:
      return process.detail.empty() ? "was stopped" : process.detail;
    case ProcessStatus::kRunning:
      if (process.state == ProcessState::kStarting && process.detail.empty()) return "starting";
      return process.detail;
    case ProcessStatus::kDegraded:
      return process.state == ProcessState::kDegraded ? process.detail : "two processes run under this name";
  }
  return process.detail;
}

void ProcessTable::judge(TimePoint as_of, TimePoint grace_from) {
  for (auto& [name, process] : processes_) {
    const ProcessStatus status = judged(process, as_of, grace_from);
    if (status != process.status) {
      process.since = status == ProcessStatus::kMissing ? *process.last_seen : as_of;
      process.status = status;
    }
    process.judged_detail = detail_of(process, as_of);
  }
}

void ProcessTable::rebase(TimePoint as_of) {
  start_ = std::min(start_, as_of);
  for (auto& [name, process] : processes_) {
    if (process.last_seen) process.last_seen = std::min(*process.last_seen, as_of);
    if (process.conflict) process.conflict = std::min(*process.conflict, as_of);
    process.since = std::min(process.since, as_of);
    process.foreign_clock = true;  // its sending times no longer compare with what comes
  }
}

bool ProcessTable::is_current(const std::string& producer, std::int64_t session) const {
  const auto found = processes_.find(producer);
  return found != processes_.end() && found->second.session == session;
}

std::string ProcessTable::absence(const std::string& producer) const {
  const auto found = processes_.find(producer);
  if (found == processes_.end()) return producer + " is gone";
  if (found->second.status == ProcessStatus::kMissing) return producer + " is missing";
  if (found->second.status == ProcessStatus::kStopped) return producer + " was stopped";
  return {};
}

std::vector<ProcessHealth> ProcessTable::list() const {
  std::vector<ProcessHealth> list;
  for (const auto& [name, process] : processes_) {
    if (!process.expected && !process.last_seen) continue;  // spoke, but is no process of ours
    list.push_back({name, process.expected, process.status, process.since, process.last_seen, process.session,
                    process.restarts, process.judged_detail});
  }
  return list;
}

}  // namespace airworthy::health
