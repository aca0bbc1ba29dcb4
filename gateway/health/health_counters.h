#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

namespace airworthy::health {

/// What the health model refused, cut or had to put right. Each only ever grows.
struct HealthCounters {
  std::int64_t messages{};
  std::int64_t ticks{};
  std::int64_t foreign_clock{};
  std::int64_t stale_messages{};   ///< repeated, or overtaken by a newer one of the same kind
  std::int64_t refused_unnamed{};  ///< without a producer
  std::int64_t refused_queue_full{};
  std::int64_t refused_table_full{};  ///< a process, link, detector, component or fault too many
  std::int64_t cut_lists{};
  std::int64_t ticks_out_of_order{};
  std::int64_t tick_gaps{};
  std::int64_t tick_jumps_back{};
  std::int64_t session_conflicts{};  ///< two processes under one name
  std::int64_t raised_by_status{};   ///< a lost raise, healed
  std::int64_t cleared_by_status{};  ///< a lost clear, healed
  std::int64_t evicted_faults{};     ///< dropped for a more severe one

  using Named = std::pair<std::string_view, std::int64_t>;
  [[nodiscard]] std::array<Named, 15> list() const {
    return {{{"messages", messages},
             {"ticks", ticks},
             {"foreign_clock", foreign_clock},
             {"stale_messages", stale_messages},
             {"refused_unnamed", refused_unnamed},
             {"refused_queue_full", refused_queue_full},
             {"refused_table_full", refused_table_full},
             {"cut_lists", cut_lists},
             {"ticks_out_of_order", ticks_out_of_order},
             {"tick_gaps", tick_gaps},
             {"tick_jumps_back", tick_jumps_back},
             {"session_conflicts", session_conflicts},
             {"raised_by_status", raised_by_status},
             {"cleared_by_status", cleared_by_status},
             {"evicted_faults", evicted_faults}}};
  }
};

}  // namespace airworthy::health
