#include "tests/support/recorded_flight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "cli/import/csv_reader.h"
#include "core/assert.h"
#include "core/detectors/unbalance/rotor_unbalance_monitor.h"
#include "runtime/config/vehicle.h"

namespace airworthy::testing {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::array<double, 4> kNotKnown{kNaN, kNaN, kNaN, kNaN};
constexpr double kRpm = 2.0 * std::numbers::pi / 60.0;

/// Columns of a table by name; a row as numbers.
class Table {
 public:
  static std::optional<Table> open(const std::filesystem::path& file, std::span<const char* const> names) {
    auto reader = importer::CsvReader::open(file);
    if (!reader) return std::nullopt;
    Table table{std::move(*reader)};
    for (const char* name : names) {
      const auto column = table.reader_.column(name);
      if (!column) return std::nullopt;
      table.columns_.push_back(*column);
    }
    return table;
  }

  /// False at the end, and at a row that is not all numbers.
  bool next(std::vector<double>& row) {
    const auto has_row = reader_.next();
    if (!has_row || !*has_row) return false;
    row.clear();
    for (const std::size_t column : columns_) {
      const auto number = reader_.number(column);
      // An empty cell is what was not measured.
      row.push_back(number ? *number : std::numeric_limits<double>::quiet_NaN());
    }
    return true;
  }

 private:
  explicit Table(importer::CsvReader reader) : reader_{std::move(reader)} {}
  importer::CsvReader reader_;
  std::vector<std::size_t> columns_;
};

template <class ToRow>
RecordedFlight load(const std::filesystem::path& file, std::span<const char* const> names, ToRow to_row) {
  RecordedFlight flight;
  flight.name = file.filename().string();
  flight.name = flight.name.substr(0, flight.name.find(".csv"));
  auto table = Table::open(file, names);
  if (!table) return flight;
  std::vector<double> cells;
  std::vector<double> before;
  while (table->next(cells)) {
    flight.rows.push_back(to_row(cells, before.empty() ? nullptr : &before));
    before = cells;
  }
  return flight;
}

}  // namespace

RecordedFlight load_bebop(const std::filesystem::path& file) {
  constexpr std::array names = {"timestamp",  "accel[0]",   "accel[1]",  "accel[2]",
                                "rates[0]",   "rates[1]",   "rates[2]",  "esc_rpm[0]",
                                "esc_rpm[1]", "esc_rpm[2]", "esc_rpm[3]"};
  return load(file, names, [](const std::vector<double>& c, const std::vector<double>*) {
    return RecordedRow{.time = from_us(static_cast<std::int64_t>(c[0])),
                       .accel_m_s2 = {c[1], c[2], c[3]},
                       .gyro_rad_s = {c[4], c[5], c[6]},
                       .speed_rad_s = {c[7] * kRpm, c[8] * kRpm, c[9] * kRpm, c[10] * kRpm},
                       .command_ratio = kNotKnown};
  });
}

RecordedFlight load_thrown(const std::filesystem::path& file) {
  constexpr std::array names = {"t_s",      "ax_mps2",  "ay_mps2",  "az_mps2",  "gx_radps",
                                "gy_radps", "gz_radps", "w1_radps", "w2_radps", "w3_radps",
                                "w4_radps", "u1",       "u2",       "u3",       "u4"};
  // The accelerometer shows minus the specific force in x forward, y right, z down; the gyroscope has y and z turned.
  return load(file, names, [](const std::vector<double>& c, const std::vector<double>*) {
    return RecordedRow{.time = TimePoint{from_seconds(c[0])},
                       .accel_m_s2 = {-c[1], -c[2], -c[3]},
                       .gyro_rad_s = {c[4], -c[5], -c[6]},
                       .speed_rad_s = {c[7], c[8], c[9], c[10]},
                       .command_ratio = {c[11], c[12], c[13], c[14]}};
  });
}

RecordedFlight load_crazyflie(const std::filesystem::path& file) {
  constexpr std::array names = {"t_s",         "ax_mps2", "ay_mps2", "az_mps2", "gx_radps", "gy_radps",
                                "gz_radps",    "erpm1",   "erpm2",   "erpm3",   "erpm4",    "ts_accel_s",
                                "ts_motors_s", "u1",      "u2",      "u3",      "u4"};
  constexpr double kPolePairs = 6.0;
  return load(file, names, [](const std::vector<double>& c, const std::vector<double>* before) {
    RecordedRow row{.time = TimePoint{from_seconds(c[0])},
                    .accel_m_s2 = {c[1], -c[2], -c[3]},
                    .gyro_rad_s = {c[4], -c[5], -c[6]},
                    .speed_rad_s = {},
                    .command_ratio = {c[13], c[14], c[15], c[16]}};
    for (std::size_t i = 0; i < 4; ++i) row.speed_rad_s[i] = c[7 + i] * kRpm / kPolePairs;
    row.has_new_accel = before == nullptr || (*before)[11] != c[11];
    row.has_new_speed = before == nullptr || (*before)[12] != c[12];
    return row;
  });
}

RecordedFlight load_crazypad(const std::filesystem::path& file) {
  constexpr std::array names = {"t_s", "ax_g", "ay_g", "az_g", "m1", "m2", "m3", "m4"};
  constexpr double kGravity_m_s2 = 9.80665;
  constexpr double kFullCommand = 65535.0;
  return load(file, names, [](const std::vector<double>& c, const std::vector<double>*) {
    return RecordedRow{
        .time = TimePoint{from_seconds(c[0])},
        .accel_m_s2 = {kGravity_m_s2 * c[1], -kGravity_m_s2 * c[2], -kGravity_m_s2 * (c[3] + 1.0)},
        .gyro_rad_s = {},
        .speed_rad_s = kNotKnown,
        .command_ratio = {c[4] / kFullCommand, c[5] / kFullCommand, c[6] / kFullCommand,
                          c[7] / kFullCommand}};
  });
}

std::vector<RecordedFlight> load_all(const std::filesystem::path& folder,
                                     RecordedFlight (*load_one)(const std::filesystem::path&),
                                     const std::string& begins) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator{folder, error}) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".csv.xz") && name.starts_with(begins)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<RecordedFlight> flights;
  for (const auto& file : files) {
    auto flight = load_one(file);
    if (!flight.rows.empty()) flights.push_back(std::move(flight));
  }
  return flights;
}

std::array<double, 4> UnbalanceFlight::rms_amplitude_m_s2(double from_s, double to_s) const {
  std::array<double, 4> result{};
  for (std::size_t i = 0; i < 4; ++i) {
    double sum = 0.0;
    double count = 0.0;
    for (const Moment& moment : moments) {
      if (!moment.is_judged[i] || moment.time_s < from_s || moment.time_s >= to_s) continue;
      sum += moment.amplitude_m_s2[i] * moment.amplitude_m_s2[i];
      count += 1.0;
    }
    result[i] = count > 0.0 ? std::sqrt(sum / count) : std::numeric_limits<double>::quiet_NaN();
  }
  return result;
}

namespace {

/// Speeds on their way: what was measured `delay` ago, as often and as finely as the link carries it.
class DelayedSpeeds {
 public:
  explicit DelayedSpeeds(const SpeedTelemetry& telemetry) : telemetry_{telemetry} {}

  /// Passes on what arrives up to the time of this row.
  template <class Deliver>
  void step(const RecordedRow& row, Deliver deliver) {
    const double period_s = telemetry_.period_s;
    if (!std::isfinite(row.speed_rad_s[0])) return;
    if (row.has_new_speed && (!last_ || to_seconds(row.time - *last_) >= period_s - 1e-4)) {
      // The times of sending keep their pace although they fall on rows.
      last_ = last_ && to_seconds(row.time - *last_) < 2.0 * period_s ? *last_ + from_seconds(period_s)
                                                                      : row.time;
      queue_.push_back(row);
    }
    while (!queue_.empty() && to_seconds(row.time - queue_.front().time) >= telemetry_.delay_s - 1e-4) {
      auto speed = queue_.front().speed_rad_s;
      for (double& one : speed) {
        one *= telemetry_.scale;
        if (telemetry_.resolution_rad_s > 0.0)
          one = telemetry_.resolution_rad_s * std::round(one / telemetry_.resolution_rad_s);
      }
      deliver(queue_.front().time + from_seconds(telemetry_.delay_s), speed);
      queue_.erase(queue_.begin());
    }
  }

 private:
  SpeedTelemetry telemetry_;
  std::optional<TimePoint> last_;
  std::vector<RecordedRow> queue_;
};

void note(const UnbalanceMonitor& monitor, double time_s, double since_last_s, UnbalanceFlight& result) {
  UnbalanceFlight::Moment moment{.time_s = time_s};
  bool any = false;
  for (std::size_t i = 0; i < 4; ++i) {
    const RotorUnbalance& rotor = monitor.rotors()[i];
    result.seconds_by_reason[i][static_cast<std::size_t>(rotor.reason)] += since_last_s;
    moment.amplitude_m_s2[i] = rotor.amplitude_m_s2;
    moment.sigma_m_s2[i] = rotor.sigma_m_s2;
    moment.log_odds[i] = rotor.log_odds;
    moment.is_judged[i] = rotor.reason == UnbalanceNotJudged::kJudged && !rotor.by_power;
    any = any || moment.is_judged[i];
    if (rotor.transition == FaultLifeCycle::Transition::kRaise)
      result.reports.push_back({i, time_s, rotor.growth_m_s2, rotor.growth_sigma_m_s2});
  }
  if (monitor.ambiguity() == FaultLifeCycle::Transition::kRaise) result.ambiguities_s.push_back(time_s);
  moment.nis = monitor.innovation().nis;
  moment.noise_m_s2 = monitor.innovation().noise_m_s2;
  for (std::size_t i = 0; i < 4; ++i) moment.speed_error_ratio[i] = monitor.innovation().speed_error_ratio[i];
  if (any) result.moments.push_back(moment);
}

}  // namespace

UnbalanceFlight judge_unbalance(const RecordedFlight& flight, const UnbalanceParams& params,
                                const SpeedTelemetry& telemetry) {
  UnbalanceFlight result;
  FlightPhase phase{params.vehicle};
  RotorUnbalanceMonitor<4> monitor{params};
  DelayedSpeeds speeds{telemetry};
  double last_judged_s = 0.0;
  for (std::size_t k = 0; k < flight.rows.size(); ++k) {
    const RecordedRow& row = flight.rows[k];
    speeds.step(row, [&](TimePoint time, const std::array<double, 4>& speed) {
      phase.on_rotor_speeds(time, speed);
      monitor.on_speeds(time, speed);
    });
    if (std::isfinite(row.command_ratio[0])) {
      phase.on_rotor_commands(row.time, row.command_ratio);
      monitor.on_commands(row.time, row.command_ratio);
    }
    if (!row.has_new_accel) continue;
    phase.on_imu(row.time, row.accel_m_s2, row.gyro_rad_s);
    monitor.on_phase(phase.phase());
    if (!monitor.on_accel(row.time, row.accel_m_s2[0], row.accel_m_s2[1], 0.0)) continue;
    const double time_s = flight.seconds_at(k);
    note(monitor, time_s, time_s - last_judged_s, result);
    last_judged_s = time_s;
  }
  result.duration_s = flight.rows.empty() ? 0.0 : flight.seconds_at(flight.rows.size() - 1);
  return result;
}

std::vector<std::array<double, 4>> amplitudes_by_second(const UnbalanceFlight& flight, double from_s,
                                                        double to_s) {
  std::vector<std::array<double, 4>> amplitudes;
  for (int n = 0; from_s + n + 1.0 <= to_s; ++n)
    amplitudes.push_back(flight.rms_amplitude_m_s2(from_s + n, from_s + n + 1.0));
  return amplitudes;
}

void learn_baseline(std::span<const std::array<double, 4>> amplitudes_m_s2, UnbalanceParams& params) {
  params.has_baseline = true;
  for (std::size_t i = 0; i < 4; ++i) {
    double sum = 0.0;
    double sum2 = 0.0;
    double count = 0.0;
    for (const auto& amplitude : amplitudes_m_s2) {
      if (!std::isfinite(amplitude[i])) continue;
      sum += amplitude[i];
      sum2 += amplitude[i] * amplitude[i];
      count += 1.0;
    }
    if (count < 2.0) {
      params.has_baseline = false;
      return;
    }
    const double mean = sum / count;
    params.baseline_m_s2[i] = mean;
    params.baseline_sigma_m_s2[i] = std::sqrt(std::max(0.0, (sum2 - count * mean * mean) / (count - 1.0)));
  }
}

void learn_speed_errors(std::span<const UnbalanceFlight* const> flights, UnbalanceParams& params) {
  for (std::size_t i = 0; i < 4; ++i) {
    std::vector<double> errors;
    for (const UnbalanceFlight* flight : flights) {
      if (!flight->moments.empty()) errors.push_back(flight->moments.back().speed_error_ratio[i]);
    }
    if (errors.empty()) continue;
    const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
    std::nth_element(errors.begin(), middle, errors.end());
    params.speed_error_ratio[i] = *middle;
  }
}

Multirotor vehicle_called(const std::string& name) {
  const auto file = rt::VehicleFile::load(std::string{AIRWORTHY_CONFIG} + "/vehicles/" + name + ".toml");
  AW_ASSERT(file && file->multirotor);
  return *file->multirotor;
}

}  // namespace airworthy::testing
