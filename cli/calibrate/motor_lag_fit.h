#pragma once

#include <optional>
#include <vector>

namespace airworthy::calibrate {

/// Values of one rotor over time, in order of time.
struct Series {
  std::vector<double> time_s;
  std::vector<double> value;
};

struct MotorLagFit {
  double time_constant_s = 0.0;
  double delay_s = 0.0;  ///< from the stamp of a command to the stamp of the speed it makes, beside the lag
  double residual_ratio = 0.0;  ///< standard deviation of what is not explained, over the mean speed
};

/// How the speeds of rotors follow their commands:
///   τ·ẋ = u − x,  ω(t) = a + b·x(t − d) + e                                                              (1)
/// by least squares over a, b of each rotor and a grid of τ (4 to 120 ms) and d (0 to 60 ms). Empty where the commands
/// hardly change, for then every lag fits: less than 2 % of the mean speed is explained.
[[nodiscard]] std::optional<MotorLagFit> fit_motor_lag(const std::vector<Series>& commands,
                                                       const std::vector<Series>& speeds);

}  // namespace airworthy::calibrate
