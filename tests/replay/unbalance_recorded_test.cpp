// Order tracking on recorded vibration. The long evaluation is `tools/evidence unbalance_recorded`.

#include <gtest/gtest.h>

#include <cmath>

#include "core/estimators/unbalance/order_tracker.h"
#include "tests/support/recorded_data.h"
#include "tests/support/recorded_sets.h"

namespace airworthy::testing {
namespace {

struct Tracked {
  double residual_m2_s4 = 0.0;  ///< mean square of the innovations of both axes
  std::array<double, 4> speed_error_ratio{};
};

/// The Bebop from 2.5 s on with scaled speeds; the first two seconds do not count.
Tracked track(const RecordedSet& set, double scale, double most_speed_error_ratio) {
  OrderTracker<double, 4> tracker{
      {.reference_speed_rad_s = UnbalanceMonitor::hover_speed_rad_s(set.params.vehicle),
       .smallest_m_s2 = set.params.smallest_m_s2,
       .most_speed_error_ratio = most_speed_error_ratio}};
  const RecordedFlight& flight = set.flights.front();
  Tracked result;
  double count = 0.0;
  for (std::size_t k = 0; k < flight.rows.size(); ++k) {
    const double time_s = flight.seconds_at(k);
    if (time_s < kBebopFrom_s || time_s > kBebopTo_s) continue;
    auto speed = flight.rows[k].speed_rad_s;
    for (double& one : speed) one *= scale;
    tracker.on_speeds(flight.rows[k].time, speed);
    const auto& accel = flight.rows[k].accel_m_s2;
    static_cast<void>(tracker.on_accel(flight.rows[k].time, accel[0], accel[1], 0.0));
    if (time_s < kBebopFrom_s + 2.0) continue;
    const auto& innovation = tracker.innovation();
    result.residual_m2_s4 += innovation.x_m_s2 * innovation.x_m_s2 + innovation.y_m_s2 * innovation.y_m_s2;
    count += 1.0;
  }
  result.residual_m2_s4 /= count;
  for (std::size_t i = 0; i < 4; ++i) result.speed_error_ratio[i] = tracker.speed_error_ratio(i);
  return result;
}

/// Sets are read once.
const RecordedSet& bebop() {
  static const RecordedSet set = bebop_set(recorded_data());
  return set;
}

TEST(RecordedUnbalance, TheBebopShakesInTimeWithItsRotorsAndNotWithDetunedOnes) {
  if (bebop().flights.empty()) GTEST_SKIP() << "no recorded flights in " << recorded_data();
  const double right = 1.0 + bebop().clock_error[0];
  const double residual = track(bebop(), right, 0.0).residual_m2_s4;
  // 92 % is explained with the true speeds; a tenth may remain, where all remains of detuned ones.
  for (const double detuned : {0.80, 0.95, 0.97, 1.03, 1.07, 1.20}) {
    EXPECT_GT(track(bebop(), right * detuned, 0.0).residual_m2_s4, 8.0 * residual) << detuned;
  }
}

TEST(RecordedUnbalance, TheBebopsRotorsShareOneClockErrorThatEachOfThemShows) {
  if (bebop().flights.empty()) GTEST_SKIP() << "no recorded flights in " << recorded_data();
  const Tracked followed = track(bebop(), 1.0, 0.01);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(followed.speed_error_ratio[i], followed.speed_error_ratio[0], 0.0005) << "rotor " << i + 1;
    EXPECT_LT(followed.speed_error_ratio[i], -0.004) << "rotor " << i + 1;
  }
  EXPECT_LT(followed.residual_m2_s4, 0.25 * track(bebop(), 1.0, 0.0).residual_m2_s4);
}

TEST(RecordedUnbalance, TheBebopIsSilentBesideTheBaselineOfItsFirstHalf) {
  if (bebop().flights.empty()) GTEST_SKIP() << "no recorded flights in " << recorded_data();
  UnbalanceParams params = bebop().params;
  const UnbalanceFlight first = judge_unbalance(bebop().flights.front(), params);
  const auto amplitudes = amplitudes_by_second(first, kBebopFrom_s + 1.5, kBebopHalf_s);
  learn_baseline(amplitudes, params);
  ASSERT_TRUE(params.has_baseline);
  const UnbalanceFlight flight = judge_unbalance(bebop().flights.front(), params);
  EXPECT_TRUE(flight.reports.empty());
  EXPECT_TRUE(flight.ambiguities_s.empty());
  EXPECT_GT(flight.seconds_by_reason[1][0], 8.0) << "of judging rotor 2";
}

RecordedSet thrown() {
  RecordedSet set = thrown_set({});  // without flights
  set.flights = load_all(recorded_data() / set.name, load_thrown, "LOG00281");
  return set;
}

TEST(RecordedUnbalance, AThrownQuadIsSilentThroughViolentMotion) {
  const RecordedSet set = thrown();
  if (set.flights.empty()) GTEST_SKIP() << "no recorded flights in " << recorded_data();
  const UnbalanceFlight flight = judge_unbalance(set.flights.front(), set.params);
  EXPECT_TRUE(flight.reports.empty());
  EXPECT_TRUE(flight.ambiguities_s.empty());
  for (const auto& seconds : flight.seconds_by_reason) EXPECT_GT(seconds[0], 30.0) << "of judging";
}

TEST(RecordedUnbalance, AnUnbalanceAddedToAThrownQuadIsFoundOnItsRotor) {
  const RecordedSet set = thrown();
  if (set.flights.empty()) GTEST_SKIP() << "no recorded flights in " << recorded_data();
  // 9 m/s² on the airframe are 0.14 m/s² behind the sensor's low-pass, seven times the threshold.
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    const AddedUnbalance added{.rotor = rotor, .amplitude_m_s2 = 9.0, .onset_s = 8.0};
    const auto flight = judge_unbalance(add_unbalance(set.flights.front(), set, added, 11), set.params);
    ASSERT_EQ(flight.reports.size(), 1U) << "rotor " << rotor + 1;
    EXPECT_EQ(flight.reports[0].rotor, rotor);
    EXPECT_GT(flight.reports[0].time_s, added.onset_s);
    EXPECT_LT(flight.reports[0].time_s, added.onset_s + 6.0);
  }
}

TEST(RecordedUnbalance, ACrazyflieBehindALowPassIsNotJudgedAndSaysWhy) {
  RecordedSet set = crazyflie_set({});
  set.flights = load_all(recorded_data() / set.name, load_crazyflie, "square_run2");
  if (set.flights.empty()) GTEST_SKIP() << "no recorded flights in " << recorded_data();
  const UnbalanceFlight flight = judge_unbalance(set.flights.front(), set.params);
  EXPECT_TRUE(flight.reports.empty());
  EXPECT_TRUE(flight.ambiguities_s.empty());
  for (const auto& seconds : flight.seconds_by_reason) {
    EXPECT_EQ(seconds[static_cast<std::size_t>(UnbalanceNotJudged::kJudged)], 0.0);
    EXPECT_GT(seconds[static_cast<std::size_t>(UnbalanceNotJudged::kUnfitInertialData)], 15.0);
  }
}

}  // namespace
}  // namespace airworthy::testing
