#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/detectors/unbalance/unbalance_monitor.h"
#include "tests/support/recorded_flight.h"

namespace airworthy::testing {

/// Rotor speeds of the Bebop's flight before the propeller is thrown off, well in the air. Since its start.
inline constexpr double kBebopFrom_s = 2.5;
inline constexpr double kBebopHalf_s = 7.35;
inline constexpr double kBebopTo_s = 12.2;

/// What is known of a vehicle beside its flights.
struct RecordedSet {
  std::string name;
  std::vector<RecordedFlight> flights{};
  UnbalanceParams params{};
  /// True over reported speed, less 1, of each rotor: where its vibration is explained best (see the page).
  std::array<double, 4> clock_error{};
  /// Poles of first order, each at this frequency, that the sensors' samples have passed; 0 = none.
  double pole_Hz = 0.0;
  double resolution_m_s2 = 0.0;  ///< of the recorded acceleration
};

[[nodiscard]] RecordedSet bebop_set(const std::filesystem::path& data);
[[nodiscard]] RecordedSet thrown_set(const std::filesystem::path& data);
[[nodiscard]] RecordedSet crazyflie_set(const std::filesystem::path& data);

/// What is out of balance in a flight, and since when.
struct AddedUnbalance {
  std::size_t rotor = 0;
  double amplitude_m_s2 = 0.0;  ///< of the airframe at hover speed, before the sensor
  double onset_s = 0.0;
  double against_ratio = 0.0;  ///< part that turns against the rotor
};

/// A recorded flight with an unbalance added to its acceleration: phase from the speed smoothed to both sides
/// (Gaussian of 4 ms) with the clock error taken out, and a random walk of 0.1 rad/√s.
[[nodiscard]] RecordedFlight add_unbalance(const RecordedFlight& flight, const RecordedSet& set,
                                           const AddedUnbalance& added, std::uint64_t seed);

}  // namespace airworthy::testing
