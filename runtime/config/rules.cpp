#include "runtime/config/rules.h"

#include <fmt/format.h>

#include <cmath>

namespace airworthy::rt {

bool Range::contains(double value) const {
  if (!std::isfinite(value)) return not_finite_allowed_;
  const bool above_min = min_excluded_ ? value > min_ : value >= min_;
  const bool below_max = max_excluded_ ? value < max_ : value <= max_;
  return above_min && below_max;
}

std::string Range::requirement(double value) const {
  if (!std::isfinite(value)) return "must be finite";
  const bool bounded_below = std::isfinite(min_);
  const bool bounded_above = std::isfinite(max_);
  if (bounded_below && bounded_above) {
    return fmt::format("must lie in {}{}, {}{}", min_excluded_ ? '(' : '[', min_, max_,
                       max_excluded_ ? ')' : ']');
  }
  if (bounded_below) return fmt::format("must be {} {}", min_excluded_ ? "greater than" : "at least", min_);
  return fmt::format("must be {} {}", max_excluded_ ? "less than" : "at most", max_);
}

std::string Count::requirement() const {
  const auto plural = [](std::size_t n) { return n == 1 ? "" : "s"; };
  if (min == max) return fmt::format("must have {} element{}", min, plural(min));
  if (max == kAnyNumber) return fmt::format("must have at least {} element{}", min, plural(min));
  if (min == 0) return fmt::format("must have at most {} element{}", max, plural(max));
  return fmt::format("must have {} to {} elements", min, max);
}

}  // namespace airworthy::rt
