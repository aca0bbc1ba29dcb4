#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace airworthy::calibrate {

/// Of at least one value, in any order: the one in the middle, of an even number the mean of the two.
[[nodiscard]] inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 != 0) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

}  // namespace airworthy::calibrate
