#pragma once

#include <benchmark/benchmark.h>

#include <initializer_list>

namespace airworthy::bench {

template <class Steps>
void time_steps(benchmark::State& state, Steps& steps) {
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(steps.step());
}

/// A benchmark of each method for 4, 6 and 8 rotors; `dispatch` as count_steps() takes it.
template <class Dispatch>
void add_methods(std::initializer_list<const char*> methods, const Dispatch& dispatch) {
  for (const char* method : methods) {
    benchmark::RegisterBenchmark(method,
                                 [method, dispatch](benchmark::State& state) {
                                   dispatch(method, state.range(0),
                                            [&state](auto steps) { time_steps(state, steps); });
                                 })
        ->Arg(4)
        ->Arg(6)
        ->Arg(8);
  }
}

inline int run_benchmarks(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

}  // namespace airworthy::bench
