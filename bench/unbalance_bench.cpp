// One step of the unbalance estimators for 4, 6 and 8 rotors, beside the same filter as a textbook writes it (matrices of
// run-time size, every product in full) and as a programmer writes it for one size of arrays, in the same run.
#include <benchmark/benchmark.h>

#include "bench/time_steps.h"
#include "bench/unbalance_steps.h"

namespace airworthy::bench {
namespace {

// What a report costs on top, at its own rate.
void signal_power_report(benchmark::State& state) {
  SignalPowerSteps<double, 8> steps;
  for (std::size_t k = 0; k < kSamples; ++k) static_cast<void>(steps.step());
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(steps.ekf.isolation());
  }
}

}  // namespace
}  // namespace airworthy::bench

int main(int argc, char** argv) {
  using namespace airworthy::bench;
  add_methods({"signal_power_double", "signal_power_float", "rotor_bands_double", "rotor_bands_float",
               "textbook_signal_power", "signal_power_by_hand"},
              with_steps);
  benchmark::RegisterBenchmark("signal_power_report", signal_power_report);
  return run_benchmarks(argc, argv);
}
