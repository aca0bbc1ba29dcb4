#include "sim/simulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <fstream>
#include <iterator>
#include <numbers>
#include <set>

#include "runtime/bus/log_writer.h"
#include "sim/output/log_output.h"
#include "tests/runtime/temporary_folder.h"
#include "tests/sim/vehicles.h"

namespace airworthy::sim {
namespace {

/// Keeps everything.
class Recorder final : public Output {
 public:
  void on_truth(const Truth& truth) override { truths.push_back(truth); }
  void on_imu(const ImuSample& sample) override { imu.push_back(sample); }
  void on_esc(const EscSample& sample) override { esc.push_back(sample); }
  void on_attitude(const AutopilotSample& sample) override { attitude.push_back(sample); }
  void on_commands(const AutopilotSample& sample) override { commands.push_back(sample); }
  void on_flight_state(const AutopilotSample& sample, LandedState state) override {
    states.emplace_back(sample.time_s, state);
  }

  std::vector<Truth> truths;
  std::vector<ImuSample> imu;
  std::vector<EscSample> esc;
  std::vector<AutopilotSample> attitude;
  std::vector<AutopilotSample> commands;
  std::vector<std::pair<double, LandedState>> states;
};

void fly(Simulation& simulation, Output& output, double until_s) {
  while (simulation.time_s() < until_s) simulation.step(output);
}

std::string bytes_of_log(const Multirotor& vehicle, const Scenario& scenario, std::uint64_t seed) {
  const rt::TemporaryFolder folder;
  const std::string path = (folder.path() / "flight.lcm").string();
  auto writer = rt::LogWriter::create(path);
  EXPECT_TRUE(writer.has_value());
  LogOutput output{**writer, "test", vehicle.rotor_count, seed};
  Simulation simulation{vehicle, scenario, Realism::at(Level::kHard), seed};
  fly(simulation, output, 8.0);
  EXPECT_TRUE((*writer)->commit().has_value());
  std::ifstream file{path, std::ios::binary};
  return {std::istreambuf_iterator<char>{file}, {}};
}

TEST(Simulation, TheSameSeedGivesTheSameBytes) {
  const Multirotor vehicle = vehicle_named("unbalance_hexa");
  const std::string first = bytes_of_log(vehicle, hover_plan(8.0), 5);
  EXPECT_GT(first.size(), 100'000U);
  EXPECT_EQ(first, bytes_of_log(vehicle, hover_plan(8.0), 5));
  EXPECT_NE(first, bytes_of_log(vehicle, hover_plan(8.0), 6));
}

TEST(Simulation, HoversWhereItShould) {
  for (const char* name : kVehicles) {
    for (const Level level : {Level::kNominal, Level::kHard}) {
      const Realism realism = Realism::at(level);
      Simulation simulation{vehicle_named(name), hover_plan(30.0), realism, 11};
      Recorder recorder;
      fly(simulation, recorder, 15.0);
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      int count = 0;
      while (simulation.time_s() < 30.0) {
        simulation.step(recorder);
        mean += simulation.state().position_N_m;
        ++count;
      }
      mean /= count;
      const double gear_m = simulation.vehicle().gear_height_m;
      EXPECT_LT((mean - Eigen::Vector3d{0.0, 0.0, -2.0 - gear_m}).norm(),
                0.1 + 2.0 * realism.autopilot.position_noise_m)
          << name;
    }
  }
}

TEST(Simulation, RenumberedRotorsGiveTheSameFlightRenumbered) {
  const Multirotor vehicle = vehicle_named("unbalance_hexa");
  const std::array<std::size_t, 6> renumbered{3, 5, 0, 1, 4, 2};  // new number of each rotor
  Multirotor other = vehicle;
  for (std::size_t i = 0; i < 6; ++i) other.rotor[renumbered[i]] = vehicle.rotor[i];
  Fault fault{.kind = FaultKind::kPartialLoss, .onset_s = 6.0, .rotor = 2, .magnitude = 0.3};
  Fault other_fault = fault;
  other_fault.rotor = renumbered[1] + 1;
  Scenario scenario = hover_plan(10.0);
  Scenario other_scenario = scenario;
  scenario.faults = {fault};
  other_scenario.faults = {other_fault};

  Recorder one;
  Recorder two;
  Simulation first{vehicle, scenario, Realism::at(Level::kHard), 3};
  Simulation second{other, other_scenario, Realism::at(Level::kHard), 3};
  fly(first, one, 10.0);
  fly(second, two, 10.0);
  ASSERT_EQ(one.imu.size(), two.imu.size());
  for (std::size_t k = 0; k < one.imu.size(); ++k) {
    ASSERT_EQ(one.imu[k].accel_m_s2, two.imu[k].accel_m_s2) << k;
    ASSERT_EQ(one.imu[k].gyro_rad_s, two.imu[k].gyro_rad_s) << k;
  }
  ASSERT_EQ(one.esc.size(), two.esc.size());
  int compared = 0;
  for (std::size_t k = 0; k < one.esc.size(); ++k) {
    for (std::size_t i = 0; i < 6; ++i) {
      const double a = one.esc[k].speed_rpm[i];
      const double b = two.esc[k].speed_rpm[renumbered[i]];
      if (std::isnan(a)) {
        ASSERT_TRUE(std::isnan(b));
        continue;
      }
      ASSERT_EQ(a, b) << k << " rotor " << i;
      ++compared;
    }
  }
  EXPECT_GT(compared, 4000);
}

TEST(Simulation, AFaultChangesNothingBeforeItsOnset) {
  const Multirotor vehicle = vehicle_named("bebop2");
  Scenario broken = hover_plan(10.0);
  broken.faults = {Fault{.kind = FaultKind::kUnbalance, .onset_s = 7.0, .rotor = 1, .magnitude = 50.0}};
  Recorder healthy;
  Recorder faulty;
  Simulation one{vehicle, hover_plan(10.0), Realism::at(Level::kHard), 4};
  Simulation two{vehicle, broken, Realism::at(Level::kHard), 4};
  fly(one, healthy, 10.0);
  fly(two, faulty, 10.0);
  double largest = 0.0;
  for (std::size_t k = 0; k < healthy.imu.size(); ++k) {
    const double difference = (healthy.imu[k].accel_m_s2 - faulty.imu[k].accel_m_s2).norm();
    if (healthy.imu[k].time_s < 7.0) {
      ASSERT_EQ(difference, 0.0);
    }
    largest = std::max(largest, difference);
  }
  EXPECT_GT(largest, 0.5);
}

TEST(Simulation, TellsTheTruthOnce) {
  Scenario scenario = hover_plan(10.0);
  Recorder healthy;
  Simulation one{vehicle_named("f450"), scenario, Realism::at(Level::kHard), 4};
  fly(one, healthy, 1.0);
  ASSERT_EQ(healthy.truths.size(), 1U);
  EXPECT_EQ(healthy.truths[0].fault_kind, "none");
  scenario.faults = {Fault{.kind = FaultKind::kGyroBias, .onset_s = 7.0, .axis = 1, .magnitude = 0.2},
                     Fault{.kind = FaultKind::kDeadEsc, .onset_s = 8.0, .rotor = 3}};
  Recorder faulty;
  Simulation two{vehicle_named("f450"), scenario, Realism::at(Level::kHard), 4};
  fly(two, faulty, 1.0);
  ASSERT_EQ(faulty.truths.size(), 2U);
  EXPECT_EQ(faulty.truths[0].component, "imu");
  EXPECT_EQ(faulty.truths[1].component, "rotor 3");
  EXPECT_EQ(faulty.truths[1].fault_kind, "dead_esc");
  EXPECT_EQ(faulty.truths[1].onset_s, 8.0);
  EXPECT_EQ(faulty.truths[0].magnitude, 0.2);
  EXPECT_TRUE(std::isnan(faulty.truths[1].magnitude)) << "a dead ESC has none";
}

/// Flies the octocopter, which survives any one rotor, with one fault from 8 s on.
Recorder fly_with(const Fault& fault, double until_s = 11.0) {
  Scenario scenario = hover_plan(20.0);
  scenario.faults = {fault};
  Simulation simulation{vehicle_named("octo"), scenario, Realism::at(Level::kNominal), 9};
  Recorder recorder;
  fly(simulation, recorder, until_s);
  EXPECT_GT(-simulation.state().position_N_m.z(), 0.8) << "still flying";
  return recorder;
}

double mean_speed_rpm(const Recorder& recorder, std::size_t rotor, double from_s, double until_s) {
  double sum = 0.0;
  int count = 0;
  for (const EscSample& sample : recorder.esc) {
    if (sample.time_s < from_s || sample.time_s >= until_s || std::isnan(sample.speed_rpm[rotor])) continue;
    sum += sample.speed_rpm[rotor];
    ++count;
  }
  return count > 0 ? sum / count : std::nan("");
}

TEST(Faults, ALostPropellerMakesItsMotorRunFree) {
  const Recorder flown = fly_with({.kind = FaultKind::kPropellerLost, .onset_s = 8.0, .rotor = 2});
  // The controller takes part of the command back, so it is the ratio to the command that tells.
  EXPECT_GT(mean_speed_rpm(flown, 1, 8.1, 8.3), 1.15 * mean_speed_rpm(flown, 1, 7.0, 8.0));
}

TEST(Faults, PartialLossIsMadeUpForByCommands) {
  const Recorder flown =
      fly_with({.kind = FaultKind::kPartialLoss, .onset_s = 8.0, .rotor = 2, .magnitude = 0.3});
  EXPECT_GT(mean_speed_rpm(flown, 1, 10.0, 11.0), 1.02 * mean_speed_rpm(flown, 1, 7.0, 8.0));
}

TEST(Faults, ADeadEscIsSilentAndItsMotorStops) {
  const Recorder flown = fly_with({.kind = FaultKind::kDeadEsc, .onset_s = 8.0, .rotor = 2});
  EXPECT_FALSE(std::isnan(mean_speed_rpm(flown, 1, 7.0, 8.0)));
  EXPECT_TRUE(std::isnan(mean_speed_rpm(flown, 1, 8.1, 11.0)));
  double before = 0.0;
  double after = 0.0;
  for (const std::size_t rotor : {0U, 2U, 3U, 4U, 5U, 6U, 7U}) {
    before += mean_speed_rpm(flown, rotor, 7.0, 8.0);
    after += mean_speed_rpm(flown, rotor, 9.0, 11.0);
  }
  EXPECT_GT(after, 1.02 * before) << "the others lift what it lifted";
}

TEST(Faults, AStuckCommandIsReportedAsUsualButNotObeyed) {
  const Recorder flown = fly_with({.kind = FaultKind::kStuckCommand, .onset_s = 8.0, .rotor = 2});
  double least = 1e9;
  double most = 0.0;
  for (const EscSample& sample : flown.esc) {
    if (sample.time_s < 9.0) continue;
    least = std::min(least, sample.speed_rpm[1]);
    most = std::max(most, sample.speed_rpm[1]);
  }
  EXPECT_LT(most / least, 1.05) << "speed error and telemetry noise only";
}

TEST(Faults, ADesyncStuttersAndReportsNonsense) {
  const Recorder flown = fly_with({.kind = FaultKind::kDesync, .onset_s = 8.0, .end_s = 9.0, .rotor = 2});
  double most_change = 0.0;
  double last = -1.0;
  for (const EscSample& sample : flown.esc) {
    if (sample.time_s < 8.1 || sample.time_s > 9.0) continue;
    if (last >= 0.0) most_change = std::max(most_change, std::abs(sample.speed_rpm[1] - last));
    last = sample.speed_rpm[1];
  }
  EXPECT_GT(most_change, 10'000.0);
  EXPECT_NEAR(mean_speed_rpm(flown, 1, 10.5, 11.0) / mean_speed_rpm(flown, 1, 7.0, 8.0), 1.0, 0.1);
}

TEST(Faults, LinksGoSilentAndComeBack) {
  const auto count = [](const auto& samples, double from_s, double until_s) {
    return std::count_if(samples.begin(), samples.end(), [&](const auto& sample) {
      return sample.time_s >= from_s && sample.time_s < until_s;
    });
  };
  const Recorder esc =
      fly_with({.kind = FaultKind::kLinkLoss, .onset_s = 8.0, .end_s = 9.0, .link = Link::kEsc});
  EXPECT_EQ(count(esc.esc, 8.05, 8.99), 0);
  EXPECT_GT(count(esc.esc, 9.05, 10.0), 300);
  EXPECT_GT(count(esc.imu, 8.0, 9.0), 400);
  const Recorder autopilot =
      fly_with({.kind = FaultKind::kLinkLoss, .onset_s = 8.0, .end_s = 9.0, .link = Link::kAutopilot});
  EXPECT_EQ(count(autopilot.imu, 8.01, 9.0), 0);
  EXPECT_EQ(count(autopilot.commands, 8.01, 9.0), 0);
  EXPECT_GT(count(autopilot.imu, 9.01, 10.0), 400);
}

TEST(Faults, SensorsShiftDriftSpikeAndFreeze) {
  const auto mean = [](const Recorder& recorder, double from_s, double until_s, bool gyro, int axis) {
    double sum = 0.0;
    int count = 0;
    for (const ImuSample& sample : recorder.imu) {
      if (sample.time_s < from_s || sample.time_s >= until_s) continue;
      sum += gyro ? sample.gyro_rad_s[axis] : sample.accel_m_s2[axis];
      ++count;
    }
    return sum / count;
  };
  const Recorder bias =
      fly_with({.kind = FaultKind::kAccelBias, .onset_s = 8.0, .axis = 2, .magnitude = 1.0});
  EXPECT_NEAR(mean(bias, 9.0, 11.0, false, 2) - mean(bias, 6.0, 8.0, false, 2), 1.0, 0.15);
  const Recorder drift =
      fly_with({.kind = FaultKind::kAccelDrift, .onset_s = 8.0, .axis = 2, .growth_per_s = 0.5});
  EXPECT_NEAR(mean(drift, 10.0, 11.0, false, 2) - mean(drift, 6.0, 8.0, false, 2), 1.25, 0.2);
  const Recorder spikes =
      fly_with({.kind = FaultKind::kAccelSpike, .onset_s = 8.0, .axis = 1, .magnitude = 50.0});
  EXPECT_EQ(std::count_if(spikes.imu.begin(), spikes.imu.end(),
                          [](const ImuSample& sample) { return sample.accel_m_s2.y() > 30.0; }),
            15);
  const Recorder frozen = fly_with({.kind = FaultKind::kAccelFreeze, .onset_s = 8.0});
  EXPECT_EQ(frozen.imu.back().accel_m_s2, frozen.imu[frozen.imu.size() - 1000].accel_m_s2);
  EXPECT_NE(frozen.imu.back().gyro_rad_s, frozen.imu[frozen.imu.size() - 1000].gyro_rad_s);

  const Recorder gyro_spikes =
      fly_with({.kind = FaultKind::kGyroSpike, .onset_s = 8.0, .axis = 2, .magnitude = 3.0});
  EXPECT_EQ(std::count_if(gyro_spikes.imu.begin(), gyro_spikes.imu.end(),
                          [](const ImuSample& sample) { return sample.gyro_rad_s.z() > 2.0; }),
            15);
  // The rate loop turns the vehicle until the biased gyroscope reads what is wanted: the heading runs away.
  const Recorder gyro_bias =
      fly_with({.kind = FaultKind::kGyroBias, .onset_s = 8.0, .axis = 2, .magnitude = 0.5}, 8.4);
  EXPECT_LT(mean(gyro_bias, 8.2, 8.4, true, 2), 0.5);
  EXPECT_GT(mean(gyro_bias, 8.0, 8.02, true, 2), 0.3);
  const Recorder gyro_frozen = fly_with({.kind = FaultKind::kGyroFreeze, .onset_s = 8.0, .end_s = 8.1}, 9.0);
  int repeats = 0;
  for (std::size_t k = 1; k < gyro_frozen.imu.size(); ++k) {
    repeats +=
        gyro_frozen.imu[k].gyro_rad_s == gyro_frozen.imu[k - 1].gyro_rad_s && gyro_frozen.imu[k].time_s > 8.0;
  }
  EXPECT_NEAR(repeats, 50, 2);
}

/// Root mean square of the horizontal acceleration that turns with the measured speed of a rotor, from two
/// quadratures over whole windows: the amplitude of a line buried in everything else.
double line_m_s2(const Recorder& recorder, std::size_t rotor, double from_s, double until_s) {
  const double speed_rad_s = mean_speed_rpm(recorder, rotor, from_s, until_s) * std::numbers::pi / 30.0;
  double most = 0.0;
  // The mean speed is not exact, and the line wanders: the strongest of its neighbourhood.
  for (int step = -60; step <= 60; ++step) {
    const double detune = 0.0005 * step;
    Eigen::Vector2cd sum = Eigen::Vector2cd::Zero();
    int count = 0;
    for (const ImuSample& sample : recorder.imu) {
      if (sample.time_s < from_s || sample.time_s >= until_s) continue;
      sum += std::polar(1.0, -speed_rad_s * (1.0 + detune) * sample.time_s) * sample.accel_m_s2.head<2>();
      ++count;
    }
    most = std::max(most, std::sqrt(2.0) * sum.norm() / count);
  }
  return most;
}

TEST(Faults, UnbalanceStepsAndGrowsAtTheSpeedOfItsRotor) {
  const auto fly_perfect = [](const Fault& fault) {
    Scenario scenario = hover_plan(20.0);
    scenario.faults = {fault};
    Multirotor vehicle = vehicle_named("unbalance_medium");
    Realism still = Realism::at(Level::kNominal);
    still.rotor.natural_unbalance_m_s2 = 0.0;
    still.motor.speed_error_ratio = 0.0;
    still.airframe = {};
    still.wind.mean_m_s = 0.0;
    still.autopilot.attitude_noise_rad = still.autopilot.position_noise_m = 0.0;
    still.autopilot.velocity_noise_m_s = 0.0;
    Simulation simulation{vehicle, scenario, still, 9};
    Recorder recorder;
    fly(simulation, recorder, 14.0);
    return recorder;
  };
  // Closed form: m·r·ω² over the mass of the vehicle, through the anti-alias filter of second order.
  const Multirotor vehicle = vehicle_named("unbalance_medium");
  const auto expected = [&vehicle](const Recorder& recorder, double mass_mg, double from_s) {
    const double omega = mean_speed_rpm(recorder, 1, from_s, from_s + 0.5) * std::numbers::pi / 30.0;
    const double cutoff = Realism::at(Level::kNominal).imu.filter_cutoff_Hz * 2.0 * std::numbers::pi;
    return 1e-6 * mass_mg * vehicle.propeller_radius_m * omega * omega / vehicle.mass_kg /
           std::sqrt(1.0 + std::pow(omega / cutoff, 4.0));
  };
  const Recorder step =
      fly_perfect({.kind = FaultKind::kUnbalance, .onset_s = 10.0, .rotor = 2, .magnitude = 100.0});
  EXPECT_LT(line_m_s2(step, 1, 9.0, 9.5), 0.2 * expected(step, 100.0, 9.0));
  EXPECT_NEAR(line_m_s2(step, 1, 10.5, 11.0) / expected(step, 100.0, 10.5), 1.0, 0.15);
  const Recorder growth =
      fly_perfect({.kind = FaultKind::kUnbalance, .onset_s = 10.0, .rotor = 2, .growth_per_s = 50.0});
  EXPECT_NEAR(line_m_s2(growth, 1, 11.75, 12.25) / expected(growth, 100.0, 11.75), 1.0, 0.2);
  EXPECT_NEAR(line_m_s2(growth, 1, 13.25, 13.75) / expected(growth, 175.0, 13.25), 1.0, 0.2);
}

TEST(Faults, AnUnbalanceAddsToTheNaturalOneAtItsAngle) {
  const Multirotor vehicle = vehicle_named("unbalance_medium");
  const auto unbalance_kg_m = [&](double mass_mg, std::optional<double> angle_rad) {
    Scenario scenario = hover_plan(10.0);
    scenario.faults = {
        {.kind = FaultKind::kUnbalance, .rotor = 3, .magnitude = mass_mg, .angle_rad = angle_rad}};
    return Simulation{vehicle, scenario, Realism::at(Level::kHard), 4}.unbalance_kg_m(2);
  };
  const double natural = unbalance_kg_m(0.0, 0.0);
  const double damage = 40e-6 * vehicle.propeller_radius_m;
  EXPECT_NEAR(unbalance_kg_m(40.0, 0.0), natural + damage, 1e-12);
  EXPECT_NEAR(unbalance_kg_m(40.0, std::numbers::pi), std::abs(natural - damage), 1e-12);
  EXPECT_NEAR(unbalance_kg_m(40.0, 0.5 * std::numbers::pi), std::hypot(natural, damage), 1e-12);
  // An angle that nobody gives belongs to the vehicle.
  EXPECT_EQ(unbalance_kg_m(40.0, {}), unbalance_kg_m(40.0, {}));
  EXPECT_LT(unbalance_kg_m(40.0, {}), natural + damage);
  EXPECT_GT(unbalance_kg_m(40.0, {}), std::abs(natural - damage));
}

TEST(Faults, TelemetryFreezesAndShowsTheWrongUnit) {
  const Recorder frozen = fly_with({.kind = FaultKind::kTelemetryFrozen, .onset_s = 8.0, .rotor = 2});
  std::set<double> before;
  std::set<double> after;
  for (const EscSample& sample : frozen.esc) {
    if (sample.time_s > 7.0 && sample.time_s < 8.0) before.insert(sample.speed_rpm[1]);
    if (sample.time_s > 8.1 && !std::isnan(sample.speed_rpm[1])) after.insert(sample.speed_rpm[1]);
  }
  EXPECT_GT(before.size(), 5U);
  EXPECT_EQ(after.size(), 1U);
  const Recorder wrong =
      fly_with({.kind = FaultKind::kTelemetryWrongUnit, .onset_s = 8.0, .rotor = 2, .magnitude = 7.0});
  EXPECT_NEAR(mean_speed_rpm(wrong, 1, 8.1, 11.0) / mean_speed_rpm(wrong, 1, 7.0, 8.0), 7.0, 0.1);
  EXPECT_NEAR(wrong.esc.back().temperature_degC[1] - wrong.esc.back().temperature_degC[0], 273.15, 1e-9);
  EXPECT_NEAR(mean_speed_rpm(wrong, 0, 8.1, 11.0) / mean_speed_rpm(wrong, 0, 7.0, 8.0), 1.0, 0.02);
}

TEST(Faults, AGyroscopeDriftsWhileTheRateLoopFollowsIt) {
  const Recorder flown =
      fly_with({.kind = FaultKind::kGyroDrift, .onset_s = 8.0, .axis = 2, .growth_per_s = 0.02}, 18.0);
  // The autopilot holds what it reads near zero, so the vehicle itself turns back as fast as the bias grows:
  // the heading error that the attitude loop sees balances gain · error = bias.
  const auto heading = [&flown](double time_s) {
    for (const AutopilotSample& sample : flown.attitude) {
      if (sample.time_s >= time_s) {
        return std::atan2(2.0 * sample.estimate.q_NB.w() * sample.estimate.q_NB.z(),
                          1.0 - 2.0 * std::pow(sample.estimate.q_NB.z(), 2.0));
      }
    }
    return 0.0;
  };
  const double first = heading(13.0) - heading(8.0);
  const double second = heading(17.9) - heading(8.0);
  EXPECT_LT(first, -0.005);
  EXPECT_LT(second, 1.5 * first) << "grows on";
}

}  // namespace
}  // namespace airworthy::sim
