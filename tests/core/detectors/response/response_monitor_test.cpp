#include "core/detectors/response/response_monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include "tests/support/allocation_guard.h"

namespace airworthy::response {
namespace {

using Transition = FaultLifeCycle::Transition;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

MonitorParams thrust_only() {
  MonitorParams params;
  params.min_groundspeed_m_s = 5.0;
  params.channel_count = 1;
  ChannelParams& channel = params.channels[0];
  channel.response.signal = Signal::kAccelX;
  channel.terms[0].signal = Signal::kPitchSetpoint;
  channel.terms[1].signal = Signal::kPitch;
  channel.terms[2].signal = Signal::kAirspeedError;
  channel.terms[3].signal = Signal::kOne;
  channel.term_count = 4;
  channel.regression.terms = 4;
  channel.side = Side::kLow;
  return params;
}

MonitorParams multirotor_thrust_only() {
  MonitorParams params = thrust_only();
  params.min_groundspeed_m_s = 0.0;
  params.needs_flight_phase = true;
  return params;
}

// What many flights like those of Flight teach: its very coefficients.
ChannelPrior thrust_prior() {
  ChannelPrior prior;
  prior.theta = {4.0, 5.0, 0.3, 0.5};
  const std::array<double, 4> mean_square{0.005, 0.005, 0.5, 1.0};
  for (std::size_t i = 0; i < 4; ++i) prior.gram[i * 4 + i] = mean_square[i];
  prior.sigma = 0.25;
  prior.threshold = 6.0;
  prior.worth_samples = 300;
  return prior;
}

MonitorParams warm_thrust_only(bool airspeed_sensor) {
  MonitorParams params = thrust_only();
  params.channels[0].warm_up = Duration{0};
  params.configuration_count = 1;
  params.configurations[0].airspeed_sensor = airspeed_sensor;
  params.configurations[0].priors[0] = thrust_prior();
  return params;
}

/// A straight flight whose forward acceleration is a known function of attitude, command and speed error,
/// plus noise.
class Flight {
 public:
  explicit Flight(unsigned seed, double imu_rate_Hz = 10.0) : random_{seed}, imu_rate_Hz_{imu_rate_Hz} {}

  double fault_at_s = std::numeric_limits<double>::infinity();
  double heals_at_s = std::numeric_limits<double>::infinity();
  double lost_accel_m_s2 = 1.5;
  double groundspeed_m_s = 20.0;
  TimePoint start = from_us(77'000'000);
  std::function<void(ResponseMonitor&, double)> before_sample;  ///< something hostile

  struct Found {
    double at_s;
    double onset_s;
    Transition transition;
  };

  std::vector<Found> fly(ResponseMonitor& monitor, double duration_s) {
    std::vector<Found> found;
    const int samples = static_cast<int>(duration_s * imu_rate_Hz_);
    for (int i = 0; i < samples; ++i) {
      const double t = i / imu_rate_Hz_;
      const TimePoint time = start + from_seconds(t);
      const double setpoint = 0.1 * std::sin(0.3 * t);
      const double pitch = 0.1 * std::sin(0.3 * t - 0.4);
      const double speed_error = std::sin(0.05 * t);
      const int slow_every = static_cast<int>(imu_rate_Hz_ / 5);
      if (i % slow_every == 0) {
        monitor.on_attitude(time, 0.0, pitch);
        monitor.on_attitude_setpoint(time, 0.0, setpoint);
        monitor.on_flight_state({time, 20.0, groundspeed_m_s, 0.0, 0.0, speed_error, 1, -1});
      }
      if (before_sample) before_sample(monitor, t);
      const bool failed = t >= fault_at_s && t < heals_at_s;
      // The noise of one sample grows with the rate, so that a tick's average is equally noisy at every rate.
      const double noise = 0.25 * std::sqrt(imu_rate_Hz_ / 10.0) * normal_(random_);
      const double accel =
          0.5 + 4.0 * setpoint + 5.0 * pitch + 0.3 * speed_error + noise - (failed ? lost_accel_m_s2 : 0.0);
      const double pitch_rate = 0.03 * std::cos(0.3 * t - 0.4);
      if (!monitor.on_imu({time, {accel, 0.0, -9.81}, {0.0, pitch_rate, 0.0}})) continue;
      const ChannelVerdict& verdict = monitor.verdicts()[0];
      if (verdict.transition == Transition::kRaise || verdict.transition == Transition::kClear) {
        found.push_back({t, to_seconds(verdict.onset - start), verdict.transition});
      }
    }
    return found;
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double imu_rate_Hz_;
};

TEST(ResponseMonitor, FindsAThrustLossWithinTwoSeconds) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    ResponseMonitor monitor{thrust_only()};
    Flight flight{seed};
    flight.fault_at_s = 60.0;
    const auto found = flight.fly(monitor, 70.0);
    ASSERT_EQ(found.size(), 1U) << "seed " << seed;
    EXPECT_GE(found[0].at_s, 60.0);
    EXPECT_LE(found[0].at_s, 62.0) << "seed " << seed;
    EXPECT_NEAR(found[0].onset_s, 60.0, 0.6) << "seed " << seed;
    EXPECT_EQ(monitor.state(), DetectorState::kMonitoring);
  }
}

TEST(ResponseMonitor, AWarmStartFindsAFaultBeforeAColdOneHasLearned) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    ResponseMonitor monitor{warm_thrust_only(true)};
    Flight flight{seed};
    flight.fault_at_s = 10.0;
    const auto found = flight.fly(monitor, 15.0);
    ASSERT_EQ(found.size(), 1U) << "seed " << seed;
    EXPECT_GE(found[0].at_s, 10.0);
    EXPECT_LE(found[0].at_s, 11.0) << "seed " << seed;
    EXPECT_EQ(monitor.refused_priors(), 0);
    EXPECT_TRUE(monitor.channel(0).warm());
  }
}

TEST(ResponseMonitor, AWarmStartIsSilentInAnHourOfHealthyFlight) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    ResponseMonitor monitor{warm_thrust_only(true)};
    EXPECT_TRUE(Flight{seed}.fly(monitor, 600.0).empty()) << "seed " << seed;
  }
}

TEST(ResponseMonitor, APriorOfAnotherConfigurationIsNotUsed) {
  ResponseMonitor monitor{warm_thrust_only(false)};  // the flight has an airspeed of 20 m/s
  (void)Flight{1}.fly(monitor, 15.0);
  EXPECT_TRUE(monitor.airspeed_sensor());
  EXPECT_FALSE(monitor.channel(0).warm());
  EXPECT_EQ(monitor.refused_priors(), 0);
}

TEST(ResponseMonitor, APriorThatIsNoneIsRefusedAndCounted) {
  MonitorParams params = warm_thrust_only(true);
  params.configurations[0].priors[0]->gram[5] = -1.0;
  ResponseMonitor monitor{params};
  Flight flight{1};
  flight.fault_at_s = 60.0;
  const auto found = flight.fly(monitor, 70.0);
  EXPECT_EQ(monitor.refused_priors(), 1);
  EXPECT_FALSE(monitor.channel(0).warm());
  EXPECT_EQ(found.size(), 1U) << "it starts cold";
}

TEST(ResponseMonitor, SilentInAnHourOfHealthyFlight) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    ResponseMonitor monitor{thrust_only()};
    EXPECT_TRUE(Flight{seed}.fly(monitor, 600.0).empty()) << "seed " << seed;
    EXPECT_EQ(monitor.state(), DetectorState::kMonitoring);
  }
}

TEST(ResponseMonitor, MoreThrustIsNotAThrustLoss) {
  ResponseMonitor monitor{thrust_only()};
  Flight flight{1};
  flight.fault_at_s = 60.0;
  flight.lost_accel_m_s2 = -3.0;
  EXPECT_TRUE(flight.fly(monitor, 61.8).empty());
}

TEST(ResponseMonitor, ClearsWhenTheThrustComesBack) {
  ResponseMonitor monitor{thrust_only()};
  Flight flight{3};
  flight.fault_at_s = 60.0;
  flight.heals_at_s = 75.0;
  const auto found = flight.fly(monitor, 120.0);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[1].transition, Transition::kClear);
  EXPECT_GT(found[1].at_s, 80.0);
  EXPECT_LT(found[1].at_s, 90.0);
}

TEST(ResponseMonitor, ALastingFaultIsNeverLearned) {
  ResponseMonitor monitor{thrust_only()};
  Flight flight{3};
  flight.fault_at_s = 60.0;
  const auto found = flight.fly(monitor, 600.0);
  ASSERT_EQ(found.size(), 1U) << "raised once, never cleared";
}

TEST(ResponseMonitor, ALargerFaultIsNeverFoundLater) {
  double last = std::numeric_limits<double>::infinity();
  for (const double size : {0.8, 1.2, 2.0, 4.0, 8.0}) {
    ResponseMonitor monitor{thrust_only()};
    Flight flight{5};
    flight.fault_at_s = 60.0;
    flight.lost_accel_m_s2 = size;
    const auto found = flight.fly(monitor, 90.0);
    ASSERT_FALSE(found.empty()) << size;
    EXPECT_LE(found[0].at_s, last);
    last = found[0].at_s;
  }
}

TEST(ResponseMonitor, TheRateOfTheInertialUnitDoesNotMatter) {
  for (const double rate_Hz : {10.0, 50.0, 200.0, 500.0}) {
    ResponseMonitor monitor{thrust_only()};
    Flight flight{2, rate_Hz};
    flight.fault_at_s = 60.0;
    const auto found = flight.fly(monitor, 70.0);
    ASSERT_EQ(found.size(), 1U) << rate_Hz;
    EXPECT_LE(found[0].at_s, 62.0) << rate_Hz;
  }
}

TEST(ResponseMonitor, ATimeShiftChangesNothing) {
  std::vector<Flight::Found> reference;
  for (const std::int64_t start_us : {77'000'000LL, 1'539'875'267'000'000LL}) {
    ResponseMonitor monitor{thrust_only()};
    Flight flight{9};
    flight.start = from_us(start_us);
    flight.fault_at_s = 50.0;
    const auto found = flight.fly(monitor, 60.0);
    ASSERT_EQ(found.size(), 1U);
    if (reference.empty()) {
      reference = found;
    } else {
      EXPECT_EQ(found[0].at_s, reference[0].at_s);
      EXPECT_NEAR(found[0].onset_s, reference[0].onset_s, 1e-6);
    }
  }
}

// A quadrotor's lift from four commands: which one is too weak does not matter, what is commanded does.
TEST(ResponseMonitor, APairMayHaveSeveralInputs) {
  MonitorParams params;
  params.channel_count = 1;
  params.tick_period = Duration{50'000};
  ChannelParams& channel = params.channels[0];
  channel.response.signal = Signal::kAccelZ;
  for (std::size_t i = 0; i < 4; ++i) {
    channel.terms[i].signal = static_cast<Signal>(static_cast<std::size_t>(Signal::kCommand0) + i);
  }
  channel.terms[4].signal = Signal::kOne;
  channel.term_count = channel.regression.terms = 5;
  channel.side = Side::kHigh;
  for (const bool fails : {false, true}) {
    ResponseMonitor monitor{params};
    std::mt19937 random{7};
    std::normal_distribution<double> normal;
    std::optional<double> raised_s;
    for (int i = 0; i < 60 * 100; ++i) {
      const double t = 0.01 * i;
      const TimePoint time = from_us(1'000'000) + from_seconds(t);
      std::array<double, 4> command{};
      double lift = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        command[k] = 0.5 + 0.1 * std::sin(0.3 * t * static_cast<double>(k + 1));
        lift += 4.9 * command[k] * (fails && k == 2 && t >= 50 ? 0.5 : 1.0);
      }
      monitor.on_rotor_command(time, command);
      if (!monitor.on_imu({time, {0, 0, -lift + 0.3 * normal(random)}, {0, 0, 0}})) continue;
      if (monitor.verdicts()[0].transition == Transition::kRaise) raised_s = t;
    }
    EXPECT_EQ(raised_s.has_value(), fails);
    if (raised_s) {
      EXPECT_GE(*raised_s, 50.0);
      EXPECT_LE(*raised_s, 51.0);
    }
  }
}

// A link that carries attitude and set-points, but hardly any inertial data.
TEST(ResponseMonitor, TheAttitudeMaySetThePace) {
  MonitorParams params;
  params.pace = Pace::kAttitude;
  params.longest_gap = Duration{3'000'000};
  params.channel_count = 1;
  ChannelParams& channel = params.channels[0];
  channel.response.signal = Signal::kRollRate;
  channel.terms[0].signal = Signal::kRollError;
  channel.terms[0].delay_ticks = 1;
  channel.terms[1].signal = Signal::kOne;
  channel.term_count = channel.regression.terms = 2;
  for (const bool fails : {false, true}) {
    ResponseMonitor monitor{params};
    std::mt19937 random{5};
    std::normal_distribution<double> normal;
    double roll = 0;
    std::optional<double> raised_s;
    for (int i = 0; i < 900; ++i) {
      const double t = 0.1 * i;
      const TimePoint time = from_us(1'000'000) + from_seconds(t);
      const double setpoint = 0.5 * std::sin(0.4 * t);
      const bool failed = fails && t >= 70;
      // In the fault the vehicle rolls away.
      roll += 0.1 * ((failed ? -0.3 : 1.5 * (setpoint - roll)) + 0.05 * normal(random));
      monitor.on_attitude_setpoint(time, setpoint, 0.0);
      EXPECT_FALSE(monitor.on_imu({time, {0, 0, -9.81}, {0, 0, 0}})) << "not the pace";
      if (!monitor.on_attitude(time, roll, 0.0)) continue;
      if (monitor.verdicts()[0].transition == Transition::kRaise) raised_s = t;
    }
    EXPECT_EQ(monitor.state(), DetectorState::kMonitoring);
    EXPECT_EQ(raised_s.has_value(), fails);
    if (raised_s) {
      EXPECT_GE(*raised_s, 70.0);
      EXPECT_LE(*raised_s, 74.0);
    }
  }
}

// Everything hostile is refused, counted, and the verdict is the same as without it.
TEST(ResponseMonitor, HostileSamplesChangeNothing) {
  Flight clean{4};
  clean.fault_at_s = 60.0;
  ResponseMonitor reference{thrust_only()};
  const auto expected = clean.fly(reference, 70.0);
  ASSERT_EQ(expected.size(), 1U);

  Flight hostile{4};
  hostile.fault_at_s = 60.0;
  hostile.before_sample = [&](ResponseMonitor& monitor, double t) {
    const TimePoint now = hostile.start + from_seconds(t);
    EXPECT_FALSE(monitor.on_imu({now, {kNan, 0, 0}, {0, 0, 0}}));
    EXPECT_FALSE(monitor.on_imu({now, {0, 0, 0}, {0, HUGE_VAL, 0}}));
    if (t > 0) {
      EXPECT_FALSE(monitor.on_imu({now - Duration{100'000}, {9, 9, 9}, {9, 9, 9}}));
    }
    monitor.on_attitude(now, kNan, 0.0);
    monitor.on_attitude(now - Duration{1'000'000}, 1.0, 1.0);
    monitor.on_attitude_setpoint(now, 0.0, kNan);
    monitor.on_attitude_setpoint(now - Duration{1'000'000}, 1.0, 1.0);
    monitor.on_flight_state({now - Duration{1'000'000}, 0, 0, 0, 99, 99, 0, 1});
  };
  ResponseMonitor monitor{thrust_only()};
  const auto found = hostile.fly(monitor, 70.0);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].at_s, expected[0].at_s);
  EXPECT_EQ(found[0].onset_s, expected[0].onset_s);
  EXPECT_GT(monitor.refused_samples(), 700 * 7);
}

TEST(ResponseMonitor, TicksOfTheClockNeverTouchTheEvidence) {
  Flight clean{4};
  clean.fault_at_s = 60.0;
  ResponseMonitor reference{thrust_only()};
  const auto expected = clean.fly(reference, 70.0);
  Flight ticking{4};
  ticking.fault_at_s = 60.0;
  ticking.before_sample = [&](ResponseMonitor& monitor, double t) {
    monitor.on_clock(ticking.start + from_seconds(t) + Duration{5'000'000});  // even absurdly late ones
  };
  ResponseMonitor monitor{thrust_only()};
  const auto found = ticking.fly(monitor, 70.0);
  ASSERT_EQ(found.size(), expected.size());
  EXPECT_EQ(found[0].at_s, expected[0].at_s);
}

TEST(ResponseMonitor, SilenceMutesAndHeals) {
  ResponseMonitor monitor{thrust_only()};
  Flight flight{6};
  (void)flight.fly(monitor, 60.0);
  monitor.on_clock(flight.start + from_seconds(60.5));
  EXPECT_EQ(monitor.state(), DetectorState::kMonitoring);
  monitor.on_clock(flight.start + from_seconds(61.5));
  EXPECT_EQ(monitor.state(), DetectorState::kMuted);
  EXPECT_EQ(monitor.muted(), Muted::kInputStale);
  Flight later{7};
  later.start = flight.start + from_seconds(90.0);
  EXPECT_TRUE(later.fly(monitor, 30.0).empty()) << "a gap is not a fault";
  EXPECT_EQ(monitor.gaps(), 1);
  EXPECT_EQ(monitor.state(), DetectorState::kMonitoring);
}

TEST(ResponseMonitor, MutedWhileNotFlying) {
  ResponseMonitor monitor{thrust_only()};
  Flight flight{6};
  flight.groundspeed_m_s = 1.0;
  flight.fault_at_s = 60.0;
  EXPECT_TRUE(flight.fly(monitor, 70.0).empty());
  EXPECT_EQ(monitor.state(), DetectorState::kMuted);
  EXPECT_EQ(monitor.muted(), Muted::kNotFlying);
}

TEST(ResponseMonitor, AnUnknownGroundspeedDoesNotMute) {
  ResponseMonitor monitor{thrust_only()};
  Flight flight{6};
  flight.groundspeed_m_s = kNan;
  flight.fault_at_s = 60.0;
  EXPECT_EQ(flight.fly(monitor, 70.0).size(), 1U);
}

// Says the phase before each sample: in flight but from `landed_s` until `started_s`.
struct Landing {
  double landed_s = 0.0;
  double started_s = 0.0;

  void apply(Flight& flight) const {
    flight.before_sample = [*this](ResponseMonitor& monitor, double t) {
      monitor.on_phase(t < landed_s || t >= started_s ? Phase::kInFlight : Phase::kLanding);
    };
  }
};

TEST(ResponseMonitor, AMultirotorIsJudgedInFlightOnly) {
  ResponseMonitor monitor{multirotor_thrust_only()};
  Flight flight{6};
  flight.fault_at_s = 60.0;  // as the ground does what no command asked for
  Landing{60.0, 1e9}.apply(flight);
  EXPECT_TRUE(flight.fly(monitor, 70.0).empty());
  EXPECT_EQ(monitor.state(), DetectorState::kMuted);
  EXPECT_EQ(monitor.muted(), Muted::kNotInFlight);
  EXPECT_EQ(monitor.muted_phase(), Phase::kLanding);
  EXPECT_EQ(monitor.verdicts()[0].reason, NotJudged::kPaused);
}

TEST(ResponseMonitor, AMultirotorOfUnknownPhaseIsNotJudged) {
  ResponseMonitor monitor{multirotor_thrust_only()};
  Flight flight{6};
  flight.fault_at_s = 60.0;
  EXPECT_TRUE(flight.fly(monitor, 70.0).empty());
  EXPECT_EQ(monitor.muted(), Muted::kNotInFlight);
  EXPECT_EQ(monitor.muted_phase(), Phase::kUnknown);
}

TEST(ResponseMonitor, ATickPartlyOnTheGroundIsNotJudged) {
  ResponseMonitor monitor{multirotor_thrust_only()};
  bool touched = true;  // since the last tick; not in flight before it is said
  int muted = 0;
  for (int i = 0; i < 2000; ++i) {  // about ten samples a tick
    const Phase phase = i % 100 == 55 ? Phase::kContact : Phase::kInFlight;
    monitor.on_phase(phase);
    touched = touched || phase == Phase::kContact;
    if (!monitor.on_imu({from_us(1'000'000 + i * 10'000), {0.5, 0.0, -9.81}, {}})) continue;
    ASSERT_EQ(monitor.muted(), touched ? Muted::kNotInFlight : Muted::kNo) << i;
    muted += touched ? 1 : 0;
    touched = false;
  }
  EXPECT_EQ(muted, 21);
  EXPECT_EQ(monitor.muted_phase(), Phase::kContact);
}

TEST(ResponseMonitor, ALandingTakesNoEvidenceIntoTheNextFlight) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    ResponseMonitor monitor{multirotor_thrust_only()};
    Flight flight{seed};
    // Half of what an alarm takes comes before a landing, half after the next take-off.
    flight.fault_at_s = 60.0;
    flight.heals_at_s = 70.2;
    flight.lost_accel_m_s2 = 10.0;
    Landing{60.2, 70.0}.apply(flight);
    EXPECT_TRUE(flight.fly(monitor, 90.0).empty()) << "seed " << seed;
  }
  ResponseMonitor monitor{multirotor_thrust_only()};
  Flight flight{1};
  flight.fault_at_s = 60.0;
  flight.heals_at_s = 60.4;
  flight.lost_accel_m_s2 = 10.0;
  Landing{1e9, 1e9}.apply(flight);
  EXPECT_FALSE(flight.fly(monitor, 90.0).empty()) << "both halves in one flight are an alarm";
}

TEST(ResponseMonitor, NothingIsLearnedOnTheGround) {
  ResponseMonitor monitor{multirotor_thrust_only()};
  Flight flight{2};
  flight.fault_at_s = 60.0;
  flight.heals_at_s = 180.0;
  Landing{60.0, 180.0}.apply(flight);
  EXPECT_TRUE(flight.fly(monitor, 240.0).empty());
  ResponseMonitor airborne{multirotor_thrust_only()};
  Flight same{2};
  Landing{1e9, 1e9}.apply(same);
  EXPECT_TRUE(same.fly(airborne, 240.0).empty());
  EXPECT_NEAR(monitor.verdicts()[0].expected, airborne.verdicts()[0].expected, 0.1)
      << "1.5 m/s² were lost for two minutes";
  EXPECT_NEAR(monitor.verdicts()[0].sigma, airborne.verdicts()[0].sigma, 0.05);
}

TEST(ResponseMonitor, WhatBeganBeforeALandingWasSeenIsNotLearnedEither) {
  ResponseMonitor touched{multirotor_thrust_only()};
  ResponseMonitor untouched{multirotor_thrust_only()};
  Flight flight{2};
  Flight same{2};
  flight.fault_at_s = 59.0;
  flight.heals_at_s = 60.0;
  flight.lost_accel_m_s2 = -10.0;  // more of it is no fault here
  for (Flight* one : {&flight, &same}) Landing{60.0, 70.0}.apply(*one);
  EXPECT_TRUE(flight.fly(touched, 120.0).empty());
  EXPECT_TRUE(same.fly(untouched, 120.0).empty());
  EXPECT_EQ(touched.verdicts()[0].expected, untouched.verdicts()[0].expected);
  EXPECT_EQ(touched.verdicts()[0].sigma, untouched.verdicts()[0].sigma);
}

TEST(ResponseMonitor, AFaultThatWasFoundOutlastsTheLanding) {
  ResponseMonitor monitor{multirotor_thrust_only()};
  Flight flight{3};
  flight.fault_at_s = 60.0;
  flight.heals_at_s = 63.0;
  Landing{66.0, 100.0}.apply(flight);  // when 5 s without evidence have begun
  const auto found = flight.fly(monitor, 130.0);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_LT(found[0].at_s, 62.0);
  EXPECT_EQ(found[1].transition, Transition::kClear);
  EXPECT_GE(found[1].at_s, 105.0) << "healthy for 5 s in flight";
}

TEST(ResponseMonitor, WhatIsSmallerThanItsLeastSigmaIsNoFault) {
  for (const bool is_floored : {false, true}) {
    MonitorParams params = thrust_only();
    if (is_floored) params.channels[0].least_sigma = 0.75;  // three times the noise
    for (const double lost_m_s2 : {0.8, 2.5}) {
      ResponseMonitor monitor{params};
      Flight flight{1};
      flight.fault_at_s = 60.0;
      flight.lost_accel_m_s2 = lost_m_s2;
      EXPECT_EQ(flight.fly(monitor, 80.0).empty(), is_floored && lost_m_s2 < 1.0) << lost_m_s2;
      if (is_floored) {
        EXPECT_EQ(monitor.verdicts()[0].sigma, 0.75);
      }
    }
  }
}

TEST(ResponseMonitor, AFixedWingHasNoFlightPhase) {
  ResponseMonitor told{thrust_only()};
  ResponseMonitor untold{thrust_only()};
  Flight flight{4};
  Flight same{4};
  flight.fault_at_s = same.fault_at_s = 60.0;
  flight.before_sample = [](ResponseMonitor& monitor, double) { monitor.on_phase(Phase::kContact); };
  const auto found = flight.fly(told, 70.0);
  const auto also = same.fly(untold, 70.0);
  ASSERT_EQ(found.size(), 1U);
  ASSERT_EQ(also.size(), 1U);
  EXPECT_EQ(found[0].at_s, also[0].at_s);
  EXPECT_EQ(told.verdicts()[0].test_ratio, untold.verdicts()[0].test_ratio);
}

TEST(ResponseMonitor, MissingAttitudeIsNotJudged) {
  ResponseMonitor monitor{thrust_only()};
  std::mt19937 random{1};
  std::normal_distribution<double> normal;
  for (int i = 0; i < 600; ++i) {
    (void)monitor.on_imu({from_us(1'000'000 + i * 100'000), {normal(random), 0, -9.81}, {0, 0, 0}});
  }
  EXPECT_EQ(monitor.verdicts()[0].reason, NotJudged::kInputUnknown);
  EXPECT_EQ(monitor.state(), DetectorState::kConverging);
}

TEST(ResponseMonitor, UsesNoHeap) {
  ResponseMonitor monitor{thrust_only()};
  Flight flight{1};
  (void)flight.fly(monitor, 40.0);
  const TimePoint end = flight.start + from_seconds(40.0);
  const test::AllocationGuard guard;
  for (int i = 0; i < 100; ++i) {
    (void)monitor.on_imu({end + Duration{i * 100'000}, {0.5, 0, -9.81}, {0, 0, 0}});
  }
  EXPECT_EQ(guard.allocations(), 0U);
}

}  // namespace
}  // namespace airworthy::response
