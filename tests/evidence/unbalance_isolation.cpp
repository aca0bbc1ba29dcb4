// Simulated flights of damaged and healthy vehicles at hard realism, judged by the unbalance monitor with a calibration of
// the same vehicle from other flights. Prints one line of values for each flight; tools/evidence makes the page of them.
// Usage: unbalance_isolation CONDITION VEHICLE MANOEUVRE FIRST_SEED COUNT
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "runtime/config/vehicle.h"
#include "tests/support/unbalance_flight_judge.h"

namespace airworthy::sim {
namespace {

constexpr double kGround_s = 2.0;
constexpr double kTakeOff_s = 4.0;
constexpr double kCalibration_s = 60.0;
constexpr double kTrial_s = 40.0;
constexpr double kTrialTimes = 5.0;  // the damage

struct Vehicle {
  const char* name;
  double damage_mg;
};
constexpr std::array kVehicles{Vehicle{"small", 5.0}, Vehicle{"medium", 40.0}, Vehicle{"hexa", 40.0}};

/// What differs from the plain experiment.
struct Condition {
  const char* name;
  bool is_damaged = true;
  double onset_s = 0.0;
  bool two_rotors = false;
  double mass_factor = 1.0;  ///< of the vehicle file; the calibration has the same error
  double esc_latency_s = -1.0;
  double esc_dropout_ratio = -1.0;
  double esc_rate_Hz = -1.0;
  double esc_resolution_rpm = -1.0;
  bool averaged = false;
  bool still = false;  ///< no wind, no errors of motors, rotors and airframe
  bool has_trial = false;
  bool has_speeds = true;
  double flight_s = 40.0;
};
constexpr std::array kConditions{
    Condition{.name = "healthy", .is_damaged = false},
    Condition{.name = "damaged"},
    Condition{.name = "trial_mass", .has_trial = true},
    Condition{.name = "mid_flight", .onset_s = 20.0},
    Condition{.name = "two_rotors", .two_rotors = true},
    Condition{.name = "file_30_heavier", .mass_factor = 1.3},
    Condition{.name = "file_30_lighter", .mass_factor = 0.7},
    Condition{.name = "late_50ms", .esc_latency_s = 0.05},
    Condition{.name = "dropouts_20", .esc_dropout_ratio = 0.2},
    Condition{.name = "slow_coarse", .esc_rate_Hz = 50.0, .esc_resolution_rpm = 100.0},
    Condition{.name = "averaged_200Hz", .averaged = true},
    Condition{.name = "averaged_200Hz_healthy", .is_damaged = false, .averaged = true},
    Condition{.name = "still_air", .still = true},
    Condition{.name = "no_speeds", .has_speeds = false, .flight_s = 120.0},
    Condition{.name = "no_speeds_healthy", .is_damaged = false, .has_speeds = false, .flight_s = 120.0},
    Condition{.name = "hours", .is_damaged = false, .flight_s = 600.0},
};

Realism realism_of(const Condition& condition) {
  Realism realism = Realism::at(Level::kHard);
  if (condition.esc_latency_s >= 0.0) realism.esc.latency_s = condition.esc_latency_s;
  if (condition.esc_dropout_ratio >= 0.0) realism.esc.dropout_ratio = condition.esc_dropout_ratio;
  if (condition.esc_rate_Hz > 0.0) realism.esc.rate_Hz = condition.esc_rate_Hz;
  if (condition.esc_resolution_rpm > 0.0) realism.esc.resolution_rpm = condition.esc_resolution_rpm;
  if (condition.averaged) {
    realism.imu.rate_Hz = 200.0;
    realism.imu.averaging_window_s = 0.005;
  }
  if (condition.still) {
    realism.wind.mean_m_s = 0.0;
    realism.motor.speed_error_ratio = 0.0;
    realism.rotor.thrust_error_ratio = 0.0;
    realism.airframe.centre_of_mass_m_per_m = 0.0;
    realism.airframe.thrust_axis_error_rad = 0.0;
  }
  return realism;
}

Scenario plan(Manoeuvre manoeuvre, double flight_s, double interval_s) {
  Scenario scenario;
  scenario.segments = {{.manoeuvre = Manoeuvre::kGround, .duration_s = kGround_s},
                       {.manoeuvre = Manoeuvre::kTakeOff, .duration_s = kTakeOff_s, .height_m = 3.0},
                       {.manoeuvre = manoeuvre,
                        .duration_s = flight_s,
                        .speed_m_s = manoeuvre == Manoeuvre::kRandom ? 2.0 : 1.0,
                        .interval_s = interval_s}};
  return scenario;
}

template <std::size_t N>
UnbalanceFlightJudge<N> flown(const Multirotor& vehicle, const Scenario& scenario, const Realism& realism,
                              Seeds seeds, const UnbalanceParams& params, bool has_speeds) {
  UnbalanceFlightJudge<N> judge{params, has_speeds};
  Simulation simulation{vehicle, scenario, realism, seeds};
  while (simulation.time_s() < scenario.duration_s()) simulation.step(judge);
  return judge;
}

/// What the calibration command would learn from one healthy flight of this vehicle, and one with a trial mass.
template <std::size_t N>
UnbalanceParams calibrated(const Multirotor& vehicle, const Condition& condition, const Realism& realism,
                           std::uint64_t seed, double damage_mg) {
  UnbalanceParams params;
  params.vehicle = vehicle;
  params.vehicle.mass_kg *= condition.mass_factor;
  params.smallest_m_s2 = 0.3;
  params.usual_m_s2 = 0.6;
  params.low_pass_Hz =
      realism.imu.filter_cutoff_Hz;  // as an integrator writes it, from the autopilot's settings
  params.speed_latency_s =
      std::min(0.06, 0.004 * std::round(realism.esc.latency_s / 0.004));  // the command's grid
  auto healthy = flown<N>(vehicle, plan(Manoeuvre::kRandom, kCalibration_s, 2.3), realism,
                          Seeds{seed, 100'000 + seed}, params, true);
  params.has_baseline = true;
  params.baseline_power = healthy.monitor().powers();
  for (std::size_t i = 0; i < N; ++i) {
    params.baseline_m_s2[i] = healthy.mean_m_s2(i);
    params.baseline_sigma_m_s2[i] = healthy.sigma_m_s2(i);
  }
  if (!condition.has_trial) return params;
  Scenario trial = plan(Manoeuvre::kRandom, kTrial_s, 2.3);
  trial.faults = {{.kind = FaultKind::kUnbalance, .rotor = 1, .magnitude = kTrialTimes * damage_mg}};
  const auto loaded = flown<N>(vehicle, trial, realism, Seeds{seed, 200'000 + seed}, params, true);
  const double moment_kg_m = 1e-6 * kTrialTimes * damage_mg * vehicle.propeller_radius_m;
  params.response *=
      (loaded.mean_m_s2(0) - params.baseline_m_s2[0]) * UnbalanceMonitor::kg_m_per_m_s2(params) / moment_kg_m;
  return params;
}

template <std::size_t N>
void print(const Condition& condition, const Vehicle& of, const char* manoeuvre, std::uint64_t seed,
           const std::vector<std::size_t>& damaged, const UnbalanceFlightJudge<N>& judge,
           const UnbalanceParams& params) {
  const double mg_per_m_s2 =
      1e6 * UnbalanceMonitor::kg_m_per_m_s2(params) / params.vehicle.propeller_radius_m;
  std::string truth;
  std::string named;
  std::string readings;
  for (const std::size_t rotor : damaged) truth += (truth.empty() ? "" : " ") + std::to_string(rotor + 1);
  for (std::size_t i = 0; i < N; ++i) {
    char text[64];
    if (!std::isnan(judge.raised_s[i])) {
      std::snprintf(text, sizeof text, "%s%zu@%.2f", named.empty() ? "" : " ", i + 1,
                    judge.raised_s[i] - std::max(condition.onset_s, judge.airborne_s));
      named += text;
    }
    std::snprintf(text, sizeof text, "%s%.2f", readings.empty() ? "" : " ",
                  mg_per_m_s2 * judge.growth_m_s2[i]);
    readings += text;
  }
  std::printf("%s;%s;%s;%llu;%s;%s;%.1f;%s;%d;%.1f;%.1f\n", condition.name, of.name, manoeuvre,
              static_cast<unsigned long long>(seed), truth.c_str(), named.c_str(), of.damage_mg,
              readings.c_str(), std::isnan(judge.ambiguous_s) ? 0 : 1, judge.judged_s, judge.confounded_s);
  std::fflush(stdout);
}

template <std::size_t N>
void run(const Multirotor& vehicle, const Condition& condition, const Vehicle& of, const char* manoeuvre_word,
         std::uint64_t first, std::uint64_t count) {
  const std::string_view word = manoeuvre_word;
  const Manoeuvre manoeuvre = word == "circle"  ? Manoeuvre::kCircle
                              : word == "hover" ? Manoeuvre::kHover
                                                : Manoeuvre::kRandom;
  const Realism realism = realism_of(condition);
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const UnbalanceParams params = calibrated<N>(vehicle, condition, realism, seed, of.damage_mg);
    Scenario scenario = plan(manoeuvre, condition.flight_s, 3.0);
    std::vector<std::size_t> damaged;
    if (condition.is_damaged) damaged.push_back(seed % N);
    if (condition.is_damaged && condition.two_rotors) damaged.push_back((seed + 1 + seed / N % (N - 1)) % N);
    for (const std::size_t rotor : damaged) {
      scenario.faults.push_back({.kind = FaultKind::kUnbalance,
                                 .onset_s = condition.onset_s,
                                 .rotor = rotor + 1,
                                 .magnitude = of.damage_mg});
    }
    print(condition, of, manoeuvre_word, seed, damaged,
          flown<N>(vehicle, scenario, realism, Seeds{seed, 300'000 + seed}, params, condition.has_speeds),
          params);
  }
}

int main_of(char** argv) {
  const auto condition = std::find_if(kConditions.begin(), kConditions.end(), [&](const Condition& one) {
    return std::string_view{one.name} == argv[1];
  });
  const auto vehicle = std::find_if(kVehicles.begin(), kVehicles.end(), [&](const Vehicle& one) {
    return std::string_view{one.name} == argv[2];
  });
  if (condition == kConditions.end() || vehicle == kVehicles.end()) {
    std::fputs("unbalance_isolation: no such condition or vehicle\n", stderr);
    return 2;
  }
  const auto file =
      rt::VehicleFile::load(std::string{AIRWORTHY_CONFIG} + "/vehicles/unbalance_" + vehicle->name + ".toml");
  if (!file || !file->multirotor) {
    std::fprintf(stderr, "unbalance_isolation: no multirotor %s\n", vehicle->name);
    return 1;
  }
  const auto first = std::strtoull(argv[4], nullptr, 10);
  const auto count = std::strtoull(argv[5], nullptr, 10);
  if (file->multirotor->rotor_count == 6) {
    run<6>(*file->multirotor, *condition, *vehicle, argv[3], first, count);
  } else {
    run<4>(*file->multirotor, *condition, *vehicle, argv[3], first, count);
  }
  return 0;
}

}  // namespace
}  // namespace airworthy::sim

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fputs("usage: unbalance_isolation CONDITION VEHICLE MANOEUVRE FIRST_SEED COUNT\n", stderr);
    return 2;
  }
  return airworthy::sim::main_of(argv);
}
