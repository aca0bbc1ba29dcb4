// Simulated flights of the unbalance paper's experiments at hard realism, judged by the signal-power filter. Prints one
// line of comma-separated values for each flight and source of rotor speeds; tools/evidence makes the page of them.
// Usage: unbalance_power EXPERIMENT FIRST_SEED COUNT
#include <cstdio>
#include <cstdlib>
#include <string>

#include "runtime/config/vehicle.h"
#include "tests/support/unbalance_trial.h"

namespace airworthy::sim {
namespace {

struct Experiment {
  const char* name;
  const char* vehicle;
  double damage_mg;
  double initial_mg;
  double duration_s;
  double filter_cutoff_Hz;  ///< of the accelerometer; 0 = as at hard
};
// The second of the small vehicle: hard but for the accelerometer, whose filter leaves its rotor speed (242 Hz) alone.
constexpr std::array kExperiments{Experiment{"small", "unbalance_small", 5.0, 2.0, 60.0, 0.0},
                                  Experiment{"small_open", "unbalance_small", 5.0, 2.0, 60.0, 500.0},
                                  Experiment{"medium", "unbalance_medium", 40.0, 20.0, 150.0, 0.0},
                                  Experiment{"hexa", "unbalance_hexa", 40.0, 20.0, 240.0, 0.0}};

constexpr double kTakeOff_s = 6.0;
constexpr std::size_t kDamaged = 1;  // the second rotor of the file

Scenario plan(Manoeuvre manoeuvre, double duration_s, double damage_mg) {
  Scenario scenario;
  scenario.segments = {
      Segment{.manoeuvre = Manoeuvre::kGround, .duration_s = 1.0},
      Segment{.manoeuvre = Manoeuvre::kTakeOff, .duration_s = kTakeOff_s - 1.0, .height_m = 3.0}};
  Segment segment{.manoeuvre = manoeuvre, .duration_s = duration_s};
  if (manoeuvre == Manoeuvre::kRandom) segment.speed_m_s = 2.0;
  scenario.segments.push_back(segment);
  if (damage_mg > 0.0) {
    scenario.faults.push_back(Fault{
        .kind = FaultKind::kUnbalance, .rotor = kDamaged + 1, .magnitude = damage_mg, .angle_rad = 0.0});
  }
  return scenario;
}

// The healthy flight before: another plan, so that neither set-points nor gusts meet the same moments again.
Scenario baseline_plan(double duration_s) {
  Scenario scenario = plan(Manoeuvre::kRandom, duration_s, 0.0);
  scenario.segments.back().interval_s = 2.3;
  scenario.segments.insert(scenario.segments.end() - 1,
                           Segment{.manoeuvre = Manoeuvre::kHover, .duration_s = 7.7});
  return scenario;
}

template <std::size_t N>
using Baseline = std::array<std::array<double, N>, kSources.size()>;

template <std::size_t N>
SignalPowerTrial<N> flown(const Multirotor& vehicle, const Experiment& experiment, const Scenario& scenario,
                          std::uint64_t seed, const Baseline<N>& baseline) {
  Realism realism = Realism::at(Level::kHard);
  if (experiment.filter_cutoff_Hz > 0.0) realism.imu.filter_cutoff_Hz = experiment.filter_cutoff_Hz;
  // An integrator knows this filter from the autopilot's parameters; a source below uses it or not.
  SignalPowerTrial<N> trial{vehicle,
                            {.initial_tip_mass_mg = experiment.initial_mg,
                             .filter_cutoff_Hz = realism.imu.filter_cutoff_Hz,
                             .begin_s = kTakeOff_s},
                            baseline};
  Simulation simulation{vehicle, scenario, realism, seed};
  while (simulation.time_s() < scenario.duration_s()) simulation.step(trial);
  return trial;
}

template <std::size_t N>
void print(const Experiment& experiment, std::uint64_t seed, const char* flight, double damage_mg,
           const SignalPowerTrial<N>& trial, const SignalPowerTrial<N>& healthy) {
  constexpr std::array kNames{"command", "telemetry", "telemetry, filter known"};
  for (std::size_t k = 0; k < kSources.size(); ++k) {
    const auto& trace = trial.trace(k);
    const Verdict by_ekf = ekf_verdict(trace, healthy.trace(k), experiment.initial_mg);
    const Verdict by_evidence = evidence_verdict(trace);
    const auto& last = trace.back();
    double healthy_mg = 0.0;
    for (std::size_t i = 0; i < N; ++i)
      healthy_mg += i == kDamaged ? 0.0 : last.ekf_mg[i] / static_cast<double>(N - 1);
    std::printf("%s;%llu;%s;%g;%s;%d;%.1f;%d;%.1f;%.2f;%.2f;%.2f;%.3f;%.1f\n", experiment.name,
                static_cast<unsigned long long>(seed), flight, damage_mg, kNames[k], by_ekf.rotor,
                by_ekf.time_s, by_evidence.rotor, by_evidence.time_s, last.ekf_mg[kDamaged], healthy_mg,
                last.culprit_mg[kDamaged], trial.mean_nis(k), by_evidence.most_lasting_lead);
  }
}

template <std::size_t N>
void run(const Multirotor& vehicle, const Experiment& experiment, std::uint64_t first, std::uint64_t count) {
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const auto before = flown<N>(vehicle, experiment, baseline_plan(experiment.duration_s), seed, {});
    Baseline<N> baseline{};
    for (std::size_t k = 0; k < kSources.size(); ++k) baseline[k] = before.filter(k).powers();
    for (const auto& [manoeuvre, name] :
         {std::pair{Manoeuvre::kRandom, "random"}, std::pair{Manoeuvre::kCircle, "circle"}}) {
      for (const double damage_mg : {0.0, experiment.damage_mg}) {
        const Scenario scenario = plan(manoeuvre, experiment.duration_s, damage_mg);
        print(experiment, seed, name, damage_mg, flown<N>(vehicle, experiment, scenario, seed, baseline),
              before);
      }
    }
    std::fflush(stdout);
  }
}

int main_of(const std::string& name, std::uint64_t first, std::uint64_t count) {
  for (const Experiment& experiment : kExperiments) {
    if (name != experiment.name) continue;
    const auto file =
        rt::VehicleFile::load(std::string{AIRWORTHY_CONFIG} + "/vehicles/" + experiment.vehicle + ".toml");
    if (!file || !file->multirotor) {
      std::fprintf(stderr, "unbalance_power: no multirotor %s\n", experiment.vehicle);
      return 1;
    }
    if (file->multirotor->rotor_count == 6) {
      run<6>(*file->multirotor, experiment, first, count);
    } else {
      run<4>(*file->multirotor, experiment, first, count);
    }
    return 0;
  }
  std::fprintf(stderr, "unbalance_power: no experiment %s\n", name.c_str());
  return 1;
}

}  // namespace
}  // namespace airworthy::sim

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fputs("usage: unbalance_power EXPERIMENT FIRST_SEED COUNT\n", stderr);
    return 2;
  }
  return airworthy::sim::main_of(argv[1], std::strtoull(argv[2], nullptr, 10),
                                 std::strtoull(argv[3], nullptr, 10));
}
