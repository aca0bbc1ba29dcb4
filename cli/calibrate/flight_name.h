#pragma once

#include <optional>
#include <regex>
#include <string>

#include "runtime/error.h"

namespace airworthy::calibrate {

/// Says of which flight a log is a part, so that parts of one flight are never taken for independent ones.
class FlightName {
 public:
  /// `pattern` is an ECMAScript regular expression with a group; empty: every log is a flight of its own.
  [[nodiscard]] static rt::Expected<FlightName> parse(const std::string& pattern);

  /// What the first group matches in the log's name; the whole name where the expression does not match.
  [[nodiscard]] std::string of(const std::string& log_name) const;

 private:
  std::optional<std::regex> pattern_;
};

}  // namespace airworthy::calibrate
