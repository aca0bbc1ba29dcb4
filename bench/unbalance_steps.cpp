// Counts instructions of one step: see bench/count_steps.h. Usage: unbalance_steps METHOD ROTORS STEPS
#include "bench/unbalance_steps.h"

#include "bench/count_steps.h"

int main(int argc, char** argv) {
  return airworthy::bench::count_steps(argc, argv, "unbalance_steps",
                                       [](const char* method, std::int64_t size, const auto& run) {
                                         return airworthy::bench::with_steps(method, size, run);
                                       });
}
