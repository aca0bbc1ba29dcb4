#include "drivers/mavlink/flight_state.h"

namespace airworthy::drivers {

flight_state_t FlightState::to_message(TimePoint now, Duration timeout) const {
  flight_state_t message{};
  message.airspeed_m_s = airspeed_m_s.get(now, timeout);
  message.groundspeed_m_s = groundspeed_m_s.get(now, timeout);
  message.climb_m_s = climb_m_s.get(now, timeout);
  message.altitude_m = altitude_m.get(now, timeout);
  message.altitude_error_m = altitude_error_m.get(now, timeout);
  message.airspeed_error_m_s = airspeed_error_m_s.get(now, timeout);
  message.crosstrack_error_m = crosstrack_error_m.get(now, timeout);
  message.armed = armed.get(now, timeout);
  message.landed_state = landed_state.get(now, timeout);
  message.mode = mode.get(now, timeout);
  return message;
}

}  // namespace airworthy::drivers
