#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <numbers>
#include <string>

#include "core/detectors/actuator/actuator_monitor.h"
#include "core/detectors/flight_phase.h"
#include "sim/simulation.h"
#include "tests/sim/vehicles.h"

namespace airworthy::sim {
namespace {

using actuator::NotJudged;
using Transition = FaultLifeCycle::Transition;

TimePoint at(double time_s) { return TimePoint{Duration{std::llround((100.0 + time_s) * 1e6)}}; }

/// What of a flight reaches the monitor.
struct Links {
  bool has_commands = true;
  double command_rate_Hz = 250.0;
  double esc_rate_Hz = 100.0;
  double esc_held_s = 0.0;  ///< telemetry arrives so long after its stamp
  double spike_s = -1.0;    ///< when one gyro sample says 34 rad/s on all axes; < 0: never
};

/// Feeds a flight to phase and monitor, and keeps who was blamed.
class Watch final : public Output {
 public:
  Watch(const Multirotor& vehicle, const Links& links)
      : links_{links}, rotors_{vehicle.rotor_count}, phase_{vehicle}, monitor_{params_of(vehicle)} {}

  void on_truth(const Truth&) override {}
  void on_imu(const ImuSample& sample) override {
    release(sample.time_s);
    const bool is_spike = links_.spike_s >= 0.0 && std::abs(sample.time_s - links_.spike_s) < 0.00101;
    const Eigen::Vector3d& a = sample.accel_m_s2;
    const Eigen::Vector3d gyro = is_spike ? Eigen::Vector3d::Constant(34.0) : sample.gyro_rad_s;
    phase_.on_imu(at(sample.time_s), {a.x(), a.y(), a.z()}, {gyro.x(), gyro.y(), gyro.z()});
    if (monitor_.on_imu({at(sample.time_s), {a.x(), a.y(), a.z()}, {gyro.x(), gyro.y(), gyro.z()}},
                        phase_.phase()) != UpdateStatus::kFused)
      return;
    judged_s_ += monitor_.reason() == NotJudged::kJudged ? 0.002 : 0.0;
    for (std::size_t i = 0; i < rotors_; ++i) {
      if (monitor_.rotors()[i].transition == Transition::kRaise) note("rotor ", i, sample.time_s);
    }
    for (std::size_t i = 0; i < actuator::kAxes; ++i) {
      if (monitor_.axes()[i].transition == Transition::kRaise) note("axis ", i, sample.time_s);
    }
  }
  void on_esc(const EscSample& sample) override { held_.push_back(sample); }
  void on_attitude(const AutopilotSample&) override {}
  void on_commands(const AutopilotSample& sample) override {
    if (!links_.has_commands) return;
    const auto commands = std::span{sample.control.command_ratio}.first(rotors_);
    phase_.on_rotor_commands(at(sample.time_s), commands);
    monitor_.on_rotor_commands(at(sample.time_s), commands);
  }
  void on_flight_state(const AutopilotSample& sample, LandedState landed) override {
    const double climb_m_s = -sample.estimate.velocity_N_m_s.z();
    phase_.on_report(at(sample.time_s), static_cast<LandedReport>(landed), climb_m_s);
    monitor_.on_climb(climb_m_s);
  }

  [[nodiscard]] const std::string& blamed() const { return blamed_; }
  [[nodiscard]] double first_s() const { return first_s_; }
  [[nodiscard]] double judged_s() const { return judged_s_; }

 private:
  static actuator::ActuatorMonitorParams params_of(const Multirotor& vehicle) {
    actuator::ActuatorMonitorParams params;
    params.vehicle = vehicle;
    return params;
  }
  void release(double now_s) {
    for (; !held_.empty() && held_.front().time_s + links_.esc_held_s <= now_s; held_.pop_front()) {
      std::array<double, kMaxRotors> speeds{};
      for (std::size_t i = 0; i < rotors_; ++i)
        speeds[i] = held_.front().speed_rpm[i] * std::numbers::pi / 30.0;
      phase_.on_rotor_speeds(at(held_.front().time_s), std::span{speeds}.first(rotors_));
      monitor_.on_rotor_speeds(at(held_.front().time_s), std::span{speeds}.first(rotors_));
    }
  }
  void note(const std::string& what, std::size_t number, double time_s) {
    if (blamed_.empty()) first_s_ = time_s;
    blamed_ += what + std::to_string(number + 1) + ", ";
  }

  Links links_;
  std::size_t rotors_;
  FlightPhase phase_;
  actuator::ActuatorMonitor monitor_;
  std::deque<EscSample> held_;
  std::string blamed_;
  double first_s_ = 0.0;
  double judged_s_ = 0.0;
};

/// At hard realism.
Watch fly(const std::string& name, const Links& links, const Scenario& plan, std::uint64_t seed,
          double duration_s = 40.0) {
  const Multirotor vehicle = vehicle_named(name);
  Realism realism = Realism::at(Level::kHard);
  realism.autopilot.command_rate_Hz = links.command_rate_Hz;
  realism.esc.rate_Hz = links.esc_rate_Hz;
  Simulation simulation{vehicle, plan, realism, seed};
  Watch watch{vehicle, links};
  while (simulation.time_s() < duration_s) simulation.step(watch);
  return watch;
}

Scenario manoeuvres(std::vector<Fault> faults = {}) {
  return plan_of({Segment{.manoeuvre = Manoeuvre::kGround, .duration_s = 1.5},
                  Segment{.manoeuvre = Manoeuvre::kTakeOff, .duration_s = 3.0},
                  Segment{.manoeuvre = Manoeuvre::kRandom, .duration_s = 60.0}},
                 std::move(faults));
}

Fault lost_propeller(double onset_s, std::size_t rotor) {
  Fault fault;
  fault.kind = FaultKind::kPropellerLost;
  fault.onset_s = onset_s;
  fault.rotor = rotor;
  fault.magnitude = 1.0;
  return fault;
}

TEST(ActuatorSim, ASpikeOfTheGyroIsNoRotorsFault) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Watch watch = fly("f450", {.spike_s = 15.0}, manoeuvres(), seed, 20.0);
    EXPECT_EQ(watch.blamed(), "") << seed;
    EXPECT_GT(watch.judged_s(), 10.0);
  }
}

TEST(ActuatorSim, AGyroThatFreezesIsNoRotorsFault) {
  const auto plan = Scenario::load(std::string{AIRWORTHY_CONFIG} + "/scenarios/gyro_freeze.toml", 6);
  ASSERT_TRUE(plan.has_value());
  for (const std::uint64_t seed : {12U, 14U, 20U}) {
    const Watch watch = fly("unbalance_hexa", {}, *plan, seed);
    EXPECT_EQ(watch.blamed(), "") << seed;
    EXPECT_GT(watch.judged_s(), 20.0);
  }
}

TEST(ActuatorSim, SlowOrLateInputBlamesNobodyAndALostPropellerIsFound) {
  for (const Links& links :
       {Links{.has_commands = false}, Links{.has_commands = false, .esc_rate_Hz = 50.0},
        Links{.has_commands = false, .esc_rate_Hz = 20.0}, Links{.has_commands = false, .esc_held_s = 0.02},
        Links{.command_rate_Hz = 10.0, .esc_rate_Hz = 20.0}}) {
    for (const std::uint64_t seed : {1U, 2U}) {
      SCOPED_TRACE(::testing::Message() << links.has_commands << ' ' << links.esc_rate_Hz << ' '
                                        << links.esc_held_s << ", seed " << seed);
      const Watch healthy = fly("unbalance_medium", links, manoeuvres(), seed);
      EXPECT_EQ(healthy.blamed(), "");
      EXPECT_GT(healthy.judged_s(), 30.0);
      const Watch lost = fly("unbalance_medium", links, manoeuvres({lost_propeller(25.0, 2)}), seed, 26.0);
      EXPECT_EQ(lost.blamed().substr(0, 7), "rotor 2");
      EXPECT_GT(lost.first_s(), 25.0);
      EXPECT_LT(lost.first_s(), 25.8);
    }
  }
}

}  // namespace
}  // namespace airworthy::sim
