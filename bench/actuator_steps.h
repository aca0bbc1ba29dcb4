#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <string_view>

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

/// Calls `run` with the steps of a method for one size; false if there is none of that name.
template <int kStates, int kInputs, int kOutputs, class Run>
bool with_steps_of_size(const std::string_view method, const Run& run) {
  if (method == "multi_stage") {
    run(MultiStageSteps<kStates, kInputs, kOutputs>{});
  } else if (method == "textbook_augmented") {
    run(AugmentedSteps<reference::AugmentedFaultFilter<double>, kStates, kInputs, kOutputs>{});
  } else if (method == "symmetric_augmented") {
    run(AugmentedSteps<reference::ThriftyFaultFilter<double, kStates, kInputs, kOutputs, false>, kStates,
                       kInputs, kOutputs>{});
  } else if (method == "blockwise_augmented") {
    run(AugmentedSteps<reference::ThriftyFaultFilter<double, kStates, kInputs, kOutputs, true>, kStates,
                       kInputs, kOutputs>{});
  } else {
    return false;
  }
  return true;
}

/// One inertial sample of the whole detector: observers of rotors and axes, and the verdicts.
struct MonitorSteps {
  explicit MonitorSteps(std::size_t count) : rotors{count}, body{count, 1} {}

  static actuator::ActuatorMonitorParams params(const Multirotor& vehicle) {
    actuator::ActuatorMonitorParams result;
    result.vehicle = vehicle;
    return result;
  }

  std::size_t rotors;
  test::HoveringMultirotor body;
  actuator::ActuatorMonitor monitor{params(body.vehicle)};

  double step() {
    body.step();
    const TimePoint now = TimePoint{} + from_seconds(body.time_s);
    monitor.on_rotor_commands(now, std::span{body.command_ratio}.first(rotors));
    static_cast<void>(monitor.on_imu({now, body.accel_m_s2, body.gyro_rad_s}, Phase::kInFlight));
    return monitor.nis();
  }
};

/// The same for the observer of a vehicle with 4, 6 or 8 rotors: eight states, four outputs.
template <class Run>
bool with_steps(const std::string_view method, std::int64_t rotors, const Run& run) {
  if (method == "monitor_sample" && (rotors == 4 || rotors == 6 || rotors == 8)) {
    run(MonitorSteps{static_cast<std::size_t>(rotors)});
    return true;
  }
  return (rotors == 4 && with_steps_of_size<8, 4, 4>(method, run)) ||
         (rotors == 6 && with_steps_of_size<8, 6, 4>(method, run)) ||
         (rotors == 8 && with_steps_of_size<8, 8, 4>(method, run));
}

}  // namespace airworthy::bench
