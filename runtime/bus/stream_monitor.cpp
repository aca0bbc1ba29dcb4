#include "runtime/bus/stream_monitor.h"

namespace airworthy::rt {

Arrival StreamMonitor::judge(const Header& header) {
  if (header.seq < 0 || header.session < 0 || to_us(header.time) < 0 || to_us(header.sent) < 0) {
    return Arrival::kBadHeader;
  }
  const Arrival arrival = compare(header);
  count_gap(header, arrival);
  if (arrival == Arrival::kAccepted) {
    accept(header);
    return arrival;
  }
  if (arrival != Arrival::kDuplicate && ++rejected_in_a_row_ >= kResynchronise) {
    ++resynchronised_;
    highest_seq_ = header.seq;
    accept(header);
    return Arrival::kAccepted;
  }
  return arrival;
}

Arrival StreamMonitor::compare(const Header& header) const {
  if (accepted_ == 0) return Arrival::kAccepted;
  if (header.session != last_.session) {
    return header.sent < last_.sent ? Arrival::kOutOfOrder : Arrival::kAccepted;
  }
  if (header.seq == last_.seq) return Arrival::kDuplicate;
  if (header.seq < last_.seq) return Arrival::kOutOfOrder;
  if (header.time < last_.time) return Arrival::kTimeBackward;
  if ((header.time - last_.time) - (header.sent - last_.sent) > kLeap) return Arrival::kAheadOfStream;
  return Arrival::kAccepted;
}

// A message that arrived but was refused is counted by its cause, so gaps are measured against what arrived.
void StreamMonitor::count_gap(const Header& header, Arrival arrival) {
  if (accepted_ == 0) {
    highest_seq_ = header.seq;
  } else if (header.session != last_.session) {
    if (arrival != Arrival::kAccepted) return;
    lost_ += header.seq;
    highest_seq_ = header.seq;
  } else if (header.seq > highest_seq_) {
    lost_ += header.seq - highest_seq_ - 1;
    highest_seq_ = header.seq;
  }
}

void StreamMonitor::accept(const Header& header) {
  if (accepted_ > 0 && header.session != last_.session) ++restarts_;
  rejected_in_a_row_ = 0;
  last_ = header;
  ++accepted_;
}

const char* to_string(Arrival arrival) {
  switch (arrival) {
    case Arrival::kAccepted:
      return "accepted";
    case Arrival::kDuplicate:
      return "duplicate";
    case Arrival::kOutOfOrder:
      return "out_of_order";
    case Arrival::kTimeBackward:
      return "time_backward";
    case Arrival::kAheadOfStream:
      return "ahead_of_stream";
    case Arrival::kBadHeader:
      return "bad_header";
  }
  return "unknown";
}

}  // namespace airworthy::rt
