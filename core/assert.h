#pragma once

namespace airworthy {

/// Ends the program: on Linux by abort, so that the service manager restarts it and a core file tells the
/// rest.
[[noreturn]] void assertion_failed(const char* condition, const char* file, int line) noexcept;

}  // namespace airworthy

/// A broken invariant is a bug of ours, never bad input; always armed.
#define AW_ASSERT(condition) \
  (static_cast<bool>(condition) ? void(0) : ::airworthy::assertion_failed(#condition, __FILE__, __LINE__))
