#pragma once

#include <map>
#include <string>
#include <vector>

#include "cli/watch/health_view.h"

namespace airworthy::watch {

/// Turns a stream of health into one line per change, for logs and pipes. The first health gives a line for
/// everything there is.
class ChangeLines {
 public:
  [[nodiscard]] std::vector<std::string> add(const HealthView& view);

 private:
  struct Line {
    std::string state;  ///< another one is a change
    std::string text;
  };
  std::string vehicle_;
  std::map<std::string, Line> known_;  ///< by subject
};

/// The line of an event.
[[nodiscard]] std::string event_line(const FaultView& event);

}  // namespace airworthy::watch
