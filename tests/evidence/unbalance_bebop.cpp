#include <Eigen/Dense>
#include <cmath>

#include "core/estimators/unbalance/order_tracker.h"
#include "tests/evidence/unbalance_recorded.h"

namespace airworthy::testing {
namespace {

using nlohmann::json;
using Tracker = OrderTracker<double, 4>;
constexpr double kHighPass_rad_s = 75.0;  // the tracker's own
constexpr double kWarmUp_s = 1.5;

struct Tracked {
  double explained = 0.0;  ///< share of the energy of the high-passed acceleration that was predicted
  double nis = 0.0;
  std::array<double, 4> speed_error{};
};

OrderTrackerParams<double> tracker_params(const RecordedSet& set, double most_speed_error) {
  return {.reference_speed_rad_s = UnbalanceMonitor::hover_speed_rad_s(set.params.vehicle),
          .smallest_m_s2 = set.params.smallest_m_s2,
          .most_speed_error_ratio = most_speed_error};
}

/// Rows of a flight between two times, with all speeds scaled and shifted in time; calls `each` after a fused sample.
template <class Each>
Tracked track(const RecordedSet& set, double from_s, double to_s, double scale, double latency_s,
              double most_speed_error, Each each) {
  const RecordedFlight& flight = set.flights.front();
  const auto params = tracker_params(set, most_speed_error);
  Tracker tracker{params};
  SensorResponse<double> high_pass{kHighPass_rad_s, 0.0};
  double residual = 0.0;
  double energy = 0.0;
  double nis = 0.0;
  double count = 0.0;
  bool is_first = true;
  TimePoint last{};
  std::array<double, 2> felt{};
  for (std::size_t k = 0; k < flight.rows.size(); ++k) {
    const double time_s = flight.seconds_at(k);
    if (time_s < from_s || time_s > to_s) continue;
    const RecordedRow& row = flight.rows[k];
    auto speed = row.speed_rad_s;
    for (double& one : speed) one *= scale;
    tracker.on_speeds(row.time - from_seconds(latency_s), speed);
    const std::array<double, 2> accel{row.accel_m_s2[0], row.accel_m_s2[1]};
    if (is_first) high_pass.restart(accel);
    if (!is_first) felt = high_pass.high_pass(accel, to_seconds(row.time - last));
    is_first = false;
    last = row.time;
    const std::int64_t fused = tracker.counters().fused;
    static_cast<void>(tracker.on_accel(row.time, accel[0], accel[1], 0.0));
    if (tracker.counters().fused == fused) continue;
    if (time_s < from_s + kWarmUp_s) continue;
    energy += felt[0] * felt[0] + felt[1] * felt[1];
    const auto& innovation = tracker.innovation();
    residual += innovation.x_m_s2 * innovation.x_m_s2 + innovation.y_m_s2 * innovation.y_m_s2;
    nis += innovation.nis();
    count += 1.0;
    each(time_s, tracker);
  }
  Tracked result{.explained = 1.0 - residual / energy, .nis = nis / count};
  for (std::size_t i = 0; i < 4; ++i) result.speed_error[i] = tracker.speed_error_ratio(i);
  return result;
}

constexpr auto kNothing = [](double, const Tracker&) {};

/// The same without any filter: constant amplitudes of the four rotors fitted to blocks of one second.
double explained_in_blocks(const RecordedSet& set, double scale) {
  const RecordedFlight& flight = set.flights.front();
  SensorResponse<double> high_pass{kHighPass_rad_s, 0.0};
  std::array<double, 4> phase{};
  Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 2> right = Eigen::Matrix<double, 8, 2>::Zero();
  double energy = 0.0;
  double explained = 0.0;
  double block_s = kBebopFrom_s + kWarmUp_s + 1.0;
  for (std::size_t k = 1; k < flight.rows.size(); ++k) {
    const double time_s = flight.seconds_at(k);
    if (time_s < kBebopFrom_s) continue;
    const RecordedRow& row = flight.rows[k];
    const double dt_s = to_seconds(row.time - flight.rows[k - 1].time);
    const auto felt = high_pass.high_pass({row.accel_m_s2[0], row.accel_m_s2[1]}, dt_s);
    Eigen::Matrix<double, 8, 1> h;
    for (std::size_t i = 0; i < 4; ++i) {
      phase[i] += 0.5 * scale * (row.speed_rad_s[i] + flight.rows[k - 1].speed_rad_s[i]) * dt_s;
      const auto at = static_cast<Eigen::Index>(2 * i);
      const double size = row.speed_rad_s[i] * row.speed_rad_s[i] * 1e-6;
      h(at) = size * std::cos(phase[i]);
      h(at + 1) = -size * std::sin(phase[i]);
    }
    if (time_s < kBebopFrom_s + kWarmUp_s) continue;
    if (time_s >= block_s) {
      explained += (right.array() * normal.ldlt().solve(right).array()).sum();
      normal.setZero();
      right.setZero();
      block_s += 1.0;
      if (block_s > kBebopTo_s) break;
    }
    normal += h * h.transpose();
    right += h * Eigen::RowVector2d{felt[0], felt[1]};
    energy += felt[0] * felt[0] + felt[1] * felt[1];
  }
  return explained / energy;
}

json detuning(const RecordedSet& set) {
  const double right = 1.0 + set.clock_error[0];
  json rows = json::array();
  for (const double off : {0.80,   0.85,  0.90, 0.93, 0.95, 0.97, 0.98, 0.99, 0.995, 0.9975, 1.0,
                           1.0025, 1.005, 1.01, 1.02, 1.03, 1.05, 1.07, 1.10, 1.15,  1.20}) {
    const Tracked tracked = track(set, kBebopFrom_s, kBebopTo_s, right * off, 0.0, 0.0, kNothing);
    rows.push_back({{"scale", off},
                    {"explained", tracked.explained},
                    {"explained_in_blocks", explained_in_blocks(set, right * off)},
                    {"nis", tracked.nis}});
  }
  return rows;
}

json latency(const RecordedSet& set) {
  const double right = 1.0 + set.clock_error[0];
  json rows = json::array();
  for (int ms = -30; ms <= 60; ms += 5) {
    const Tracked tracked = track(set, kBebopFrom_s, kBebopTo_s, right, 1e-3 * ms, 0.0, kNothing);
    rows.push_back({{"latency_ms", ms}, {"explained", tracked.explained}});
  }
  return rows;
}

/// From a start at 0, as reported: what is explained, the errors found, and when each settles.
json clocks_followed(const RecordedSet& set) {
  std::array<double, 4> settled_s{};
  const Tracked tracked =
      track(set, kBebopFrom_s, kBebopTo_s, 1.0, 0.0, 0.01, [&](double time_s, const Tracker& t) {
        for (std::size_t i = 0; i < 4; ++i) {
          if (std::abs(t.speed_error_ratio(i) - set.clock_error[i]) > 0.0005)
            settled_s[i] = time_s - kBebopFrom_s;
        }
      });
  const Tracked not_followed = track(set, kBebopFrom_s, kBebopTo_s, 1.0, 0.0, 0.0, kNothing);
  return {{"explained", tracked.explained},
          {"explained_as_reported", not_followed.explained},
          {"speed_error_ratio", tracked.speed_error},
          {"settled_after_s", settled_s}};
}

/// Mean and its 95 % interval over blocks of a second of one half of the flight.
struct Amplitude {
  std::vector<double> with;  ///< mean square in each block
  std::vector<double> against;
  Phasor<double> cross;  ///< Σ Y·X*
  double x2 = 0.0;
  double block_with = 0.0;
  double block_against = 0.0;
  double count = 0.0;
};

json interval(const std::vector<double>& mean_square) {
  double mean = 0.0;
  for (const double one : mean_square)
    mean += std::sqrt(std::max(0.0, one)) / static_cast<double>(mean_square.size());
  double variance = 0.0;
  for (const double one : mean_square) {
    const double off = std::sqrt(std::max(0.0, one)) - mean;
    variance += off * off / (static_cast<double>(mean_square.size()) - 1.0);
  }
  constexpr double kStudent3 = 3.182;  // 97.5 % of 3 degrees of freedom, four blocks
  const double reach = kStudent3 * std::sqrt(variance / static_cast<double>(mean_square.size()));
  return {{"mean", mean}, {"low", mean - reach}, {"high", mean + reach}};
}

json natural_unbalance(const RecordedSet& set, json& moments) {
  const double right = 1.0 + set.clock_error[0];
  json halves = json::array();
  for (const double from_s : {kBebopFrom_s, kBebopHalf_s}) {
    std::array<Amplitude, 4> amplitude;
    double block_s = from_s + kWarmUp_s;
    double last_moment_s = 0.0;
    const double to_s = from_s < kBebopHalf_s ? kBebopHalf_s : kBebopTo_s;
    const double length_s = (to_s - from_s - kWarmUp_s) / 4.0;
    track(set, from_s, to_s, right, 0.0, 0.0, [&](double time_s, const Tracker& tracker) {
      const bool ends = time_s >= block_s + length_s - 0.003;
      for (std::size_t i = 0; i < 4; ++i) {
        const int spin = set.params.vehicle.rotor[i].spin;
        const double variance = 2.0 * tracker.turning_variance_m2_s4(i);
        Amplitude& a = amplitude[i];
        a.block_with += tracker.turning_m_s2(i, spin).squared() - variance;
        a.block_against += tracker.turning_m_s2(i, -spin).squared() - variance;
        a.count += 1.0;
        const auto x = tracker.x_m_s2(i);
        a.cross = a.cross + tracker.y_m_s2(i) * Phasor<double>{x.re, -x.im};
        a.x2 += x.squared();
        if (!ends) continue;
        a.with.push_back(a.block_with / a.count);
        a.against.push_back(a.block_against / a.count);
        a.block_with = a.block_against = a.count = 0.0;
      }
      if (ends) block_s += length_s;
      if (time_s - last_moment_s < 0.05) return;
      last_moment_s = time_s;
      json moment{{"time_s", time_s}};
      for (std::size_t i = 0; i < 4; ++i) {
        const int spin = set.params.vehicle.rotor[i].spin;
        const auto with = tracker.turning_m_s2(i, spin);
        moment["with"].push_back(with.magnitude());
        moment["phase_rad"].push_back(std::atan2(with.im, with.re));
        moment["against"].push_back(tracker.turning_m_s2(i, -spin).magnitude());
        moment["sigma"].push_back(std::sqrt(tracker.turning_variance_m2_s4(i)));
      }
      moments.push_back(moment);
    });
    json half{{"from_s", from_s + kWarmUp_s}, {"to_s", to_s}};
    for (const Amplitude& a : amplitude) {
      half["rotors"].push_back({{"with_m_s2", interval(a.with)},
                                {"against_m_s2", interval(a.against)},
                                {"y_over_x", std::sqrt(a.cross.squared()) / a.x2},
                                {"y_over_x_phase_rad", std::atan2(a.cross.im, a.cross.re)}});
    }
    halves.push_back(half);
  }
  return halves;
}

}  // namespace

nlohmann::json bebop_evidence(const std::filesystem::path& data) {
  const RecordedSet set = bebop_set(data);
  if (set.flights.empty()) return nullptr;
  nlohmann::json moments = json::array();
  nlohmann::json halves = natural_unbalance(set, moments);
  return {{"detuning", detuning(set)},
          {"latency", latency(set)},
          {"clocks_followed", clocks_followed(set)},
          {"halves", halves},
          {"moments", moments},
          {"g_mm_per_m_s2", 1e6 * UnbalanceMonitor::kg_m_per_m_s2(set.params)},
          {"hover_speed_rad_s", UnbalanceMonitor::hover_speed_rad_s(set.params.vehicle)}};
}

}  // namespace airworthy::testing
