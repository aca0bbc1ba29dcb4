#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>
#include <vector>

#include "tests/sim/effectiveness_flights.h"
#include "tests/sim/vehicles.h"

namespace airworthy::sim {
namespace {

using effectiveness::Muted;

EffectivenessFlight flight_of(const std::string& vehicle, std::uint64_t seed, Manoeuvre manoeuvre) {
  EffectivenessFlight flight;
  flight.vehicle = vehicle_named(vehicle);
  flight.manoeuvre = manoeuvre;
  flight.realism = Realism::at(Level::kHard);
  flight.seed = seed;
  return flight;
}

// docs/evidence_effectiveness.md has the same over 1200 flights.
TEST(Effectiveness, NamesEveryLostPropellerOfEveryVehicleWithinTensOfMilliseconds) {
  std::vector<double> delays_s;
  for (std::size_t vehicle = 0; vehicle < kVehicles.size(); ++vehicle) {
    for (const Manoeuvre manoeuvre : {Manoeuvre::kHover, Manoeuvre::kCircle, Manoeuvre::kRandom}) {
      const std::uint64_t seed = 10 * vehicle + static_cast<std::uint64_t>(manoeuvre);
      EffectivenessFlight flight = flight_of(kVehicles[vehicle], seed, manoeuvre);
      flight.realism.wind.mean_m_s = 10.0 * static_cast<double>(seed % 4) / 3.0;
      const std::size_t rotor = 1 + seed % flight.vehicle.rotor_count;
      flight.fault = Fault{.kind = FaultKind::kPropellerLost,
                           .onset_s = 10.0 + 0.041 * static_cast<double>(seed),
                           .rotor = rotor,
                           .magnitude = 1.0};
      flight.duration_s = 20.0;
      const auto outcome = fly(flight, effectiveness_params(flight.vehicle));
      ASSERT_TRUE(outcome.was_judging) << kVehicles[vehicle] << " seed " << seed;
      ASSERT_FALSE(outcome.ours.empty()) << kVehicles[vehicle] << " seed " << seed;
      EXPECT_EQ(outcome.ours.front().rotor + 1, rotor) << kVehicles[vehicle] << " seed " << seed;
      delays_s.push_back(outcome.ours.front().time_s - flight.fault->onset_s);
      EXPECT_GT(delays_s.back(), 0.0) << kVehicles[vehicle] << " seed " << seed;
    }
  }
  std::sort(delays_s.begin(), delays_s.end());
  std::printf("%zu flights: delay %.1f ms median, %.1f ms at most\n", delays_s.size(),
              1e3 * delays_s[delays_s.size() / 2], 1e3 * delays_s.back());
  EXPECT_LT(delays_s[delays_s.size() / 2], 0.025);
  EXPECT_LT(delays_s.back(), 0.060);
}

TEST(Effectiveness, StaysSilentThroughTakeOffsFlightsAndLandings) {
  double flown_s = 0.0;
  double judged_s = 0.0;
  int take_offs = 0;
  for (std::size_t vehicle = 0; vehicle < kVehicles.size(); ++vehicle) {
    EffectivenessFlight flight = flight_of(kVehicles[vehicle], 77 + vehicle, Manoeuvre::kRandom);
    flight.cycles = 4;
    flight.duration_s = 15.0;
    const auto outcome = fly(flight, effectiveness_params(flight.vehicle));
    EXPECT_TRUE(outcome.ours.empty()) << kVehicles[vehicle];
    flown_s += outcome.flown_s;
    judged_s += outcome.judged_s;
    take_offs += outcome.take_offs;
  }
  // Silence by being muted would be worth nothing.
  EXPECT_GT(judged_s, 0.5 * flown_s);
  EXPECT_GE(take_offs, 24);
}

TEST(Effectiveness, RotorsNumberedOtherwiseAreNoMotorFault) {
  for (const char* name : {"unbalance_medium", "unbalance_hexa", "f450"}) {
    EffectivenessFlight flight = flight_of(name, 5, Manoeuvre::kRandom);
    flight.duration_s = 40.0;
    const auto muted_with = [&](const Multirotor& described) {
      auto params = effectiveness_params(described);
      params.mapping_is_known = false;
      const auto outcome = fly(flight, params);
      EXPECT_TRUE(outcome.ours.empty()) << name;
      return outcome.muted_in_flight;
    };
    EXPECT_EQ(muted_with(flight.vehicle), Muted::kNot) << name;
    Multirotor swapped = flight.vehicle;
    std::swap(swapped.rotor[0].position_m, swapped.rotor[1].position_m);
    std::swap(swapped.rotor[0].spin, swapped.rotor[1].spin);
    EXPECT_EQ(muted_with(swapped), Muted::kRotorMapping) << name;
    Multirotor shifted = flight.vehicle;
    std::rotate(shifted.rotor.begin(), shifted.rotor.begin() + 1,
                shifted.rotor.begin() + static_cast<std::ptrdiff_t>(shifted.rotor_count));
    EXPECT_EQ(muted_with(shifted), Muted::kRotorMapping) << name;
    Multirotor mirrored = flight.vehicle;
    for (Rotor& rotor : mirrored.rotor) rotor.position_m[1] = -rotor.position_m[1];
    EXPECT_EQ(muted_with(mirrored), Muted::kRotorMapping) << name;
  }
}

/// A flight with a vehicle file that has the rotors of `pattern` turn the wrong way.
EffectivenessOutcome fly_described_wrongly(const EffectivenessFlight& flight, std::uint32_t pattern) {
  Multirotor described = flight.vehicle;
  for (std::size_t i = 0; i < described.rotor_count; ++i) {
    if ((pattern >> i) & 1U) described.rotor[i].spin = -described.rotor[i].spin;
  }
  return fly(flight, effectiveness_params(described));
}

TEST(Effectiveness, AWrongSenseOfRotationIsNamedAndNoMotorFault) {
  for (const char* name : {"unbalance_medium", "unbalance_hexa"}) {
    EffectivenessFlight flight = flight_of(name, 6, Manoeuvre::kRandom);
    flight.duration_s = 60.0;
    const std::size_t n = flight.vehicle.rotor_count;
    std::vector<std::uint32_t> patterns{(1U << n) - 1, 0b11, 0b110};  // all, and neighbours exchanged
    for (std::size_t i = 0; i < n; ++i) patterns.push_back(1U << i);
    for (const std::uint32_t pattern : patterns) {
      const auto outcome = fly_described_wrongly(flight, pattern);
      EXPECT_TRUE(outcome.ours.empty()) << name << " " << pattern;
      EXPECT_EQ(outcome.wrong_spin, pattern) << name;
      EXPECT_TRUE(outcome.is_spin_named) << name << " " << pattern;
    }
  }
}

TEST(Effectiveness, HealthyVehiclesTurnAsDescribedAndFitTheirPropellers) {
  for (std::size_t number = 0; number < 5 * kVehicles.size(); ++number) {
    const char* name = kVehicles[number % kVehicles.size()];
    constexpr std::array kManoeuvres{Manoeuvre::kHover, Manoeuvre::kCircle, Manoeuvre::kRandom};
    EffectivenessFlight flight = flight_of(name, 300 + number, kManoeuvres[number % kManoeuvres.size()]);
    flight.duration_s = 25.0;
    flight.realism.wind.mean_m_s = 2.0 * static_cast<double>(number % 6);
    const auto outcome = fly(flight, effectiveness_params(flight.vehicle));
    EXPECT_TRUE(outcome.ours.empty()) << name << " " << number;
    EXPECT_FALSE(outcome.wrong_spin) << name << " " << number;
    EXPECT_GT(outcome.judged_s, 10.0) << name << " " << number;
  }
}

EffectivenessOutcome fly_with_excess(const char* name, std::uint64_t seed, double excess, double onset_s) {
  EffectivenessFlight flight = flight_of(name, seed, Manoeuvre::kRandom);
  flight.fault =
      Fault{.kind = FaultKind::kOverEffective, .onset_s = onset_s, .rotor = 2, .magnitude = excess};
  flight.duration_s = 120.0;
  flight.give_up_s = 100.0;
  return fly(flight, effectiveness_params(flight.vehicle));
}

TEST(Effectiveness, FindsAWrongPropellerThatWasMountedOnTheGround) {
  for (const char* name : {"unbalance_medium", "unbalance_hexa", "bebop2"}) {
    const auto outcome = fly_with_excess(name, 8, 0.7, 0.0);
    ASSERT_FALSE(outcome.ours.empty()) << name;
    const Said& said = outcome.ours.front();
    EXPECT_EQ(said.rotor, 1U) << name;
    EXPECT_EQ(said.kind, effectiveness::LossKind::kOverEffective) << name;
    EXPECT_NEAR(said.effectiveness, 1.7, 0.3) << name;
    EXPECT_GT(said.event.probability, 0.99) << name;
    EXPECT_GE(said.event.evidence, said.event.threshold) << name;
  }
}

// No propeller becomes larger in flight; how often that would be taken for a loss is in docs/evidence_effectiveness.md.
TEST(Effectiveness, ASuddenExcessIsNotTheLossOfAnother) {
  for (const char* name : {"unbalance_medium", "unbalance_hexa", "f450"}) {
    const auto outcome = fly_with_excess(name, 12, 0.3, 10.0);
    for (const Said& said : outcome.ours) {
      EXPECT_EQ(said.rotor, 1U) << name;
      EXPECT_EQ(said.kind, effectiveness::LossKind::kOverEffective) << name;
    }
  }
}

// What was lost and comes back is no loss of the opposite rotor.
TEST(Effectiveness, ALossThatComesBackIsOfTheSameRotor) {
  for (const char* name : {"unbalance_medium", "unbalance_hexa", "f450", "octo"}) {
    EffectivenessFlight flight = flight_of(name, 21, Manoeuvre::kRandom);
    flight.fault =
        Fault{.kind = FaultKind::kPartialLoss, .onset_s = 9.0, .end_s = 13.0, .rotor = 3, .magnitude = 0.3};
    flight.duration_s = 20.0;
    flight.give_up_s = 8.0;
    const auto outcome = fly(flight, effectiveness_params(flight.vehicle));
    ASSERT_GE(outcome.ours.size(), 2U) << name;
    for (const Said& said : outcome.ours) {
      EXPECT_EQ(said.rotor, 2U) << name << " at " << said.time_s;
      EXPECT_EQ(said.kind, effectiveness::LossKind::kPartialLoss) << name;
    }
    EXPECT_NEAR(outcome.ours.back().effectiveness, 1.0, 0.15) << name;
  }
}

// A full battery, cold air, a lighter vehicle: all rotors give more than described, and none is to blame.
TEST(Effectiveness, AnExcessOfAllRotorsIsNobodys) {
  for (const double excess : {-0.25, 0.25}) {
    EffectivenessFlight flight = flight_of("unbalance_medium", 14, Manoeuvre::kRandom);
    flight.duration_s = 60.0;
    Multirotor described = flight.vehicle;
    described.thrust_coefficient_N_s2 /= 1.0 + excess;
    const auto outcome = fly(flight, effectiveness_params(described));
    EXPECT_TRUE(outcome.ours.empty()) << excess;
    EXPECT_GT(outcome.judged_s, 30.0);
  }
}

TEST(Effectiveness, TroubledMessagesAreNoMotorFault) {
  for (const Mischief mischief : {Mischief::kDuplicates, Mischief::kGaps, Mischief::kSpikes}) {
    EffectivenessFlight flight = flight_of("unbalance_medium", 9, Manoeuvre::kRandom);
    flight.mischief = mischief;
    flight.duration_s = 20.0;
    const auto params = effectiveness_params(flight.vehicle);
    const auto healthy = fly(flight, params);
    EXPECT_TRUE(healthy.ours.empty()) << static_cast<int>(mischief);
    EXPECT_GT(healthy.judged_s, 5.0) << static_cast<int>(mischief);
    // And what is really lost is still found.
    flight.fault = Fault{.kind = FaultKind::kPropellerLost, .onset_s = 10.3, .rotor = 2, .magnitude = 1.0};
    const auto lost = fly(flight, params);
    ASSERT_FALSE(lost.ours.empty()) << static_cast<int>(mischief);
    EXPECT_EQ(lost.ours.front().rotor, 1U);
    EXPECT_LT(lost.ours.front().time_s, 10.3 + 0.1);
  }
}

TEST(Effectiveness, FrozenOrWrongTelemetryIsNamedAsTelemetry) {
  for (const auto& [kind, magnitude] :
       {std::pair{FaultKind::kTelemetryFrozen, 0.0}, std::pair{FaultKind::kTelemetryWrongUnit, 7.0}}) {
    EffectivenessFlight flight = flight_of("unbalance_medium", 4, Manoeuvre::kRandom);
    flight.fault = Fault{.kind = kind, .onset_s = 9.0, .rotor = 3, .magnitude = magnitude};
    flight.duration_s = 20.0;
    flight.give_up_s = 4.0;
    const auto outcome = fly(flight, effectiveness_params(flight.vehicle));
    EXPECT_TRUE(outcome.ours.empty()) << static_cast<int>(kind);
    EXPECT_EQ(outcome.muted, Muted::kTelemetry) << static_cast<int>(kind);
  }
}

TEST(Effectiveness, WithoutRotorSpeedsTheCommandsWillDo) {
  for (std::size_t vehicle = 0; vehicle < kVehicles.size(); ++vehicle) {
    EffectivenessFlight flight = flight_of(kVehicles[vehicle], 31 + vehicle, Manoeuvre::kRandom);
    flight.telemetry_until_s = 0.0;
    flight.duration_s = 20.0;
    const auto params = effectiveness_params(flight.vehicle);
    const auto healthy = fly(flight, params);
    EXPECT_TRUE(healthy.ours.empty()) << kVehicles[vehicle];
    EXPECT_GT(healthy.judged_s, 0.7 * healthy.flown_s) << kVehicles[vehicle];
    const std::size_t rotor = 1 + vehicle % flight.vehicle.rotor_count;
    flight.fault =
        Fault{.kind = FaultKind::kPropellerLost, .onset_s = 10.3, .rotor = rotor, .magnitude = 1.0};
    const auto lost = fly(flight, params);
    ASSERT_FALSE(lost.ours.empty()) << kVehicles[vehicle];
    EXPECT_EQ(lost.ours.front().rotor + 1, rotor) << kVehicles[vehicle];
    EXPECT_GT(lost.ours.front().time_s, 10.3) << kVehicles[vehicle];
    EXPECT_LT(lost.ours.front().time_s, 10.3 + 0.06) << kVehicles[vehicle];
  }
}

TEST(Effectiveness, TelemetryThatStopsIsNoMotorFault) {
  for (std::size_t vehicle = 0; vehicle < kVehicles.size(); ++vehicle) {
    EffectivenessFlight flight = flight_of(kVehicles[vehicle], 51 + vehicle, Manoeuvre::kRandom);
    flight.telemetry_until_s = 11.0 + 0.0013 * static_cast<double>(vehicle);
    flight.duration_s = 30.0;
    const auto params = effectiveness_params(flight.vehicle);
    const auto healthy = fly(flight, params);
    EXPECT_TRUE(healthy.ours.empty()) << kVehicles[vehicle];
    // The commands take over.
    EXPECT_GT(healthy.judged_s, 0.6 * healthy.flown_s) << kVehicles[vehicle];
    flight.fault = Fault{.kind = FaultKind::kPropellerLost, .onset_s = 15.2, .rotor = 2, .magnitude = 1.0};
    const auto lost = fly(flight, params);
    ASSERT_FALSE(lost.ours.empty()) << kVehicles[vehicle];
    EXPECT_EQ(lost.ours.front().rotor, 1U) << kVehicles[vehicle];
    EXPECT_GT(lost.ours.front().time_s, 15.2) << kVehicles[vehicle];
    EXPECT_LT(lost.ours.front().time_s, 15.2 + 0.06) << kVehicles[vehicle];
  }
}

// The motor of a dead speed controller stands, and its telemetry is gone; with one wire for all, that of the others too.
TEST(Effectiveness, ADeadSpeedControllerIsNoLostPropeller) {
  for (const bool takes_all : {false, true}) {
    for (std::size_t vehicle = 0; vehicle < kVehicles.size(); ++vehicle) {
      EffectivenessFlight flight = flight_of(kVehicles[vehicle], 71 + vehicle, Manoeuvre::kRandom);
      flight.fault = Fault{.kind = FaultKind::kDeadEsc, .onset_s = 11.0, .rotor = 1 + vehicle % 4};
      flight.duration_s = 20.0;
      flight.give_up_s = 5.0;
      if (takes_all) flight.telemetry_until_s = 11.0;
      const auto outcome = fly(flight, effectiveness_params(flight.vehicle));
      EXPECT_TRUE(outcome.ours.empty()) << kVehicles[vehicle] << (takes_all ? ", all silent" : "");
    }
  }
}

TEST(Effectiveness, ReadsAPartialLoss) {
  for (const double loss : {0.4, 0.6}) {
    EffectivenessFlight flight = flight_of("bebop2", 3, Manoeuvre::kHover);
    flight.fault = Fault{.kind = FaultKind::kPartialLoss, .onset_s = 9.0, .rotor = 4, .magnitude = loss};
    flight.duration_s = 20.0;
    const auto outcome = fly(flight, effectiveness_params(flight.vehicle));
    ASSERT_FALSE(outcome.ours.empty());
    EXPECT_EQ(outcome.ours.front().rotor, 3U);
    EXPECT_EQ(outcome.ours.front().kind, effectiveness::LossKind::kPartialLoss);
    // The vehicle's own inertia and thrust are wrong by 10 % and 7 %.
    EXPECT_NEAR(outcome.ours.front().effectiveness, 1.0 - loss, 0.15);
  }
}

}  // namespace
}  // namespace airworthy::sim
