#pragma once

#include "airworthy/attitude_setpoint_t.hpp"
#include "airworthy/attitude_t.hpp"
#include "airworthy/esc_status_t.hpp"
#include "airworthy/flight_state_t.hpp"
#include "airworthy/imu_t.hpp"
#include "airworthy/rotor_command_t.hpp"
#include "core/time/time.h"

namespace airworthy::drivers {

/// Where received messages go: the bus, or a test's memory. Times never go back on one channel.
class MessageSink {
 public:
  MessageSink() = default;
  MessageSink(const MessageSink&) = delete;
  MessageSink& operator=(const MessageSink&) = delete;
  virtual ~MessageSink() = default;

  virtual void publish(imu_t& message, TimePoint time) = 0;
  virtual void publish(attitude_t& message, TimePoint time) = 0;
  virtual void publish(attitude_setpoint_t& message, TimePoint time) = 0;
  virtual void publish(flight_state_t& message, TimePoint time) = 0;
  virtual void publish(esc_status_t& message, TimePoint time) = 0;
  virtual void publish(rotor_command_t& message, TimePoint time) = 0;
};

}  // namespace airworthy::drivers
