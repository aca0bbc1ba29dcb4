// One step of the filter of effectiveness for 4, 6 and 8 rotors, beside the same filter as a textbook writes it (matrices of
// run-time size) and in plain loops of fixed size; and one inertial sample of the whole detector.
#include <benchmark/benchmark.h>

#include "bench/effectiveness_steps.h"

namespace airworthy::bench {
namespace {

void time_steps(benchmark::State& state, const char* method) {
  with_steps(method, state.range(0), [&state](auto steps) {
    for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(steps.step());
  });
}

void filter_double(benchmark::State& state) { time_steps(state, "filter_double"); }
void filter_float(benchmark::State& state) { time_steps(state, "filter_float"); }
void textbook_filter(benchmark::State& state) { time_steps(state, "textbook_filter"); }
void by_hand_filter(benchmark::State& state) { time_steps(state, "by_hand_filter"); }
void detector_sample(benchmark::State& state) { time_steps(state, "detector_sample"); }
BENCHMARK(filter_double)->Arg(4)->Arg(6)->Arg(8);
BENCHMARK(filter_float)->Arg(4)->Arg(6)->Arg(8);
BENCHMARK(textbook_filter)->Arg(4)->Arg(6)->Arg(8);
BENCHMARK(by_hand_filter)->Arg(4)->Arg(6)->Arg(8);
BENCHMARK(detector_sample)->Arg(4)->Arg(6)->Arg(8);

}  // namespace
}  // namespace airworthy::bench

BENCHMARK_MAIN();
