#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <vector>

#include "runtime/bus/channels.h"
#include "runtime/config/vehicle.h"
#include "runtime/phase/flight_phase_input.h"
#include "tests/replay/imported.h"
#include "tests/support/recorded_data.h"

namespace airworthy {
namespace {

struct Change {
  double time_s;  ///< since the start of the recording
  Phase phase;
};

/// The phases of a recorded flight.
std::vector<Change> phases_of(const std::filesystem::path& recording, const std::string& map_name,
                              const Multirotor& vehicle) {
  testing::Imported flight{recording, map_name};
  rt::FlightPhaseInput input{flight.node(), vehicle};
  std::vector<Change> changes;
  std::optional<TimePoint> start;
  flight.node().subscribe<imu_t>(channel::kImu, [&](const imu_t& message) {
    const TimePoint time = from_us(message.header.time_us);
    if (!start) start = time;
    const Phase phase = input.advance_to(time).phase();
    if (changes.empty() || changes.back().phase != phase)
      changes.push_back({to_seconds(time - *start), phase});
  });
  flight.play();
  return changes;
}

Phase phase_at(const std::vector<Change>& changes, double time_s) {
  Phase phase = Phase::kUnknown;
  for (const Change& change : changes) {
    if (change.time_s <= time_s) phase = change.phase;
  }
  return phase;
}

std::string text_of(const std::vector<Change>& changes) {
  std::string text;
  for (const Change& change : changes) {
    text += std::to_string(change.time_s) + " " + std::string{name_of(change.phase)} + "\n";
  }
  return text;
}

TEST(RecordedFlightPhase, TheBebopStandsFliesAndCrashes) {
  const auto recording = testing::recorded_data() / "bebop2_prop_eject/flight01_11-43-10.csv.xz";
  if (!std::filesystem::exists(recording)) GTEST_SKIP() << "no recorded flights: " << recording;
  const auto vehicle = rt::VehicleFile::load(std::string{AIRWORTHY_CONFIG} + "/vehicles/bebop2.toml");
  ASSERT_TRUE(vehicle && vehicle->multirotor);
  const auto changes = phases_of(recording, "bebop2_prop_eject", *vehicle->multirotor);
  SCOPED_TRACE(text_of(changes));
  for (double t = 0.4; t < 0.9; t += 0.1) EXPECT_EQ(phase_at(changes, t), Phase::kOnGround) << t;
  EXPECT_EQ(phase_at(changes, 1.1), Phase::kTakeOff);
  // In flight through the ejection at 12.39 s: losing a propeller is not landing.
  for (double t = 1.5; t < 12.9; t += 0.1) EXPECT_EQ(phase_at(changes, t), Phase::kInFlight) << t;
  // It hits the ground at 13.0 to 13.1 s.
  for (double t = 13.3; t < 14.2; t += 0.1) EXPECT_NE(phase_at(changes, t), Phase::kInFlight) << t;
  EXPECT_EQ(phase_at(changes, 13.3), Phase::kContact);
}

/// Thrust over mass of the thrown quadrotors, from the README of the recordings: a_z = 6.3e-7 · Σω².
Multirotor thrown_quad() {
  Multirotor vehicle;
  vehicle.mass_kg = 1.0;
  vehicle.thrust_coefficient_N_s2 = 6.3e-7;
  vehicle.speed_min_rad_s = 500.0;
  vehicle.speed_max_rad_s = 4000.0;
  vehicle.rotor_count = 4;
  return vehicle;
}

TEST(RecordedFlightPhase, ThrownQuadsAreContactInTheHandAndInFlightOnceReleased) {
  // Times of release (free fall begins) and of the fall that ends the flight, read off the accelerometer.
  struct Throw {
    const char* name;
    double held_until_s;
    double released_s;
    double impact_s;
  };
  int seen = 0;
  for (const Throw& thrown : {Throw{"LOG00230", 9.0, 9.85, 24.25}, Throw{"LOG00232", 6.4, 7.3, 18.65}}) {
    const auto recording =
        testing::recorded_data() / "indiflight_throw" / (std::string{thrown.name} + ".csv.xz");
    if (!std::filesystem::exists(recording)) continue;
    ++seen;
    const auto changes = phases_of(recording, "indiflight_throw", thrown_quad());
    SCOPED_TRACE(std::string{thrown.name} + "\n" + text_of(changes));
    for (double t = 0.5; t < thrown.held_until_s; t += 0.1)
      EXPECT_EQ(phase_at(changes, t), Phase::kOnGround) << t;
    EXPECT_EQ(phase_at(changes, thrown.released_s - 0.25), Phase::kContact) << "the hand accelerates it";
    EXPECT_EQ(phase_at(changes, thrown.released_s), Phase::kInFlight);
    double in_flight_s = 0.0;
    for (double t = thrown.released_s; t < thrown.impact_s; t += 0.01) {
      EXPECT_NE(phase_at(changes, t), Phase::kOnGround) << t;
      if (phase_at(changes, t) == Phase::kInFlight) in_flight_s += 0.01;
    }
    EXPECT_GT(in_flight_s / (thrown.impact_s - thrown.released_s), 0.85);
    EXPECT_NE(phase_at(changes, thrown.impact_s + 0.2), Phase::kInFlight);
    EXPECT_EQ(changes.back().phase, Phase::kOnGround) << "it lies still in the end";
  }
  if (seen == 0) GTEST_SKIP() << "no recorded flights in " << testing::recorded_data();
}

TEST(RecordedFlightPhase, QuadsThatLaunchThemselvesFlyUntilTheyHitTheGround) {
  int seen = 0;
  const auto folder = testing::recorded_data() / "indiflight_throw";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recorded flights: " << folder;
  for (const auto& entry : std::filesystem::directory_iterator{folder}) {
    const std::string name = entry.path().filename().string();
    if (!name.ends_with(".csv.xz") || name == "LOG00230.csv.xz" || name == "LOG00232.csv.xz") continue;
    ++seen;
    const auto changes = phases_of(entry.path(), "indiflight_throw", thrown_quad());
    SCOPED_TRACE(name + "\n" + text_of(changes));
    // Stands for 0.7 s, then leaves the ground at full thrust.
    EXPECT_EQ(phase_at(changes, 0.6), Phase::kOnGround);
    EXPECT_EQ(phase_at(changes, 1.1), Phase::kInFlight);
    double on_ground_s = 0.0;
    double in_flight_s = 0.0;
    for (double t = 1.0; t < 6.5; t += 0.01) {
      on_ground_s += phase_at(changes, t) == Phase::kOnGround ? 0.01 : 0.0;
      in_flight_s += phase_at(changes, t) == Phase::kInFlight ? 0.01 : 0.0;
    }
    EXPECT_EQ(on_ground_s, 0.0);
    EXPECT_GT(in_flight_s, 0.5 * 5.5);
  }
  EXPECT_GT(seen, 0);
}

}  // namespace
}  // namespace airworthy
