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

const char* kind_name(effectiveness::LossKind kind) {
  switch (kind) {
    case effectiveness::LossKind::kPropellerLost:
      return "propeller_lost";
    case effectiveness::LossKind::kPartialLoss:
      return "partial_loss";
    case effectiveness::LossKind::kOverEffective:
      return "over_effective";
  }
  return "";
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
    std::printf(" %s", outcome.ours.empty() ? "-" : kind_name(outcome.ours.front().kind));
    say(outcome.faithful, flight.fault->onset_s);
    if (outcome.clairvoyant_s) {
      std::printf(" %.1f\n", 1e3 * (*outcome.clairvoyant_s - flight.fault->onset_s));
    } else {
      std::printf(" -\n");
    }
    std::fflush(stdout);
  }
}

// Each line: number, vehicle, manoeuvre, rotor, loss, whether it was found, then rotor, ms since the return, k of the first
// verdict after it; dashes without one.
void returning(std::size_t first, std::size_t flights, double loss, Telemetry telemetry) {
  for (std::size_t n = first; n < first + flights; ++n) {
    EffectivenessFlight flight = draw(n, FaultKind::kPartialLoss, loss, true, telemetry);
    flight.fault->end_s = flight.fault->onset_s + 4.0;
    flight.give_up_s = 8.0;
    flight.duration_s = 40.0;
    auto outcome = fly(flight, effectiveness_params(flight.vehicle));
    const auto is_before = [&flight](const Said& said) { return said.time_s < flight.fault->end_s; };
    const bool is_found = !outcome.ours.empty() && is_before(outcome.ours.front());
    std::erase_if(outcome.ours, is_before);
    std::printf("%zu %s %s %zu %.2f %d", n, kVehicles[n % kVehicles.size()],
                kManoeuvreNames[n / kVehicles.size() % kManoeuvres.size()], flight.fault->rotor, loss,
                is_found ? 1 : 0);
    say(outcome.ours, flight.fault->end_s);
    std::printf("\n");
    std::fflush(stdout);
  }
}

// Each line: number, vehicle, manoeuvre, rotor, excess, then rotor, s since lift-off or onset, k and kind of the first
// alarm; dashes without one. onset_s 0: a wrong propeller was mounted on the ground.
void over_effective(std::size_t first, std::size_t flights, double excess, double onset_s, double give_up_s,
                    Telemetry telemetry) {
  for (std::size_t n = first; n < first + flights; ++n) {
    EffectivenessFlight flight = draw(n, FaultKind::kOverEffective, excess, true, telemetry);
    flight.fault->onset_s = onset_s;
    flight.give_up_s = give_up_s;
    flight.duration_s = onset_s + give_up_s;
    const auto outcome = fly(flight, effectiveness_params(flight.vehicle));
    std::printf("%zu %s %s %zu %.2f", n, kVehicles[n % kVehicles.size()],
                kManoeuvreNames[n / kVehicles.size() % kManoeuvres.size()], flight.fault->rotor, excess);
    if (outcome.ours.empty()) {
      std::printf(" - - - -\n");
    } else {
      const Said& said = outcome.ours.front();
      std::printf(" %zu %.3f %.3f %s\n", said.rotor + 1, said.time_s - std::max(onset_s, outcome.lift_off_s),
                  said.effectiveness, kind_name(said.kind));
    }
    std::fflush(stdout);
  }
}

// Each line: number, vehicle, manoeuvre, mask of the rotors described wrongly (0: the file is right), then mask said, whether
// it was named, s since lift-off, evidence, and how many rotors were blamed.
void wrong_spin(std::size_t first, std::size_t flights, double duration_s, Telemetry telemetry) {
  for (std::size_t n = first; n < first + flights; ++n) {
    EffectivenessFlight flight = draw(n, FaultKind::kOverEffective, 0.0, false, telemetry);
    flight.duration_s = duration_s;
    Multirotor described = flight.vehicle;
    const std::size_t count = described.rotor_count;
    const std::size_t round = n / kVehicles.size();
    // In turn: nothing wrong, one rotor, two neighbours that were exchanged, all.
    std::uint32_t wrong = 0;
    if (round % 4 == 1) wrong = 1U << (round / 4 % count);
    if (round % 4 == 2) wrong = (1U << (round / 4 % count)) | (1U << ((round / 4 + 1) % count));
    if (round % 4 == 3) wrong = (1U << count) - 1;
    for (std::size_t i = 0; i < count; ++i) {
      if ((wrong >> i) & 1U) described.rotor[i].spin = -described.rotor[i].spin;
    }
    const auto outcome = fly(flight, effectiveness_params(described));
    std::printf("%zu %s %s %x %x %d %.1f %.1f %zu\n", n, kVehicles[n % kVehicles.size()],
                kManoeuvreNames[n / kVehicles.size() % kManoeuvres.size()], wrong,
                outcome.wrong_spin.value_or(0), outcome.is_spin_named ? 1 : 0,
                outcome.wrong_spin ? outcome.wrong_spin_s - outcome.lift_off_s : 0.0, outcome.spin_evidence,
                outcome.ours.size());
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
    if (outcome.wrong_spin) std::printf(" spin:%x", *outcome.wrong_spin);
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
  } else if (args.size() == 4 && args[0] == "returns") {
    returning(number(1), number(2), std::stod(args[3]), telemetry);
  } else if (args.size() == 6 && args[0] == "over") {
    over_effective(number(1), number(2), std::stod(args[3]), std::stod(args[4]), std::stod(args[5]),
                   telemetry);
  } else if (args.size() == 4 && args[0] == "spin") {
    wrong_spin(number(1), number(2), std::stod(args[3]), telemetry);
  } else if (args.size() == 5 && args[0] == "healthy") {
    healthy(number(1), number(2), static_cast<int>(number(3)), std::stod(args[4]), telemetry);
  } else {
    std::fprintf(stderr,
                 "usage: effectiveness_evidence [--without-telemetry] lost FIRST N | partial FIRST N LOSS | "
                 "returns FIRST N LOSS | over FIRST N EXCESS ONSET GIVE_UP | "
                 "spin FIRST N SECONDS | healthy FIRST N CYCLES SECONDS\n");
    return 64;
  }
  return 0;
}
