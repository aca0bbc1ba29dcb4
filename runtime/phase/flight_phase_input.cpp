#include "runtime/phase/flight_phase_input.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <utility>

#include "airworthy/esc_status_t.hpp"
#include "airworthy/flight_state_t.hpp"
#include "airworthy/imu_t.hpp"
#include "airworthy/rotor_command_t.hpp"
#include "runtime/bus/channels.h"
#include "runtime/phase/landed_report.h"

namespace airworthy::rt {
namespace {

constexpr double kRadSPerRpm = std::numbers::pi / 30.0;

}  // namespace

FlightPhaseInput::FlightPhaseInput(Node& node, const Multirotor& vehicle) : node_{node}, phase_{vehicle} {
  node.subscribe<esc_status_t>(channel::kEscStatus, [this](const esc_status_t& message) {
    std::vector<double> speeds = message.speed_rpm;
    for (double& speed : speeds) speed *= kRadSPerRpm;
    const TimePoint time = from_us(message.header.time_us);
    queue(time, 0,
          [time, speeds = std::move(speeds)](FlightPhase& phase) { phase.on_rotor_speeds(time, speeds); });
  });
  node.subscribe<rotor_command_t>(channel::kRotorCommand, [this](const rotor_command_t& message) {
    const TimePoint time = from_us(message.header.time_us);
    queue(time, 1, [time, command = message.command_ratio](FlightPhase& phase) {
      phase.on_rotor_commands(time, command);
    });
  });
  node.subscribe<flight_state_t>(channel::kFlightState, [this](const flight_state_t& message) {
    const TimePoint time = from_us(message.header.time_us);
    queue(time, 2,
          [time, landed = landed_report(message.landed_state),
           climb = message.climb_m_s](FlightPhase& phase) { phase.on_report(time, landed, climb); });
  });
  node.subscribe<imu_t>(channel::kImu, [this](const imu_t& message) {
    if (sensor_id_ < 0) sensor_id_ = message.sensor_id;
    if (message.sensor_id != sensor_id_) return;
    std::array<double, 3> accel{};
    std::array<double, 3> gyro{};
    std::copy(std::begin(message.accel_m_s2), std::end(message.accel_m_s2), accel.begin());
    std::copy(std::begin(message.gyro_rad_s), std::end(message.gyro_rad_s), gyro.begin());
    const TimePoint time = from_us(message.header.time_us);
    queue(time, 3, [time, accel, gyro](FlightPhase& phase) { phase.on_imu(time, accel, gyro); });
  });
}

void FlightPhaseInput::queue(TimePoint time, int rank, std::function<void(FlightPhase&)> apply) {
  // Nobody asks for the phase: then the oldest is not worth keeping.
  if (queue_.size() >= kMostQueued) {
    queue_.erase(queue_.begin());
    node_.counters().add("flight_phase.dropped");
  }
  queue_.push_back({time, rank, std::move(apply)});
}

const FlightPhase& FlightPhaseInput::advance_to(TimePoint time) {
  std::stable_sort(queue_.begin(), queue_.end(), [](const Input& a, const Input& b) {
    return std::pair{a.time, a.rank} < std::pair{b.time, b.rank};
  });
  auto next = queue_.begin();
  for (; next != queue_.end() && next->time <= time; ++next) next->apply(phase_);
  queue_.erase(queue_.begin(), next);
  return phase_;
}

}  // namespace airworthy::rt
