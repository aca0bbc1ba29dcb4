#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>

#include "core/detectors/flight_phase.h"
#include "core/detectors/unbalance/rotor_unbalance_monitor.h"
#include "sim/simulation.h"
#include "tests/sim/vehicles.h"

namespace airworthy::sim {
namespace {

using Transition = FaultLifeCycle::Transition;

TimePoint at(double time_s) { return TimePoint{Duration{std::llround((100.0 + time_s) * 1e6)}}; }

/// What an integrator knows of the vehicle: its file, and of its links the filter of the accelerometer and the usual
/// delay of the telemetry.
UnbalanceParams params_of(const Multirotor& vehicle) {
  UnbalanceParams params;
  params.vehicle = vehicle;
  params.low_pass_Hz = 180.0;
  params.speed_latency_s = 0.0085;
  return params;
}

std::unique_ptr<UnbalanceMonitor> monitor_of(const UnbalanceParams& params) {
  if (params.vehicle.rotor_count == 6) return std::make_unique<RotorUnbalanceMonitor<6>>(params);
  return std::make_unique<RotorUnbalanceMonitor<4>>(params);
}

/// Feeds a flight to phase and monitor, and keeps who was blamed when.
class Judge final : public Output {
 public:
  explicit Judge(const UnbalanceParams& params)
      : rotors_{params.vehicle.rotor_count}, phase_{params.vehicle}, monitor_{monitor_of(params)} {}

  void on_truth(const Truth&) override {}
  void on_imu(const ImuSample& sample) override {
    const Eigen::Vector3d& a = sample.accel_m_s2;
    const Eigen::Vector3d& gyro = sample.gyro_rad_s;
    phase_.on_imu(at(sample.time_s), {a.x(), a.y(), a.z()}, {gyro.x(), gyro.y(), gyro.z()});
    monitor_->on_phase(phase_.phase());
    flies_ = phase_.phase() == Phase::kInFlight;
    if (flies_ && flies_since_s_ < 0.0) flies_since_s_ = sample.time_s;
    if (monitor_->on_accel(at(sample.time_s), a.x(), a.y(), sample.averaging_window_s)) note(sample.time_s);
  }
  void on_esc(const EscSample& sample) override {
    std::array<double, kMaxRotors> speeds{};
    for (std::size_t i = 0; i < rotors_; ++i) speeds[i] = sample.speed_rpm[i] * std::numbers::pi / 30.0;
    phase_.on_rotor_speeds(at(sample.time_s), std::span{speeds}.first(rotors_));
    monitor_->on_speeds(at(sample.time_s), std::span{speeds}.first(rotors_));
  }
  void on_attitude(const AutopilotSample&) override {}
  void on_commands(const AutopilotSample&) override {}
  void on_flight_state(const AutopilotSample&, LandedState) override {}

  struct Amplitude {
    double magnitude_sum = 0.0;
    double square_sum = 0.0;
    int count = 0;
  };

  std::uint32_t blamed = 0;      ///< bit i: rotor i + 1
  double blamed_at_s = -1.0;     ///< the first
  double blamed_after_s = -1.0;  ///< the same, since the vehicle flies
  std::uint32_t candidates = 0;  ///< of an unbalance that is nobody's
  std::array<Amplitude, kMaxRotors> amplitude{};
  [[nodiscard]] const UnbalanceMonitor& monitor() const { return *monitor_; }

 private:
  void note(double time_s) {
    for (std::size_t i = 0; i < rotors_; ++i) {
      const RotorUnbalance& rotor = monitor_->rotors()[i];
      if (rotor.transition == Transition::kRaise) {
        blamed |= 1U << i;
        if (blamed_at_s < 0.0) {
          blamed_at_s = time_s;
          blamed_after_s = time_s - flies_since_s_;
        }
      }
      if (flies_ && time_s - flies_since_s_ > 5.0 && rotor.reason == UnbalanceNotJudged::kJudged) {
        amplitude[i].magnitude_sum += rotor.amplitude_m_s2;
        amplitude[i].square_sum += rotor.amplitude_m_s2 * rotor.amplitude_m_s2;
        ++amplitude[i].count;
      }
    }
    if (monitor_->ambiguity() == Transition::kRaise) candidates |= monitor_->candidates();
  }

  std::size_t rotors_;
  FlightPhase phase_;
  std::unique_ptr<UnbalanceMonitor> monitor_;
  bool flies_ = false;
  double flies_since_s_ = -1.0;
};

Scenario plan(Manoeuvre manoeuvre, double duration_s, std::size_t rotor = 0, double tip_mass_mg = 0.0) {
  std::vector<Fault> faults;
  if (rotor != 0) {
    faults.push_back(
        Fault{.kind = FaultKind::kUnbalance, .rotor = rotor, .magnitude = tip_mass_mg, .angle_rad = 0.0});
  }
  return plan_of({Segment{.manoeuvre = Manoeuvre::kGround, .duration_s = 1.0},
                  Segment{.manoeuvre = Manoeuvre::kTakeOff, .duration_s = 3.0},
                  Segment{.manoeuvre = manoeuvre, .duration_s = duration_s}},
                 faults);
}

void fly(Judge& judge, const Multirotor& vehicle, const Scenario& scenario, const Realism& realism,
         Seeds seeds) {
  Simulation simulation{vehicle, scenario, realism, seeds};
  while (simulation.time_s() < scenario.duration_s()) simulation.step(judge);
}

/// The baseline of a vehicle: mean and spread of each rotor's amplitude in a healthy flight.
UnbalanceParams calibrated(const Multirotor& vehicle, const Realism& realism, std::uint64_t seed) {
  UnbalanceParams params = params_of(vehicle);
  Judge judge{params};
  fly(judge, vehicle, plan(Manoeuvre::kRandom, 36.0), realism, {seed, 1000 + seed});
  params.has_baseline = true;
  for (std::size_t i = 0; i < vehicle.rotor_count; ++i) {
    const auto& amplitude = judge.amplitude[i];
    EXPECT_GT(amplitude.count, 100) << "rotor " << i + 1;
    const double mean = amplitude.magnitude_sum / std::max(1, amplitude.count);
    params.baseline_m_s2[i] = mean;
    params.baseline_sigma_m_s2[i] =
        std::sqrt(std::max(0.0, amplitude.square_sum / std::max(1, amplitude.count) - mean * mean));
  }
  return params;
}

struct Case {
  const char* vehicle;
  double tip_mass_mg;
};
constexpr std::array kCases{Case{"unbalance_small", 5.0}, Case{"unbalance_medium", 40.0},
                            Case{"unbalance_hexa", 40.0}};

TEST(UnbalanceSim, TheRightRotorIsBlamedWithinFiveSecondsAndNobodyWhenHealthy) {
  const Realism hard = Realism::at(Level::kHard);
  for (const Case& one : kCases) {
    const Multirotor vehicle = vehicle_named(one.vehicle);
    for (const std::uint64_t seed : {1U, 2U}) {
      const UnbalanceParams params = calibrated(vehicle, hard, seed);
      for (const Manoeuvre manoeuvre : {Manoeuvre::kCircle, Manoeuvre::kRandom}) {
        const std::size_t rotor =
            1 + (seed + (manoeuvre == Manoeuvre::kCircle ? 0 : 2)) % vehicle.rotor_count;
        Judge damaged{params};
        fly(damaged, vehicle, plan(manoeuvre, 8.0, rotor, one.tip_mass_mg), hard, {seed, 20 + seed});
        Judge healthy{params};
        fly(healthy, vehicle, plan(manoeuvre, 12.0), hard, {seed, 40 + seed});
        const auto text = ::testing::Message() << one.vehicle << ", seed " << seed << ", "
                                               << (manoeuvre == Manoeuvre::kCircle ? "circle" : "random");
        EXPECT_EQ(damaged.blamed, 1U << (rotor - 1)) << text;
        EXPECT_GE(damaged.blamed_after_s, 0.0) << text;
        EXPECT_LE(damaged.blamed_after_s, 5.0) << text;
        EXPECT_EQ(healthy.blamed, 0U) << text;
        EXPECT_EQ(healthy.candidates, 0U) << text;
        const RotorUnbalance& found = damaged.monitor().rotors()[rotor - 1];
        std::printf(
            "%-17s seed %llu %s: rotor %zu after %.2f s, %.2f m/s2 over the baseline of %.2f, NIS %.2f\n",
            one.vehicle, static_cast<unsigned long long>(seed),
            manoeuvre == Manoeuvre::kCircle ? "circle" : "random", rotor, damaged.blamed_after_s,
            found.growth_m_s2, params.baseline_m_s2[rotor - 1], damaged.monitor().innovation().nis);
      }
    }
  }
}

TEST(UnbalanceSim, AChipInMidFlightIsFoundWithinThreeSeconds) {
  const Realism hard = Realism::at(Level::kHard);
  constexpr double kOnset_s = 10.0;
  for (const Case& one : kCases) {
    const Multirotor vehicle = vehicle_named(one.vehicle);
    Judge judge{calibrated(vehicle, hard, 4)};
    Scenario scenario = plan(Manoeuvre::kRandom, 12.0, 3, one.tip_mass_mg);
    scenario.faults[0].onset_s = kOnset_s;
    fly(judge, vehicle, scenario, hard, {4, 70});
    EXPECT_EQ(judge.blamed, 0b0100U) << one.vehicle;
    EXPECT_GT(judge.blamed_at_s, kOnset_s) << one.vehicle;
    EXPECT_LT(judge.blamed_at_s, kOnset_s + 3.0) << one.vehicle;
    std::printf("%-17s chips: rotor 3 after %.2f s\n", one.vehicle, judge.blamed_at_s - kOnset_s);
  }
}

TEST(UnbalanceSim, HoveringWithRotorsOfOneSpeedNobodyIsBlamedAndThoseOfOneSenseAreListed) {
  const Realism hard = Realism::at(Level::kHard);
  for (const Case& one : kCases) {
    const Multirotor vehicle = vehicle_named(one.vehicle);
    const UnbalanceParams params = calibrated(vehicle, hard, 3);
    // Enough to show beside the sum of the baselines.
    Judge judge{params};
    fly(judge, vehicle, plan(Manoeuvre::kHover, 16.0, 2, 6.0 * one.tip_mass_mg), hard.with_rotors_alike(),
        {3, 60});
    EXPECT_EQ(judge.blamed, 0U) << one.vehicle;
    // Rotors 1 and 2 of the quadrotors, 2, 4 and 6 of the hexarotor turn the same way at the same speed.
    EXPECT_EQ(judge.monitor().rotors()[1].reason, UnbalanceNotJudged::kConfounded) << one.vehicle;
    EXPECT_NE(judge.monitor().rotors()[1].confounded_with, 0U) << one.vehicle;
    EXPECT_EQ(judge.candidates, vehicle.rotor_count == 6 ? 0b101010U : 0b0011U) << one.vehicle;
    Judge healthy{params};
    fly(healthy, vehicle, plan(Manoeuvre::kHover, 16.0), hard.with_rotors_alike(), {3, 61});
    EXPECT_EQ(healthy.blamed, 0U) << one.vehicle;
    EXPECT_EQ(healthy.candidates, 0U) << one.vehicle;
  }
}

}  // namespace
}  // namespace airworthy::sim
