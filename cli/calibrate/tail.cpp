#include "cli/calibrate/tail.h"

#include <algorithm>
#include <cmath>

namespace airworthy::calibrate {

Tail fit_tail(std::vector<double> block_maxima) {
  Tail tail;
  tail.blocks = static_cast<int>(block_maxima.size());
  if (tail.blocks < Tail::kFewestBlocks) return tail;
  std::sort(block_maxima.begin(), block_maxima.end());
  const auto below =
      static_cast<std::size_t>(std::floor((1.0 - Tail::kShareAbove) * static_cast<double>(tail.blocks)));
  tail.start = block_maxima[below - 1];
  double excess = 0;
  for (std::size_t i = below; i < block_maxima.size(); ++i) excess += block_maxima[i] - tail.start;
  tail.scale = excess / static_cast<double>(block_maxima.size() - below);
  return tail;
}

double Tail::threshold(double false_alarms_per_hour) const {
  const double blocks_per_hour = 3600.0 / kBlock_s;
  return start + scale * std::log(kShareAbove * blocks_per_hour / false_alarms_per_hour);
}

}  // namespace airworthy::calibrate
