#pragma once

#include <string>
#include <vector>

#include "cli/eval/scoring.h"

namespace airworthy::eval {

struct Evaluation {
  Rules rules;
  std::vector<Flight> flights;
  std::vector<Score> scores;           ///< by the rules as they stand
  std::vector<Score> tolerant_scores;  ///< beside it: an alarm up to 0.5 s before the onset finds the fault
};

/// One line per flight, totals, and a line per fault type.
[[nodiscard]] std::string to_table(const Evaluation& evaluation);

/// For each flight how many seconds were judged, and by cause how many and which were not, from its start.
[[nodiscard]] std::string to_muted_table(const Evaluation& evaluation);

/// {"flights": [...], "totals": {...}}; what is not known is null.
[[nodiscard]] std::string to_json(const Evaluation& evaluation);

/// For each flight of which nothing was judged a line that says why; empty if there is none.
[[nodiscard]] std::string not_judged_lines(const Evaluation& evaluation);

}  // namespace airworthy::eval
