#pragma once

#include <string>

#include "cli/import/feed.h"

namespace airworthy::importer {

/// Makes SIGINT and SIGTERM stop an import at its next progress report, so that nothing is left behind.
void stop_on_signals();

/// Shows how far an import is as one line on stderr, where that is a terminal and the run is long enough for
/// somebody to wonder; and ends it when the user asks for that.
class ProgressLine {
 public:
  ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  ~ProgressLine();

  /// Reports of the import of `name`, number `index` of `count`.
  [[nodiscard]] Progress of(const std::string& name, std::size_t index, std::size_t count);

  void clear();

 private:
  void show(const std::string& text);

  bool is_terminal_;
  bool shown_ = false;
  std::int64_t next_show_ms_ = 0;
};

}  // namespace airworthy::importer
