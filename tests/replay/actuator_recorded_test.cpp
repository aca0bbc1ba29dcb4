#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "runtime/bus/channels.h"
#include "runtime/config/vehicle.h"
#include "services/actuator/actuator_service.h"
#include "tests/replay/imported.h"
#include "tests/support/recorded_data.h"

namespace airworthy::actuator {
namespace {

struct Raised {
  double time_s;  ///< since the first inertial sample
  std::string component;
  double magnitude;
};

/// What the service raises over a recorded flight, with the shipped configuration.
std::vector<Raised> raised_in(const std::filesystem::path& recording, const std::string& map_name,
                              const Multirotor& vehicle) {
  testing::Imported flight{recording, map_name};
  auto config = ActuatorConfig::load(std::string{AIRWORTHY_CONFIG} + "/actuator.toml", {});
  EXPECT_TRUE(config.has_value()) << (config ? "" : config.error().text);
  config->vehicle = flight.vehicle();
  config->monitor.vehicle = vehicle;
  std::optional<TimePoint> start;
  std::vector<Raised> raised;
  flight.node().subscribe<imu_t>(channel::kImu, [&](const imu_t& message) {
    if (!start) start = from_us(message.header.time_us);
  });
  flight.node().subscribe<fault_event_t>(channel::kFaultEvent, [&](const fault_event_t& event) {
    if (event.phase == 1)
      raised.push_back(
          {to_seconds(from_us(event.header.time_us) - *start), event.component, event.magnitude});
  });
  rt::Node node = flight.node_of("airworthy-actuator");
  ActuatorService service{node, *config};
  flight.play();
  return raised;
}

std::string text_of(const std::vector<Raised>& raised) {
  std::string text;
  for (const Raised& one : raised) {
    text += std::to_string(one.time_s) + " " + one.component + " " + std::to_string(one.magnitude) + "\n";
  }
  return text;
}

/// PX4's simulated quadrotor is described nowhere in the recordings: mass and inertia are of the usual order, and the
/// thrust is such that it hovers at the recorded command of 0.265.
Multirotor simulated_quad() {
  const auto file = rt::VehicleFile::load(std::string{AIRWORTHY_CONFIG} + "/vehicles/f450.toml");
  EXPECT_TRUE(file && file->multirotor);
  Multirotor vehicle = *file->multirotor;
  vehicle.mass_kg = 1.5;
  vehicle.inertia_kg_m2 = {0.021, 0.021, 0.037};
  vehicle.thrust_coefficient_N_s2 = 3.75e-5;
  vehicle.motor_time_constant_s = 0.03;
  return vehicle;
}

TEST(RecordedActuator, NamesTheFailedMotorOfEverySimulatedPx4Flight) {
  struct Flight {
    const char* name;
    double fault_s;
  };
  int seen = 0;
  for (const Flight& flight :
       {Flight{"TestCase_1_1000000000", 33.06}, Flight{"TestCase_1_2000000000", 18.93},
        Flight{"TestCase_3_1000000002", 34.13}, Flight{"TestCase_3_2000000002", 18.92},
        Flight{"TestCase_5_1000000004", 34.11}, Flight{"TestCase_5_2000000004", 18.92},
        Flight{"TestCase_7_1000000006", 34.17}, Flight{"TestCase_7_2000000006", 18.93}}) {
    const auto recording = testing::recorded_data() / "rflymad_sim" / flight.name;
    if (!std::filesystem::exists(recording)) continue;
    ++seen;
    const auto raised = raised_in(recording, "rflymad_sim", simulated_quad());
    SCOPED_TRACE(std::string{flight.name} + "\n" + text_of(raised));
    ASSERT_FALSE(raised.empty());
    EXPECT_EQ(raised[0].component, "rotor 1");
    EXPECT_GT(raised[0].time_s, flight.fault_s);
    EXPECT_LT(raised[0].time_s, flight.fault_s + 0.3);
  }
  if (seen == 0) GTEST_SKIP() << "no recorded flights in " << testing::recorded_data();
}

// The propeller leaves between 12.39 and 12.45 s.
TEST(RecordedActuator, TheBebopLosesThePropellerOfRotor2) {
  const auto recording = testing::recorded_data() / "bebop2_prop_eject/flight01_11-43-10.csv.xz";
  if (!std::filesystem::exists(recording)) GTEST_SKIP() << "no recorded flights: " << recording;
  const auto file = rt::VehicleFile::load(std::string{AIRWORTHY_CONFIG} + "/vehicles/bebop2.toml");
  ASSERT_TRUE(file && file->multirotor);
  const auto raised = raised_in(recording, "bebop2_prop_eject", *file->multirotor);
  SCOPED_TRACE(text_of(raised));
  bool is_named = false;
  for (const Raised& one : raised) {
    EXPECT_GT(one.time_s, 12.38) << "nothing had failed";
    EXPECT_EQ(one.component, "rotor 2");
    is_named = is_named || one.time_s < 12.8;
  }
  EXPECT_TRUE(is_named);
}

}  // namespace
}  // namespace airworthy::actuator
