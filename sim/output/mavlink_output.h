#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "core/protocol/mavlink/frame.h"
#include "core/protocol/mavlink/parser.h"
#include "sim/output/output.h"

namespace airworthy::sim {

/// The flight controller on a serial line: sends HEARTBEAT, HIGHRES_IMU, ATTITUDE, ATTITUDE_TARGET, ESC_STATUS,
/// ESC_INFO, ACTUATOR_OUTPUT_STATUS, VFR_HUD and EXTENDED_SYS_STATE as PX4 does, and answers TIMESYNC and
/// COMMAND_LONG. Its clock counts from its own start.
class MavlinkOutput final : public Output {
 public:
  using Write = std::function<void(std::span<const std::uint8_t>)>;

  MavlinkOutput(Write write, std::size_t rotor_count);

  /// What the other side sent, arrived at `time_s` of the simulation.
  void on_received(std::span<const std::uint8_t> bytes, double time_s);

  void on_truth(const Truth&) override {}  // nobody on the vehicle knows it
  void on_imu(const ImuSample& sample) override;
  void on_esc(const EscSample& sample) override;
  void on_attitude(const AutopilotSample& sample) override;
  void on_commands(const AutopilotSample& sample) override;
  void on_flight_state(const AutopilotSample& sample, LandedState landed_state) override;

 private:
  template <class Message>
  void send(const Message& message);
  void answer(const mavlink::Frame& frame, double time_s);
  void send_heartbeat(const AutopilotSample& sample);
  void send_esc_info(double time_s);

  Write write_;
  std::size_t rotor_count_;
  mavlink::Parser parser_;
  std::uint8_t sequence_ = 0;
  double next_heartbeat_s_ = 0.0;
  double next_esc_info_s_ = 0.0;
  EscSample last_esc_;
};

}  // namespace airworthy::sim
