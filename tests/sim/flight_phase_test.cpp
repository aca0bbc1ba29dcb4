#include "core/detectors/flight_phase.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/simulation.h"
#include "tests/sim/vehicles.h"

namespace airworthy::sim {
namespace {

TimePoint at(double time_s) { return TimePoint{Duration{std::llround((100.0 + time_s) * 1e6)}}; }

/// What one FlightPhase was told, and how it did against the truth.
struct Judge {
  explicit Judge(const Multirotor& vehicle) : phase{vehicle} {}

  void score(double time_s, bool has_contact) {
    constexpr double kStep_s = 1.0 / Controller::kRate_Hz;
    // A foot that bounces is on the ground.
    if (has_contact) last_contact_s = time_s;
    const bool on_ground = time_s - last_contact_s < 0.05;
    const Phase now = phase.phase();
    flying_on_ground_s = on_ground && now == Phase::kInFlight ? flying_on_ground_s + kStep_s : 0.0;
    worst_flying_on_ground_s = std::max(worst_flying_on_ground_s, flying_on_ground_s);
    if (!on_ground && now == Phase::kOnGround) on_ground_in_flight_s += kStep_s;
    if (!on_ground) {
      flown_s += kStep_s;
      if (now == Phase::kInFlight) in_flight_s += kStep_s;
    }
    if (was_on_ground && !on_ground && time_s - last_landing_s > 2.0) ++take_offs;
    if (!was_on_ground && on_ground) last_landing_s = time_s;
    was_on_ground = on_ground;
  }

  FlightPhase phase;
  double last_contact_s = 0.0;
  double last_landing_s = -10.0;
  double flying_on_ground_s = 0.0;
  double worst_flying_on_ground_s = 0.0;
  double on_ground_in_flight_s = 0.0;
  double flown_s = 0.0;
  double in_flight_s = 0.0;
  int take_offs = 0;
  bool was_on_ground = true;
};

/// Feeds one flight to three: with everything, without the autopilot's reports, and by commands alone.
class Judges final : public Output {
 public:
  explicit Judges(const Multirotor& vehicle)
      : rotors_{vehicle.rotor_count}, all{vehicle}, without_reports{vehicle}, commands_only{vehicle} {}

  void on_truth(const Truth&) override {}
  void on_imu(const ImuSample& sample) override {
    for (Judge* judge : {&all, &without_reports, &commands_only}) {
      judge->phase.on_imu(at(sample.time_s),
                          {sample.accel_m_s2.x(), sample.accel_m_s2.y(), sample.accel_m_s2.z()},
                          {sample.gyro_rad_s.x(), sample.gyro_rad_s.y(), sample.gyro_rad_s.z()});
    }
  }
  void on_esc(const EscSample& sample) override {
    std::array<double, kMaxRotors> speeds{};
    for (std::size_t i = 0; i < rotors_; ++i) speeds[i] = sample.speed_rpm[i] * std::numbers::pi / 30.0;
    for (Judge* judge : {&all, &without_reports}) {
      judge->phase.on_rotor_speeds(at(sample.time_s), std::span{speeds}.first(rotors_));
    }
  }
  void on_attitude(const AutopilotSample&) override {}
  void on_commands(const AutopilotSample& sample) override {
    for (Judge* judge : {&all, &without_reports, &commands_only}) {
      judge->phase.on_rotor_commands(at(sample.time_s),
                                     std::span{sample.control.command_ratio}.first(rotors_));
    }
  }
  void on_flight_state(const AutopilotSample& sample, LandedState landed) override {
    all.phase.on_report(at(sample.time_s), static_cast<LandedReport>(landed),
                        -sample.estimate.velocity_N_m_s.z());
  }

 private:
  std::size_t rotors_;

 public:
  Judge all;
  Judge without_reports;
  Judge commands_only;
};

constexpr double kCycle_s = 20.0;
constexpr int kCyclesPerVehicle = 17;  // six vehicles: 102

TEST(FlightPhase, AHundredTakeOffsAndLandingsAtHardRealism) {
  int take_offs = 0;
  for (const char* name : kVehicles) {
    const Multirotor vehicle = vehicle_named(name);
    const auto scenario =
        Scenario::load(std::string{AIRWORTHY_CONFIG} + "/scenarios/landings.toml", vehicle.rotor_count);
    ASSERT_TRUE(scenario.has_value()) << scenario.error().text;
    Simulation simulation{vehicle, *scenario, Realism::at(Level::kHard), 21};
    Judges judges{vehicle};
    while (simulation.time_s() < kCycle_s * kCyclesPerVehicle) {
      simulation.step(judges);
      for (Judge* judge : {&judges.all, &judges.without_reports, &judges.commands_only}) {
        judge->score(simulation.time_s(), simulation.has_contact());
      }
    }
    take_offs += judges.all.take_offs;
    for (const auto& [judge, told] :
         {std::pair{&judges.all, "everything"}, std::pair{&judges.without_reports, "no reports"},
          std::pair{&judges.commands_only, "commands only"}}) {
      EXPECT_LE(judge->worst_flying_on_ground_s, 0.2) << name << ", " << told;
      EXPECT_EQ(judge->on_ground_in_flight_s, 0.0) << name << ", " << told;
      // Muting detectors is the easy way to never be wrong. What is announced as a landing is a third here.
      EXPECT_GT(judge->in_flight_s / judge->flown_s, judge == &judges.all ? 0.5 : 0.85)
          << name << ", " << told;
      std::printf(
          "%-17s %-14s in flight on the ground %.3f s at most, in flight %.1f %% of %.0f s, %d take-offs\n",
          name, told, judge->worst_flying_on_ground_s, 100.0 * judge->in_flight_s / judge->flown_s,
          judge->flown_s, judge->take_offs);
    }
  }
  EXPECT_GE(take_offs, 100);
}

TEST(FlightPhase, ManoeuvresAndGustsAreNoLandings) {
  for (const char* name : kVehicles) {
    const Multirotor vehicle = vehicle_named(name);
    const auto scenario = Scenario::load(std::string{AIRWORTHY_CONFIG} + "/scenarios/healthy_manoeuvres.toml",
                                         vehicle.rotor_count);
    ASSERT_TRUE(scenario.has_value()) << scenario.error().text;
    Simulation simulation{vehicle, *scenario, Realism::at(Level::kHard), 5};
    Judges judges{vehicle};
    double landing_s = 0.0;
    while (simulation.time_s() < 88.0) {  // before the descent
      simulation.step(judges);
      if (simulation.time_s() < 8.0) continue;
      landing_s += judges.without_reports.phase.phase() != Phase::kInFlight ? 0.002 : 0.0;
      ASSERT_NE(judges.without_reports.phase.phase(), Phase::kOnGround) << name;
    }
    EXPECT_LT(landing_s, 0.1 * 80.0) << name;
  }
}

}  // namespace
}  // namespace airworthy::sim
