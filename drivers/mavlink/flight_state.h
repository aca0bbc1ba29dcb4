#pragma once

#include <cstdint>
#include <limits>

#include "airworthy/flight_state_t.hpp"
#include "core/time/time.h"

namespace airworthy::drivers {

/// The newest value of each slow field, which ages to unknown.
class FlightState {
 public:
  template <class T>
  struct Field {
    T value;
    T unknown;
    TimePoint received{};

    void set(T new_value, TimePoint now) {
      value = new_value;
      received = now;
    }
    [[nodiscard]] T get(TimePoint now, Duration timeout) const {
      return now - received <= timeout ? value : unknown;
    }
  };
  using Number = Field<double>;

  static Number number() {
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  }

  Number airspeed_m_s = number();
  Number groundspeed_m_s = number();
  Number climb_m_s = number();
  Number altitude_m = number();
  Number altitude_error_m = number();
  Number airspeed_error_m_s = number();
  Number crosstrack_error_m = number();
  Field<std::int8_t> armed{-1, -1};
  Field<std::int8_t> landed_state{-1, -1};
  Field<std::int64_t> mode{-1, -1};

  [[nodiscard]] flight_state_t to_message(TimePoint now, Duration timeout) const;
};

}  // namespace airworthy::drivers
