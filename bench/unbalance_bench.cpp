// One step of the unbalance estimators for 4, 6 and 8 rotors, beside the same filter as a textbook writes it (matrices of
// run-time size, every product in full) and as a programmer writes it for one size of arrays, in the same run.
#include <benchmark/benchmark.h>

#include "bench/unbalance_steps.h"

namespace airworthy::bench {
namespace {

void time_steps(benchmark::State& state, const char* method) {
  with_steps(method, state.range(0), [&state](auto steps) {
    for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(steps.step());
  });
}

void signal_power_double(benchmark::State& state) { time_steps(state, "signal_power_double"); }
void signal_power_float(benchmark::State& state) { time_steps(state, "signal_power_float"); }
void rotor_bands_double(benchmark::State& state) { time_steps(state, "rotor_bands_double"); }
void rotor_bands_float(benchmark::State& state) { time_steps(state, "rotor_bands_float"); }
void textbook_signal_power(benchmark::State& state) { time_steps(state, "textbook_signal_power"); }
void signal_power_by_hand(benchmark::State& state) { time_steps(state, "signal_power_by_hand"); }
BENCHMARK(signal_power_double)->Arg(4)->Arg(6)->Arg(8);
BENCHMARK(signal_power_float)->Arg(4)->Arg(6)->Arg(8);
BENCHMARK(rotor_bands_double)->Arg(4)->Arg(6)->Arg(8);
BENCHMARK(rotor_bands_float)->Arg(4)->Arg(6)->Arg(8);
BENCHMARK(textbook_signal_power)->Arg(4)->Arg(6)->Arg(8);
BENCHMARK(signal_power_by_hand)->Arg(4)->Arg(6)->Arg(8);

// What a report costs on top, at its own rate.
void signal_power_report(benchmark::State& state) {
  SignalPowerSteps<double, 8> steps;
  for (std::size_t k = 0; k < kSamples; ++k) static_cast<void>(steps.step());
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(steps.ekf.isolation());
  }
}
BENCHMARK(signal_power_report);

}  // namespace
}  // namespace airworthy::bench

BENCHMARK_MAIN();
