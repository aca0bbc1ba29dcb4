// Simulated flights of damaged and healthy vehicles at hard realism, judged by the unbalance monitor with a calibration of
// the same vehicle from other flights. Prints one line of values for each flight; tools/evidence makes the page of them.
// Usage: unbalance_isolation VEHICLE SEED CONDITION:MANOEUVRE...
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>

#include "core/detectors/unbalance/rigid_body_response.h"
#include "runtime/config/vehicle.h"
#include "tests/support/unbalance_flight_judge.h"

namespace airworthy::sim {
namespace {

constexpr double kGround_s = 2.0;
constexpr double kTakeOff_s = 4.0;
constexpr double kCalibration_s = 60.0;
constexpr double kLongCalibration_s = 180.0;
constexpr double kLeastJudged_s = 20.0;  // of every rotor, for a calibration
constexpr double kTrial_s = 40.0;
constexpr double kTrialTimes = 5.0;   // the damage
constexpr double kTrialSigma = 0.02;  // of the amplitude of two trials, of itself

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
  bool still = false;  ///< no wind, no errors of motors, rotors and thrust axes; those of the autopilot stay
  bool alike = false;  ///< Realism::with_rotors_alike()
  double damage_times = 1.0;
  bool has_trial = false;
  bool has_speeds = true;
  double flight_s = 40.0;
  std::optional<double> angle_rad{};  ///< of the damage, from the natural unbalance; empty: any
};
constexpr std::array kConditions{
    Condition{.name = "healthy", .is_damaged = false},
    Condition{.name = "in_phase", .angle_rad = 0.0},
    Condition{.name = "in_phase_trial_mass", .has_trial = true, .angle_rad = 0.0},
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
    Condition{.name = "rotors_alike", .alike = true},
    Condition{.name = "rotors_alike_x5", .alike = true, .damage_times = 5.0},
    Condition{.name = "no_speeds", .has_speeds = false, .flight_s = 120.0, .angle_rad = 0.0},
    Condition{.name = "no_speeds_healthy", .is_damaged = false, .has_speeds = false, .flight_s = 120.0},
    Condition{.name = "hours", .is_damaged = false, .flight_s = 600.0},
};

/// What a calibration depends on.
using Link = std::tuple<double, double, double, double, double, bool>;
Link link_of(const Condition& condition) {
  return {condition.mass_factor, condition.esc_latency_s,      condition.esc_dropout_ratio,
          condition.esc_rate_Hz, condition.esc_resolution_rpm, condition.averaged};
}

/// Of the air in which a vehicle is calibrated; its links are those of the condition.
Realism calibration_realism_of(const Condition& condition) {
  Realism realism = Realism::at(Level::kHard);
  if (condition.esc_latency_s >= 0.0) realism.esc.latency_s = condition.esc_latency_s;
  if (condition.esc_dropout_ratio >= 0.0) realism.esc.dropout_ratio = condition.esc_dropout_ratio;
  if (condition.esc_rate_Hz > 0.0) realism.esc.rate_Hz = condition.esc_rate_Hz;
  if (condition.esc_resolution_rpm > 0.0) realism.esc.resolution_rpm = condition.esc_resolution_rpm;
  if (condition.averaged) {
    realism.imu.rate_Hz = 200.0;
    realism.imu.averaging_window_s = 0.005;
  }
  return realism;
}

Realism realism_of(const Condition& condition) {
  Realism realism = calibration_realism_of(condition);
  if (condition.alike) return realism.with_rotors_alike();
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
struct Flown {
  UnbalanceFlightJudge<N> judge;
  std::array<double, N> unbalance_kg_m{};  ///< of each propeller at the end, in truth
};

template <std::size_t N>
Flown<N> flown(const Multirotor& vehicle, const Scenario& scenario, const Realism& realism, Seeds seeds,
               const UnbalanceParams& params, bool has_speeds) {
  Flown<N> flight{UnbalanceFlightJudge<N>{params, has_speeds}};
  Simulation simulation{vehicle, scenario, realism, seeds};
  while (simulation.time_s() < scenario.duration_s()) simulation.step(flight.judge);
  for (std::size_t i = 0; i < N; ++i) flight.unbalance_kg_m[i] = simulation.unbalance_kg_m(i);
  return flight;
}

/// What the calibration command would learn from one healthy flight of a vehicle.
template <std::size_t N>
struct Learned {
  UnbalanceParams params;
  std::array<double, N> natural_kg_m{};  ///< in truth
};

template <std::size_t N>
Learned<N> calibrated(const Multirotor& vehicle, const Condition& condition, std::uint64_t seed) {
  const Realism realism = calibration_realism_of(condition);
  UnbalanceParams params;
  params.vehicle = vehicle;
  params.vehicle.mass_kg *= condition.mass_factor;
  params.smallest_m_s2 = 0.3;
  params.usual_m_s2 = 0.6;
  params.low_pass_Hz =
      realism.imu.filter_cutoff_Hz;  // as an integrator writes it, from the autopilot's settings
  params.speed_latency_s =
      std::min(0.06, 0.004 * std::round(realism.esc.latency_s / 0.004));  // the command's grid
  const auto healthy_flight = [&](double flight_s) {
    return flown<N>(vehicle, plan(Manoeuvre::kRandom, flight_s, 2.3), calibration_realism_of(condition),
                    Seeds{seed, 100'000 + seed}, params, true);
  };
  Flown<N> healthy = healthy_flight(kCalibration_s);
  // What the command asks for, too, where it learned too little.
  if (healthy.judge.least_judged_s() < kLeastJudged_s) healthy = healthy_flight(kLongCalibration_s);
  params.speed_error_ratio = healthy.judge.monitor().innovation().speed_error_ratio;
  params.most_speed_error_ratio = 0.002;
  params.baseline_power_m2_s4 = healthy.judge.monitor().powers().m2_s4;
  // Else the command refuses, and the vehicle flies uncalibrated.
  params.has_baseline = healthy.judge.least_judged_s() >= kLeastJudged_s;
  if (!params.has_baseline) return {params, healthy.unbalance_kg_m};
  params.against_ratio = healthy.judge.against_ratio();
  for (std::size_t i = 0; i < N; ++i) {
    params.baseline_m_s2[i] = healthy.judge.mean_m_s2(i);
    params.baseline_sigma_m_s2[i] = healthy.judge.sigma_m_s2(i);
  }
  return {params, healthy.unbalance_kg_m};
}

/// Two flights with a trial mass on rotor 1, once on either blade.
template <std::size_t N>
void learn_response(const Multirotor& vehicle, const Condition& condition, std::uint64_t seed,
                    double damage_mg, UnbalanceParams& params) {
  double power = -params.baseline_m_s2[0] * params.baseline_m_s2[0];
  for (const double half_turn : {0.0, 1.0}) {
    Scenario trial = plan(Manoeuvre::kRandom, kTrial_s, 2.3);
    constexpr double kBlade_rad = 0.7;  // where it is stuck, as seen from the natural unbalance: anywhere
    trial.faults = {{.kind = FaultKind::kUnbalance,
                     .rotor = 1,
                     .magnitude = kTrialTimes * damage_mg,
                     .angle_rad = kBlade_rad + half_turn * std::numbers::pi}};
    const auto flight_seed = 200'000 + 1'000 * static_cast<std::uint64_t>(half_turn) + seed;
    const Flown<N> loaded =
        flown<N>(vehicle, trial, calibration_realism_of(condition), Seeds{seed, flight_seed}, params, true);
    power += 0.5 * loaded.judge.mean_m_s2(0) * loaded.judge.mean_m_s2(0);
  }
  const double moment_kg_m = 1e-6 * kTrialTimes * damage_mg * vehicle.propeller_radius_m;
  params.response *= std::sqrt(power) * UnbalanceMonitor::kg_m_per_m_s2(params, 0) / moment_kg_m;
  for (std::size_t i = 0; i < N; ++i) {
    params.response_sigma_ratio[i] =
        std::hypot(kTrialSigma, response_transfer_sigma(params.vehicle, 0, i, params.against_ratio));
  }
}

/// "1 3" of a mask.
std::string numbers_of(std::uint32_t mask) {
  std::string text;
  for (std::uint32_t i = 0; i < kMaxRotors; ++i) {
    if ((mask >> i & 1U) != 0U) text += (text.empty() ? "" : " ") + std::to_string(i + 1);
  }
  return text;
}

std::string joined(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) {
    char one[32];
    std::snprintf(one, sizeof one, "%s%.3f", text.empty() ? "" : " ", value);
    text += one;
  }
  return text;
}

template <std::size_t N>
void print(const Condition& condition, const Vehicle& of, const char* manoeuvre, std::uint64_t seed,
           const std::vector<std::size_t>& damaged, const Flown<N>& flight, const Learned<N>& learned,
           const UnbalanceParams& params) {
  const UnbalanceFlightJudge<N>& judge = flight.judge;
  const double mg_per_kg_m = 1e6 / params.vehicle.propeller_radius_m;
  std::uint32_t truth = 0;
  std::string named;
  std::vector<double> true_mg;
  std::vector<double> felt_m_s2;
  std::vector<double> reading_mg;
  std::vector<double> low_mg;
  std::vector<double> high_mg;
  for (const std::size_t rotor : damaged) truth |= 1U << rotor;
  for (std::size_t i = 0; i < N; ++i) {
    if (!std::isnan(judge.raised_s[i])) {
      char text[64];
      std::snprintf(text, sizeof text, "%s%zu@%.2f", named.empty() ? "" : " ", i + 1,
                    judge.raised_s[i] - std::max(condition.onset_s, judge.airborne_s));
      named += text;
    }
    const double grown_kg_m = flight.unbalance_kg_m[i] - learned.natural_kg_m[i];
    // What the reading is of: without a calibration, of the whole unbalance.
    true_mg.push_back(mg_per_kg_m * (params.has_baseline ? grown_kg_m : flight.unbalance_kg_m[i]));
    felt_m_s2.push_back(grown_kg_m / UnbalanceMonitor::kg_m_per_m_s2(learned.params, i));
    reading_mg.push_back(mg_per_kg_m * judge.reading[i].growth_kg_m);
    low_mg.push_back(mg_per_kg_m * judge.reading[i].low_kg_m);
    high_mg.push_back(mg_per_kg_m * judge.reading[i].high_kg_m);
  }
  std::printf("%s;%s;%s;%llu;%s;%s;%s;%s;%s;%s;%s;%s;%.1f;%.1f\n", condition.name, of.name, manoeuvre,
              static_cast<unsigned long long>(seed), numbers_of(truth).c_str(), named.c_str(),
              joined(true_mg).c_str(), joined(felt_m_s2).c_str(), joined(reading_mg).c_str(),
              joined(low_mg).c_str(), joined(high_mg).c_str(),
              std::isnan(judge.ambiguous_s) ? "" : numbers_of(judge.candidates).c_str(), judge.judged_s,
              judge.confounded_s);
  std::fflush(stdout);
}

/// All flights of one vehicle; what its links have in common is calibrated once.
template <std::size_t N>
class Vehicles {
 public:
  Vehicles(const Multirotor& vehicle, const Vehicle& of, std::uint64_t seed)
      : vehicle_{vehicle}, of_{of}, seed_{seed} {}

  void fly(const Condition& condition, const char* manoeuvre_word) {
    const std::string_view word = manoeuvre_word;
    const Manoeuvre manoeuvre = word == "circle"  ? Manoeuvre::kCircle
                                : word == "hover" ? Manoeuvre::kHover
                                                  : Manoeuvre::kRandom;
    const double damage_mg = of_.damage_mg * condition.damage_times;
    const Learned<N>& learned = learned_of(condition);
    UnbalanceParams params = learned.params;
    if (condition.has_trial) {
      if (!tried_) {
        learn_response<N>(vehicle_, condition, seed_, of_.damage_mg, params);
        tried_ = params;
      }
      params = *tried_;
    }
    Scenario scenario = plan(manoeuvre, condition.flight_s, 3.0);
    std::vector<std::size_t> damaged;
    if (condition.is_damaged) damaged.push_back(seed_ % N);
    if (condition.is_damaged && condition.two_rotors)
      damaged.push_back((seed_ + 1 + seed_ / N % (N - 1)) % N);
    for (const std::size_t rotor : damaged) {
      scenario.faults.push_back({.kind = FaultKind::kUnbalance,
                                 .onset_s = condition.onset_s,
                                 .rotor = rotor + 1,
                                 .magnitude = damage_mg,
                                 .angle_rad = condition.angle_rad});
    }
    print(condition, of_, manoeuvre_word, seed_, damaged,
          flown<N>(vehicle_, scenario, realism_of(condition), Seeds{seed_, 300'000 + seed_}, params,
                   condition.has_speeds),
          learned, params);
  }

 private:
  const Learned<N>& learned_of(const Condition& condition) {
    const Link link = link_of(condition);
    const auto known = learned_.find(link);
    if (known != learned_.end()) return known->second;
    return learned_.emplace(link, calibrated<N>(vehicle_, condition, seed_)).first->second;
  }

  Multirotor vehicle_;
  Vehicle of_;
  std::uint64_t seed_;
  std::map<Link, Learned<N>> learned_;
  std::optional<UnbalanceParams> tried_;
};

template <std::size_t N>
int fly_all(const Multirotor& multirotor, const Vehicle& vehicle, std::uint64_t seed, int argc, char** argv) {
  Vehicles<N> vehicles{multirotor, vehicle, seed};
  for (int k = 3; k < argc; ++k) {
    const std::string_view both = argv[k];
    const auto colon = both.find(':');
    const auto condition = std::find_if(kConditions.begin(), kConditions.end(), [&](const Condition& one) {
      return both.substr(0, colon) == one.name;
    });
    if (condition == kConditions.end() || colon == std::string_view::npos) {
      std::fprintf(stderr, "unbalance_isolation: no such condition: %s\n", argv[k]);
      return 2;
    }
    vehicles.fly(*condition, argv[k] + colon + 1);
  }
  return 0;
}

int main_of(int argc, char** argv) {
  const auto vehicle = std::find_if(kVehicles.begin(), kVehicles.end(), [&](const Vehicle& one) {
    return std::string_view{one.name} == argv[1];
  });
  if (vehicle == kVehicles.end()) {
    std::fprintf(stderr, "unbalance_isolation: no such vehicle: %s\n", argv[1]);
    return 2;
  }
  const auto file =
      rt::VehicleFile::load(std::string{AIRWORTHY_CONFIG} + "/vehicles/unbalance_" + vehicle->name + ".toml");
  if (!file || !file->multirotor) {
    std::fprintf(stderr, "unbalance_isolation: no multirotor %s\n", vehicle->name);
    return 1;
  }
  const auto seed = std::strtoull(argv[2], nullptr, 10);
  return file->multirotor->rotor_count == 6 ? fly_all<6>(*file->multirotor, *vehicle, seed, argc, argv)
                                            : fly_all<4>(*file->multirotor, *vehicle, seed, argc, argv);
}

}  // namespace
}  // namespace airworthy::sim

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fputs("usage: unbalance_isolation VEHICLE SEED CONDITION:MANOEUVRE...\n", stderr);
    return 2;
  }
  return airworthy::sim::main_of(argc, argv);
}
