#pragma once

#include <cstdint>
#include <tuple>

#include "gateway/health/health_input.h"

namespace airworthy::health {

/// Place of a message among those of the same kind, producer and session.
struct Stamp {
  TimePoint sent{};
  std::int64_t seq{};

  friend bool operator<(const Stamp& a, const Stamp& b) {
    return std::tie(a.sent, a.seq) < std::tie(b.sent, b.seq);
  }
};

inline Stamp stamp_of(const Origin& origin) { return {origin.sent, origin.seq}; }

}  // namespace airworthy::health
