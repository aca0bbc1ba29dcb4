#include "cli/watch/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace airworthy::watch {
namespace {

void write_out(std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), stdout);
  std::fflush(stdout);
}

}  // namespace

// Alternate screen, so that the shell's history is as before; cursor hidden while we draw.
Terminal::Terminal() { write_out("\x1b[?1049h\x1b[?25l"); }
Terminal::~Terminal() { write_out("\x1b[?25h\x1b[?1049l"); }

bool Terminal::is_there() {
  const char* kind = std::getenv("TERM");
  return isatty(STDOUT_FILENO) != 0 && kind != nullptr && std::string_view{kind} != "dumb";
}

Terminal::Size Terminal::size() {
  winsize window{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) != 0 || window.ws_col == 0 || window.ws_row == 0) return {};
  return {window.ws_col, window.ws_row};
}

void Terminal::draw(const std::vector<std::string>& lines) {
  std::string out{"\x1b[H"};
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (i > 0) out += "\r\n";
    out += lines[i] + "\x1b[K";
  }
  out += "\x1b[J";
  write_out(out);
}

}  // namespace airworthy::watch
