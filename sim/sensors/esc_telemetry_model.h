#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/vehicle/multirotor.h"
#include "sim/config/realism.h"
#include "sim/random.h"

namespace airworthy::sim {

/// One telemetry message for all rotors; NaN where the ESC sent nothing.
struct EscSample {
  double time_s = 0.0;  ///< of its arrival: the delay behind the measurement is not known to anybody
  std::array<double, kMaxRotors> speed_rpm{};
  std::array<double, kMaxRotors> voltage_V{};
  std::array<double, kMaxRotors> current_A{};
  std::array<double, kMaxRotors> temperature_degC{};
};

/// What a fault does to the telemetry of one ESC.
struct EscFault {
  bool is_silent = false;
  bool is_frozen = false;
  bool is_garbage = false;            ///< speeds without meaning, as in a desync
  double speed_factor = 1.0;          ///< number of pole pairs for electrical instead of mechanical speed
  double temperature_offset_K = 0.0;  ///< 273.15 for K sent as °C
};

/// Speed telemetry with rate, latency and jitter, noise, resolution and loss of single values.
class EscTelemetryModel {
 public:
  EscTelemetryModel(const Realism::Esc& realism, std::size_t rotor_count, std::uint64_t seed);

  /// The measurement due now; it arrives later.
  void measure(double time_s, double supply_V, const std::array<double, kMaxRotors>& speed_rad_s,
               const std::array<EscFault, kMaxRotors>& faults);
  /// The oldest message that has arrived by now, if any.
  [[nodiscard]] std::optional<EscSample> arrived(double time_s);
  [[nodiscard]] double period_s() const { return 1.0 / realism_.rate_Hz; }

 private:
  Realism::Esc realism_;
  std::size_t rotor_count_;
  std::vector<Random> random_;  ///< of each rotor
  Random jitter_;
  std::deque<EscSample> under_way_;
  EscSample last_;
};

}  // namespace airworthy::sim
