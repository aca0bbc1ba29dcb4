#include "cli/calibrate/flight_name.h"

#include <fmt/format.h>

namespace airworthy::calibrate {

rt::Expected<FlightName> FlightName::parse(const std::string& pattern) {
  FlightName name;
  if (pattern.empty()) return name;
  try {
    name.pattern_.emplace(pattern);
  } catch (const std::regex_error& error) {
    return rt::fail_with(fmt::format("--flight-name \"{}\": {}", pattern, error.what()));
  }
  if (name.pattern_->mark_count() == 0) {
    return rt::fail_with(fmt::format("--flight-name \"{}\": has no group in round brackets", pattern));
  }
  return name;
}

std::string FlightName::of(const std::string& log_name) const {
  std::smatch match;
  return pattern_ && std::regex_search(log_name, match, *pattern_) && match[1].matched ? match[1].str()
                                                                                       : log_name;
}

}  // namespace airworthy::calibrate
