// One step of the actuator fault observer beside the augmented Kalman filter of the same system in the same run: dense as
// a textbook prints it, symmetric, and with the known zeros and ones of its matrices left out.
#include <benchmark/benchmark.h>

#include <cmath>
#include <span>
#include <string>

#include "core/detectors/actuator/actuator_monitor.h"
#include "core/estimators/actuator/multi_stage_observer.h"
#include "tests/support/hovering_multirotor.h"
#include "tests/support/reference/augmented_fault_filter.h"
#include "tests/support/reference/thrifty_fault_filter.h"

namespace airworthy {
namespace {

template <int kStates, int kInputs, int kOutputs>
struct System {
  using Observer = MultiStageObserver<double, kStates, kInputs, kOutputs>;

  System() {
    for (int i = 0; i < kStates; ++i) {
      for (int j = 0; j < kStates; ++j) model.a(i, j) = (i == j ? 0.9 : 0.02 * std::sin(3.0 * i + j));
      for (int j = 0; j < kInputs; ++j) model.b(i, j) = std::sin(1.0 + i + 2.0 * j);
      model.noise(i, i) = 0.01;
    }
    for (int j = 0; j < kInputs; ++j) {
      model.u(j) = 1.0 + 0.1 * j;
      model.fault_noise_variance(j) = 1e-4;
    }
    for (int i = 0; i < kOutputs; ++i) {
      for (int j = 0; j < kStates; ++j) measurement.c(i, j) = std::cos(2.0 * i + j);
      measurement.y(i) = 0.1 * i;
    }
  }

  typename Observer::Transition model;
  typename Observer::Measurement measurement;
};

template <int kStates, int kInputs, int kOutputs>
void multi_stage(benchmark::State& state) {
  const System<kStates, kInputs, kOutputs> system;
  MultiStageObserver<double, kStates, kInputs, kOutputs> observer{{}};
  typename MultiStageObserver<double, kStates, kInputs, kOutputs>::Innovation innovation;
  for (auto _ : state) benchmark::DoNotOptimize(observer.step(system.model, system.measurement, innovation));
}

template <class Filter, int kStates, int kInputs, int kOutputs>
void augmented(benchmark::State& state) {
  const System<kStates, kInputs, kOutputs> system;
  Filter filter{typename MultiStageObserver<double, kStates, kInputs, kOutputs>::Prior{}};
  for (auto _ : state) {
    filter.predict(system.model);
    filter.correct(system.measurement);
    benchmark::DoNotOptimize(filter.nis());
  }
}

template <int kStates, int kInputs, int kOutputs>
void add_size() {
  const std::string size =
      "/" + std::to_string(kStates) + "x" + std::to_string(kInputs) + "x" + std::to_string(kOutputs);
  const auto add = [&](const char* name, auto run) {
    benchmark::RegisterBenchmark((name + size).c_str(), run);
  };
  add("multi_stage", multi_stage<kStates, kInputs, kOutputs>);
  add("textbook_augmented", augmented<reference::AugmentedFaultFilter<double>, kStates, kInputs, kOutputs>);
  add("symmetric_augmented",
      augmented<reference::ThriftyFaultFilter<double, kStates, kInputs, kOutputs, false>, kStates, kInputs,
                kOutputs>);
  add("blockwise_augmented",
      augmented<reference::ThriftyFaultFilter<double, kStates, kInputs, kOutputs, true>, kStates, kInputs,
                kOutputs>);
}

// All of what one inertial sample costs: observers of rotors and axes, and the verdicts.
void monitor_sample(benchmark::State& state) {
  const auto rotors = static_cast<std::size_t>(state.range(0));
  test::HoveringMultirotor body{rotors, 1};
  actuator::ActuatorMonitorParams params;
  params.vehicle = body.vehicle;
  actuator::ActuatorMonitor monitor{params};
  for (auto _ : state) {
    body.step();
    const TimePoint now = TimePoint{} + from_seconds(body.time_s);
    monitor.on_rotor_commands(now, std::span{body.command_ratio}.first(rotors));
    benchmark::DoNotOptimize(monitor.on_imu({now, body.accel_m_s2, body.gyro_rad_s}, Phase::kInFlight));
  }
}
BENCHMARK(monitor_sample)->Arg(4)->Arg(6)->Arg(8);

}  // namespace
}  // namespace airworthy

int main(int argc, char** argv) {
  airworthy::add_size<2, 1, 1>();
  airworthy::add_size<4, 4, 4>();
  airworthy::add_size<8, 4, 4>();
  airworthy::add_size<8, 6, 4>();
  airworthy::add_size<8, 8, 4>();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
