#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "sim/random.h"
#include "tests/sim/effectiveness_flights.h"
#include "tests/sim/vehicles.h"

// Simulated flights for docs/evidence_effectiveness.md. See tools/evidence_effectiveness.py, which runs it.

namespace airworthy::sim {
namespace {

constexpr std::array kManoeuvres{Manoeuvre::kHover, Manoeuvre::kCircle, Manoeuvre::kRandom};
constexpr std::array kManoeuvreNames{"hover", "circle", "random"};

/// Whether the rotors report their speeds; without, the detector has the commands alone.
enum class Telemetry { kReported, kNone };

EffectivenessFlight draw(std::size_t number, FaultKind kind, double magnitude, bool has_fault,
                         Telemetry telemetry) {
  const std::string name = kVehicles[number % kVehicles.size()];
  Random random{number, "effectiveness evidence"};
  EffectivenessFlight flight;
  flight.vehicle = vehicle_named(name);
  flight.manoeuvre = kManoeuvres[number / kVehicles.size() % kManoeuvres.size()];
  flight.realism = Realism::at(Level::kHard);
  flight.realism.wind.mean_m_s = random.uniform(0.0, 10.0);
  flight.seed = 1000 + number;
  if (telemetry == Telemetry::kNone) flight.telemetry_until_s = 0.0;
  if (has_fault) {
    Fault fault;
    fault.kind = kind;
    fault.rotor = 1 + number / 3 % flight.vehicle.rotor_count;
    fault.onset_s = 7.0 + random.uniform(0.0, 5.0);
    fault.magnitude = magnitude;
    flight.fault = fault;
    flight.duration_s = 20.0;
  }
  return flight;
}

/// Rotor, delay in ms, effectiveness of the first alarm, or dashes.
void say(const std::vector<Said>& said, double onset_s) {
  if (said.empty()) {
    std::printf(" - - -");
  } else {
    std::printf(" %zu %.1f %.3f", said.front().rotor + 1, 1e3 * (said.front().time_s - onset_s),
                said.front().effectiveness);
  }
}

// Each line: number, vehicle, manoeuvre, rotor, size, whether judged at the onset, ours, its kind, published, clairvoyant.
void faulty(std::size_t first, std::size_t flights, FaultKind kind, double magnitude, Telemetry telemetry) {
  for (std::size_t n = first; n < first + flights; ++n) {
    EffectivenessFlight flight = draw(n, kind, magnitude, true, telemetry);
    if (kind == FaultKind::kPartialLoss) {
      flight.give_up_s = 10.0;
      flight.duration_s = 40.0;
    }
    const auto outcome = fly(flight, effectiveness_params(flight.vehicle));
    std::printf("%zu %s %s %zu %.2f %d", n, kVehicles[n % kVehicles.size()],
                kManoeuvreNames[n / kVehicles.size() % kManoeuvres.size()], flight.fault->rotor, magnitude,
                outcome.was_judging ? 1 : 0);
    say(outcome.ours, flight.fault->onset_s);
    const bool is_lost =
        !outcome.ours.empty() && outcome.ours.front().kind == effectiveness::LossKind::kPropellerLost;
    std::printf(" %s", outcome.ours.empty() ? "-" : is_lost ? "propeller_lost" : "partial_loss");
    say(outcome.faithful, flight.fault->onset_s);
    if (outcome.clairvoyant_s) {
      std::printf(" %.1f\n", 1e3 * (*outcome.clairvoyant_s - flight.fault->onset_s));
    } else {
      std::printf(" -\n");
    }
    std::fflush(stdout);
  }
}

// Each line: number, vehicle, manoeuvre, s off the ground, s judged, take-offs, alarms of ours, of the published filter.
void healthy(std::size_t first, std::size_t flights, int cycles, double duration_s, Telemetry telemetry) {
  for (std::size_t n = first; n < first + flights; ++n) {
    EffectivenessFlight flight = draw(n, FaultKind::kPropellerLost, 0.0, false, telemetry);
    flight.cycles = cycles;
    flight.duration_s = duration_s;
    const auto outcome = fly(flight, effectiveness_params(flight.vehicle));
    std::printf("%zu %s %s %.1f %.1f %d %zu %zu", n, kVehicles[n % kVehicles.size()],
                kManoeuvreNames[n / kVehicles.size() % kManoeuvres.size()], outcome.flown_s, outcome.judged_s,
                outcome.take_offs, outcome.ours.size(), outcome.faithful.size());
    for (const Said& said : outcome.ours) {
      std::printf(" ours:%zu@%.3f:%.2f", said.rotor + 1, said.time_s, said.effectiveness);
    }
    for (const Said& said : outcome.faithful) std::printf(" published:%zu@%.3f", said.rotor + 1, said.time_s);
    std::printf("\n");
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace airworthy::sim

int main(int argc, char** argv) {
  using namespace airworthy::sim;
  std::vector<std::string> args(argv + 1, argv + argc);
  Telemetry telemetry = Telemetry::kReported;
  if (!args.empty() && args.front() == "--without-telemetry") {
    telemetry = Telemetry::kNone;
    args.erase(args.begin());
  }
  const auto number = [&](std::size_t i) { return static_cast<std::size_t>(std::stoul(args.at(i))); };
  if (args.size() == 3 && args[0] == "lost") {
    faulty(number(1), number(2), FaultKind::kPropellerLost, 1.0, telemetry);
  } else if (args.size() == 4 && args[0] == "partial") {
    faulty(number(1), number(2), FaultKind::kPartialLoss, std::stod(args[3]), telemetry);
  } else if (args.size() == 5 && args[0] == "healthy") {
    healthy(number(1), number(2), static_cast<int>(number(3)), std::stod(args[4]), telemetry);
  } else {
    std::fprintf(stderr,
                 "usage: effectiveness_evidence [--without-telemetry] lost FIRST N | partial FIRST N LOSS | "
                 "healthy FIRST N CYCLES SECONDS\n");
    return 64;
  }
  return 0;
}
