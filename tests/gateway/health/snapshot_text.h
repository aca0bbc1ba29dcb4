#pragma once

#include <sstream>
#include <string>

#include "gateway/health/health_snapshot.h"

namespace airworthy::health {

/// Every field of a snapshot, so that two can be compared and a difference be read.
inline std::string text_of(const HealthSnapshot& snapshot) {
  std::ostringstream out;
  out << to_us(snapshot.time) << ' ' << snapshot.vehicle << ' ' << static_cast<int>(snapshot.status) << " ["
      << snapshot.root_cause << "] [" << snapshot.advice << "] changed=" << snapshot.changed << '\n';
  for (const ComponentHealth& c : snapshot.components) {
    out << "  component " << c.component << ' ' << static_cast<int>(c.status) << ' ' << to_us(c.since) << ' '
        << c.advice;
    for (const std::string& reason : c.reasons) out << " | " << reason;
    out << '\n';
  }
  for (const ProcessHealth& p : snapshot.processes) {
    out << "  process " << p.process << ' ' << p.expected << ' ' << static_cast<int>(p.status) << ' '
        << to_us(p.since) << ' ' << (p.last_seen ? to_us(*p.last_seen) : -1) << ' ' << p.session.value_or(-1)
        << ' ' << p.restarts << ' ' << p.detail << '\n';
  }
  for (const LinkHealth& l : snapshot.links) {
    out << "  link " << l.driver << ' ' << l.link << ' ' << static_cast<int>(l.status) << ' '
        << to_us(l.since) << ' ' << l.detail << '\n';
  }
  for (const ActiveFault& f : snapshot.faults) {
    const FaultReport& r = f.report;
    out << "  fault " << r.origin.producer << ' ' << r.origin.session << ' ' << r.origin.seq << ' '
        << r.number << ' ' << static_cast<int>(r.phase) << ' ' << r.component << ' '
        << static_cast<int>(r.severity) << ' ' << r.latched << ' ' << r.magnitude << ' ' << to_us(r.onset)
        << ' ' << to_us(r.detected) << " [" << f.unconfirmed << "]\n";
  }
  return out.str();
}

}  // namespace airworthy::health
