#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <string_view>

#include "bench/methods.h"
#include "core/detectors/actuator/actuator_monitor.h"
#include "core/estimators/actuator/multi_stage_observer.h"
#include "tests/support/hovering_multirotor.h"
#include "tests/support/reference/augmented_fault_filter.h"
#include "tests/support/reference/thrifty_fault_filter.h"

namespace airworthy::bench {

/// A system of any size, always the same.
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

/// The observer as it flies.
template <int kStates, int kInputs, int kOutputs>
struct MultiStageSteps {
  using Observer = MultiStageObserver<double, kStates, kInputs, kOutputs>;

  System<kStates, kInputs, kOutputs> system;
  Observer observer{typename Observer::Prior{}};
  typename Observer::Innovation innovation;

  double step() {
    static_cast<void>(observer.step(system.model, system.measurement, innovation));
    return innovation.nis;
  }
};

/// The augmented Kalman filter of the same system, as `Filter` writes it.
template <class Filter, int kStates, int kInputs, int kOutputs>
struct AugmentedSteps {
  System<kStates, kInputs, kOutputs> system;
  Filter filter{typename MultiStageObserver<double, kStates, kInputs, kOutputs>::Prior{}};

  double step() {
    filter.predict(system.model);
    filter.correct(system.measurement);
    return filter.nis();
  }
};

/// Calls run(steps) for a method and one size; false if there is none of that name.
template <int kStates, int kInputs, int kOutputs, class Run>
bool with_steps_of_size(std::string_view method, const Run& run) {
  using Symmetric = reference::ThriftyFaultFilter<double, kStates, kInputs, kOutputs, false>;
  using Blockwise = reference::ThriftyFaultFilter<double, kStates, kInputs, kOutputs, true>;
  using Textbook = reference::AugmentedFaultFilter<double>;
  return run_method(method, run, Method<MultiStageSteps<kStates, kInputs, kOutputs>>{"multi_stage"},
                    Method<AugmentedSteps<Textbook, kStates, kInputs, kOutputs>>{"textbook_augmented"},
                    Method<AugmentedSteps<Symmetric, kStates, kInputs, kOutputs>>{"symmetric_augmented"},
                    Method<AugmentedSteps<Blockwise, kStates, kInputs, kOutputs>>{"blockwise_augmented"});
}

/// One inertial sample of the whole detector: observers of rotors and axes, and the verdicts.
template <std::size_t N>
struct MonitorSteps {
  static actuator::ActuatorMonitorParams params(const Multirotor& vehicle) {
    actuator::ActuatorMonitorParams result;
    result.vehicle = vehicle;
    return result;
  }

  test::HoveringMultirotor body{N, 1};
  actuator::ActuatorMonitor monitor{params(body.vehicle)};

  double step() {
    body.step();
    const TimePoint now = TimePoint{} + from_seconds(body.time_s);
    monitor.on_rotor_commands(now, std::span{body.command_ratio}.template first<N>());
    static_cast<void>(monitor.on_imu({now, body.accel_m_s2, body.gyro_rad_s}, Phase::kInFlight));
    return monitor.nis();
  }
};

/// Calls run(steps) for a method and a number of rotors, with eight states and four outputs; false if there are none.
constexpr auto with_steps = [](std::string_view method, std::int64_t rotors, const auto& run) {
  return with_rotor_count(rotors, [&](auto count) {
    return run_method(method, run, Method<MonitorSteps<count>>{"monitor_sample"}) ||
           with_steps_of_size<8, static_cast<int>(count), 4>(method, run);
  });
};

}  // namespace airworthy::bench
