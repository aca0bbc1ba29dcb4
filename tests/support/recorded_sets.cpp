#include "tests/support/recorded_sets.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "core/math/phasor.h"

namespace airworthy::testing {

RecordedSet bebop_set(const std::filesystem::path& data) {
  RecordedSet set{.name = "bebop2_prop_eject", .clock_error = {-0.005, -0.005, -0.005, -0.005}};
  RecordedFlight flight = load_bebop(data / set.name / "flight01_11-43-10.csv.xz");
  // What follows is the ejection.
  std::erase_if(flight.rows, [start = flight.rows.empty() ? TimePoint{} : flight.rows.front().time](
                                 const auto& row) { return to_seconds(row.time - start) > kBebopTo_s; });
  if (!flight.rows.empty()) set.flights.push_back(std::move(flight));
  set.params.vehicle = vehicle_called("bebop2");
  // Its vibration turns against the rotor as much as with it.
  set.params.against_ratio = 1.0;
  return set;
}

RecordedSet thrown_set(const std::filesystem::path& data) {
  RecordedSet set{.name = "indiflight_throw",
                  .clock_error = {0.0007, 0.0030, 0.0010, 0.0012},
                  .pole_Hz = 40.0,
                  .resolution_m_s2 = 9.80665 / 2048.0};
  set.flights = load_all(data / set.name, load_thrown);
  set.params.vehicle = vehicle_called("indiflight_throw");
  // Accelerations as the sensor's low-pass leaves them, some 2 to 4 % at 317 Hz.
  set.params.smallest_m_s2 = 0.02;
  set.params.caution_m_s2 = 0.06;
  // They shake 0.3 m/s² rms at 20 to 50 Hz, which would count as noise at 317 Hz too.
  set.params.usual_m_s2 = 0.025;
  return set;
}

RecordedSet crazyflie_set(const std::filesystem::path& data) {
  RecordedSet set{.name = "crazyflie_brushless_rpm"};
  set.flights = load_all(data / set.name, load_crazyflie);
  set.params.vehicle = vehicle_called("crazyflie_brushless");
  set.params.low_pass_Hz = 30.0;  // of the firmware's accelerometer filter
  return set;
}

namespace {

/// Speed of a rotor smoothed to both sides. rad/s.
std::vector<double> smoothed_speed(const RecordedFlight& flight, std::size_t rotor) {
  constexpr double kSigma_s = 0.004;
  constexpr std::ptrdiff_t kReach = 8;
  const auto rows = static_cast<std::ptrdiff_t>(flight.rows.size());
  std::vector<double> smooth(flight.rows.size());
  for (std::ptrdiff_t k = 0; k < rows; ++k) {
    double sum = 0.0;
    double weights = 0.0;
    for (std::ptrdiff_t j = std::max<std::ptrdiff_t>(0, k - kReach); j <= std::min(rows - 1, k + kReach);
         ++j) {
      const auto row = static_cast<std::size_t>(j);
      const double z =
          to_seconds(flight.rows[row].time - flight.rows[static_cast<std::size_t>(k)].time) / kSigma_s;
      const double weight = std::exp(-0.5 * z * z);
      sum += weight * flight.rows[row].speed_rad_s[rotor];
      weights += weight;
    }
    smooth[static_cast<std::size_t>(k)] = sum / weights;
  }
  return smooth;
}

/// What two poles of first order leave of e^{jωt}.
Phasor<double> left_by_sensor(double speed_rad_s, double pole_Hz) {
  if (pole_Hz <= 0.0) return {1.0, 0.0};
  const Phasor<double> pole{1.0, speed_rad_s / (2.0 * std::numbers::pi * pole_Hz)};
  return Phasor<double>{1.0, 0.0} / (pole * pole);
}

}  // namespace

RecordedFlight add_unbalance(const RecordedFlight& flight, const RecordedSet& set,
                             const AddedUnbalance& added, std::uint64_t seed) {
  constexpr double kPhaseWalk_rad_s05 = 0.1;
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal;
  const double hover = UnbalanceMonitor::hover_speed_rad_s(set.params.vehicle);
  const double spin = set.params.vehicle.rotor[added.rotor].spin;
  const auto speed = smoothed_speed(flight, added.rotor);
  double phase = std::uniform_real_distribution<double>{0.0, 2.0 * std::numbers::pi}(random);
  const double against_phase = std::uniform_real_distribution<double>{0.0, 2.0 * std::numbers::pi}(random);
  RecordedFlight result = flight;
  for (std::size_t k = 1; k < result.rows.size(); ++k) {
    RecordedRow& row = result.rows[k];
    const double dt_s = to_seconds(row.time - result.rows[k - 1].time);
    const double true_speed = (1.0 + set.clock_error[added.rotor]) * 0.5 * (speed[k] + speed[k - 1]);
    phase += true_speed * dt_s + kPhaseWalk_rad_s05 * std::sqrt(dt_s) * normal(random);
    if (result.seconds_at(k) < added.onset_s || !row.has_new_accel) continue;
    const Phasor<double> sensor = left_by_sensor(true_speed, set.pole_Hz);
    const double size = added.amplitude_m_s2 * true_speed * true_speed / (hover * hover);
    const auto turn = [&](double start) {
      const Phasor<double> unit{std::cos(phase + start), std::sin(phase + start)};
      return size * (sensor * unit);
    };
    const Phasor<double> with = turn(0.0);
    const Phasor<double> against = added.against_ratio * turn(against_phase);
    row.accel_m_s2[0] += with.re + against.re;
    row.accel_m_s2[1] += spin * (with.im - against.im);
    if (set.resolution_m_s2 > 0.0) {
      for (std::size_t axis = 0; axis < 2; ++axis)
        row.accel_m_s2[axis] = set.resolution_m_s2 * std::round(row.accel_m_s2[axis] / set.resolution_m_s2);
    }
  }
  return result;
}

}  // namespace airworthy::testing
