#include <cmath>

#include "tests/evidence/unbalance_recorded.h"

namespace airworthy::testing {
namespace {

using nlohmann::json;

json described(const std::string& name, const UnbalanceFlight& flight) {
  json result{
      {"flight", name}, {"duration_s", flight.duration_s}, {"amplitude_m_s2", flight.rms_amplitude_m_s2()}};
  std::array<double, UnbalanceFlight::kReasons> seconds{};
  for (std::size_t reason = 0; reason < UnbalanceFlight::kReasons; ++reason) {
    for (std::size_t i = 0; i < 4; ++i) seconds[reason] += 0.25 * flight.seconds_by_reason[i][reason];
  }
  result["seconds_by_reason"] = seconds;  // mean of the rotors
  result["reports"] = json::array();
  for (const auto& report : flight.reports)
    result["reports"].push_back({{"rotor", report.rotor + 1},
                                 {"time_s", report.time_s},
                                 {"growth_m_s2", report.growth_m_s2},
                                 {"sigma_m_s2", report.sigma_m_s2}});
  result["ambiguities_s"] = flight.ambiguities_s;
  if (!flight.moments.empty()) result["speed_error_ratio"] = flight.moments.back().speed_error_ratio;
  double nis = 0.0;
  for (const auto& moment : flight.moments) nis += moment.nis / static_cast<double>(flight.moments.size());
  result["nis"] = nis;
  return result;
}

/// Every flight twice: without a baseline, and with that of the other flights.
json silence(const RecordedSet& set) {
  std::vector<UnbalanceFlight> without;
  for (const RecordedFlight& flight : set.flights) without.push_back(judge_unbalance(flight, set.params));
  json flights = json::array();
  for (std::size_t k = 0; k < set.flights.size(); ++k) {
    UnbalanceParams params = set.params;
    std::vector<std::array<double, 4>> amplitudes;
    std::vector<const UnbalanceFlight*> others;
    for (std::size_t other = 0; other < without.size(); ++other) {
      if (other == k) continue;
      others.push_back(&without[other]);
      amplitudes.push_back(without[other].rms_amplitude_m_s2());
    }
    learn_baseline(amplitudes, params);
    learn_speed_errors(others, params);
    const std::string& name = set.flights[k].name;
    flights.push_back({{"without_baseline", described(name, without[k])},
                       {"has_baseline", params.has_baseline},
                       {"with_baseline", described(name, judge_unbalance(set.flights[k], params))}});
  }
  return {{"set", set.name},
          {"smallest_m_s2", set.params.smallest_m_s2},
          {"g_mm_per_m_s2_and_kg",
           1e6 * UnbalanceMonitor::kg_m_per_m_s2(set.params) / set.params.vehicle.mass_kg},
          {"hover_speed_rad_s", UnbalanceMonitor::hover_speed_rad_s(set.params.vehicle)},
          {"flights", flights}};
}

}  // namespace

nlohmann::json crazypad_evidence(const std::filesystem::path& data) {
  RecordedSet set = crazyflie_set({});
  // The brushed Crazyflie 2.1: lighter, and by its commands in hover a rotor turns at 250 to 350 Hz.
  set.params.vehicle.mass_kg = 0.03;
  set.params.vehicle.speed_min_rad_s = 0.0;
  set.params.vehicle.speed_max_rad_s = 3000.0;
  set.params.vehicle.thrust_coefficient_N_s2 = 0.03 * 9.81 / 4.0 / (1850.0 * 1850.0);
  json flights = json::array();
  for (const RecordedFlight& flight : load_all(data / "crazypad/motor", load_crazypad))
    flights.push_back(described(flight.name, judge_unbalance(flight, set.params)));
  return flights;
}

nlohmann::json healthy_evidence(const std::filesystem::path& data) {
  return nlohmann::json::array({silence(thrown_set(data)), silence(crazyflie_set(data))});
}

}  // namespace airworthy::testing
