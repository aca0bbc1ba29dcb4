#pragma once

#include <string>

#include "runtime/error.h"

namespace airworthy::rt {

/// The end of a program before it began: exit with this code after printing this text.
struct Exit {
  int code = 0;  ///< of sysexits.h
  std::string text;
};

/// Prints each line of the error on stderr as `process: line` and returns the code, for main to return.
[[nodiscard]] int fail(int code, const Error& error);

/// Prints the text, on stdout if the code is 0, else as fail() does, and returns the code.
[[nodiscard]] int leave(const Exit& exit);

}  // namespace airworthy::rt
