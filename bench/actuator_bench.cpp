// One step of the actuator fault observer beside the augmented Kalman filter of the same system in the same run: dense as
// a textbook prints it, symmetric, and with the known zeros and ones of its matrices left out.
#include <benchmark/benchmark.h>

#include <string>

#include "bench/actuator_steps.h"
#include "bench/time_steps.h"

namespace airworthy::bench {
namespace {

template <int kStates, int kInputs, int kOutputs>
void add_size() {
  const std::string size =
      "/" + std::to_string(kStates) + "x" + std::to_string(kInputs) + "x" + std::to_string(kOutputs);
  for (const char* method :
       {"multi_stage", "textbook_augmented", "symmetric_augmented", "blockwise_augmented"}) {
    benchmark::RegisterBenchmark((method + size).c_str(), [method](benchmark::State& state) {
      with_steps_of_size<kStates, kInputs, kOutputs>(method,
                                                     [&state](auto steps) { time_steps(state, steps); });
    });
  }
}

}  // namespace
}  // namespace airworthy::bench

int main(int argc, char** argv) {
  using namespace airworthy::bench;
  add_methods({"monitor_sample"}, with_steps);
  add_size<2, 1, 1>();
  add_size<4, 4, 4>();
  add_size<8, 4, 4>();
  add_size<8, 6, 4>();
  add_size<8, 8, 4>();
  return run_benchmarks(argc, argv);
}
