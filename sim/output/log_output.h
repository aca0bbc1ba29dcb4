#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "airworthy/attitude_setpoint_t.hpp"
#include "airworthy/attitude_t.hpp"
#include "airworthy/esc_status_t.hpp"
#include "airworthy/flight_state_t.hpp"
#include "airworthy/ground_truth_t.hpp"
#include "airworthy/imu_t.hpp"
#include "airworthy/rotor_command_t.hpp"
#include "runtime/bus/bus.h"
#include "runtime/clock/manual_clock.h"
#include "runtime/process/node.h"
#include "sim/output/output.h"

namespace airworthy::sim {

/// Publishes what the devices send as the drivers would have: on a recording bus this writes a flight log. The
/// vehicle's clock starts at kStart_s, so that no time is 0.
class LogOutput final : public Output {
 public:
  static constexpr const char* kProducer = "airworthy-sim";
  static constexpr double kStart_s = 100.0;

  LogOutput(rt::Bus& bus, const std::string& vehicle, std::size_t rotor_count, std::uint64_t seed);

  void on_truth(const Truth& truth) override;
  void on_imu(const ImuSample& sample) override;
  void on_esc(const EscSample& sample) override;
  void on_attitude(const AutopilotSample& sample) override;
  void on_commands(const AutopilotSample& sample) override;
  void on_flight_state(const AutopilotSample& sample, LandedState landed_state) override;

  [[nodiscard]] static TimePoint vehicle_time(double time_s);

 private:
  rt::ManualClock clock_;
  rt::Log log_{kProducer, rt::LogLevel::kError};
  rt::Node node_;
  std::size_t rotor_count_;
  rt::Publisher<ground_truth_t> truth_;
  rt::Publisher<imu_t> imu_;
  rt::Publisher<esc_status_t> esc_;
  rt::Publisher<attitude_t> attitude_;
  rt::Publisher<attitude_setpoint_t> setpoint_;
  rt::Publisher<rotor_command_t> command_;
  rt::Publisher<flight_state_t> state_;
};

}  // namespace airworthy::sim
