#include "runtime/process/exit.h"

#include <algorithm>
#include <cerrno>  // program_invocation_short_name, of glibc
#include <cstdio>
#include <string_view>

namespace airworthy::rt {

int fail(int code, const Error& error) {
  std::string output;
  std::string_view rest{error.text};
  do {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    output += program_invocation_short_name;
    output += ": ";
    output += rest.substr(0, end);
    output += '\n';
    rest.remove_prefix(std::min(end + 1, rest.size()));
  } while (!rest.empty());
  std::fputs(output.c_str(), stderr);
  return code;
}

int leave(const Exit& exit) {
  if (exit.code != 0) return fail(exit.code, Error{exit.text});
  std::fputs(exit.text.c_str(), stdout);
  std::fputc('\n', stdout);
  return exit.code;
}

}  // namespace airworthy::rt
