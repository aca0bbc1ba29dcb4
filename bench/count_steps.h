#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace airworthy::bench {

/// A program that takes a number of steps of one method and prints their sum: for counting instructions with
/// `valgrind --tool=callgrind`, as the difference between two numbers of steps.
/// `dispatch(method, size, run)` calls run(steps) and says whether it knows the method at that size.
template <class Dispatch>
int count_steps(int argc, char** argv, const char* program, const Dispatch& dispatch) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: %s METHOD SIZE STEPS\n", program);
    return 2;
  }
  const std::int64_t size = std::strtoll(argv[2], nullptr, 10);
  const std::int64_t count = std::strtoll(argv[3], nullptr, 10);
  const bool is_known = dispatch(argv[1], size, [count](auto steps) {
    double last = 0.0;
    for (std::int64_t k = 0; k < count; ++k) last += static_cast<double>(steps.step());
    std::printf("%g\n", last);
  });
  if (!is_known) std::fprintf(stderr, "%s: no method %s for %s\n", program, argv[1], argv[2]);
  return is_known ? 0 : 2;
}

}  // namespace airworthy::bench
