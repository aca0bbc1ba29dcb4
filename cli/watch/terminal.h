#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace airworthy::watch {

/// Standard output as a terminal that is redrawn in place. Restores it at the end.
class Terminal {
 public:
  struct Size {
    std::size_t columns = 80;
    std::size_t rows = 24;
  };

  Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  ~Terminal();

  /// Is standard output a terminal that understands more than plain text?
  [[nodiscard]] static bool is_there();
  [[nodiscard]] static Size size();
  void draw(const std::vector<std::string>& lines);
};

}  // namespace airworthy::watch
