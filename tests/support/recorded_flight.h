#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/detectors/flight_phase.h"
#include "core/detectors/unbalance/unbalance_monitor.h"
#include "core/time/time.h"
#include "core/vehicle/multirotor.h"

namespace airworthy::testing {

/// One row of a recorded flight of four rotors, in body axes x forward, y right, z down.
struct RecordedRow {
  TimePoint time{};
  std::array<double, 3> accel_m_s2{};  ///< specific force
  std::array<double, 3> gyro_rad_s{};
  std::array<double, 4> speed_rad_s{};    ///< NaN where nothing measured it
  std::array<double, 4> command_ratio{};  ///< NaN where it was not recorded
  bool has_new_accel = true;              ///< false where the recorder repeats an older value
  bool has_new_speed = true;
};

struct RecordedFlight {
  std::string name;
  std::vector<RecordedRow> rows;
  [[nodiscard]] double seconds_at(std::size_t row) const {
    return to_seconds(rows[row].time - rows.front().time);
  }
};

/// The sets of recordings as their READMEs describe them. Empty where a file is absent or unreadable.
[[nodiscard]] RecordedFlight load_bebop(const std::filesystem::path& file);
[[nodiscard]] RecordedFlight load_thrown(const std::filesystem::path& file);
[[nodiscard]] RecordedFlight load_crazyflie(const std::filesystem::path& file);
/// The flights of folder motor/: acceleration in axes of the world, which the level square flight nearly shares.
[[nodiscard]] RecordedFlight load_crazypad(const std::filesystem::path& file);
/// Every file of a set whose name begins so, by the loader, in the order of their names.
[[nodiscard]] std::vector<RecordedFlight> load_all(const std::filesystem::path& folder,
                                                   RecordedFlight (*load)(const std::filesystem::path&),
                                                   const std::string& begins = "");

/// What becomes of the speed between the rotor and the monitor.
struct SpeedTelemetry {
  double delay_s = 0.0;           ///< from the measurement to its stamp
  double period_s = 0.0;          ///< 0 = as recorded
  double resolution_rad_s = 0.0;  ///< 0 = as recorded
  double scale = 1.0;             ///< of the clock that times the turns
};

/// What an UnbalanceMonitor said of a flight.
struct UnbalanceFlight {
  static constexpr std::size_t kReasons = 8;
  struct Report {
    std::size_t rotor = 0;
    double time_s = 0.0;
    double growth_m_s2 = 0.0;
    double sigma_m_s2 = 0.0;
  };
  struct Moment {
    double time_s = 0.0;
    std::array<double, 4> amplitude_m_s2{};
    std::array<double, 4> sigma_m_s2{};
    std::array<double, 4> log_odds{};
    std::array<bool, 4> is_judged{};  ///< by its phase
    double nis = 0.0;
    double noise_m_s2 = 0.0;
    std::array<double, 4> speed_error_ratio{};
  };
  std::vector<Report> reports;
  std::vector<double> ambiguities_s;
  std::vector<Moment> moments;  ///< ten a second, while something is judged by its phase
  double duration_s = 0.0;
  std::array<std::array<double, kReasons>, 4> seconds_by_reason{};  ///< per rotor

  /// Of each rotor over the moments between two times when it was judged, NaN without any.
  [[nodiscard]] std::array<double, 4> rms_amplitude_m_s2(double from_s = 0.0, double to_s = 1e9) const;
};

/// Flies a recording past the flight phase and the monitor, as the service would.
[[nodiscard]] UnbalanceFlight judge_unbalance(const RecordedFlight& flight, const UnbalanceParams& params,
                                              const SpeedTelemetry& telemetry = {});

/// The amplitudes in each second between two times.
[[nodiscard]] std::vector<std::array<double, 4>> amplitudes_by_second(const UnbalanceFlight& flight,
                                                                      double from_s, double to_s);

/// The baseline of a vehicle from the amplitudes of several of its flights: their mean, and their scatter as sigma.
/// Without two flights for every rotor there is none.
void learn_baseline(std::span<const std::array<double, 4>> amplitudes_m_s2, UnbalanceParams& params);
/// The clock errors from where they ended in flights of the vehicle: the median.
void learn_speed_errors(std::span<const UnbalanceFlight* const> flights, UnbalanceParams& params);

/// A vehicle by the name of its file in config/vehicles.
[[nodiscard]] Multirotor vehicle_called(const std::string& name);

}  // namespace airworthy::testing
