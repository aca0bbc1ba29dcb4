// Takes a number of steps of one method and prints the last result: for counting instructions with
// `valgrind --tool=callgrind`, as the difference between two numbers of steps.
// Usage: unbalance_steps METHOD ROTORS STEPS
#include "bench/unbalance_steps.h"

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fputs("usage: unbalance_steps METHOD ROTORS STEPS\n", stderr);
    return 2;
  }
  const std::int64_t rotors = std::strtoll(argv[2], nullptr, 10);
  const std::int64_t count = std::strtoll(argv[3], nullptr, 10);
  const bool is_known = airworthy::bench::with_steps(argv[1], rotors, [count](auto steps) {
    double last = 0.0;
    for (std::int64_t k = 0; k < count; ++k) last += static_cast<double>(steps.step());
    std::printf("%g\n", last);
  });
  if (!is_known) std::fprintf(stderr, "unbalance_steps: no method %s for %s rotors\n", argv[1], argv[2]);
  return is_known ? 0 : 2;
}
