#include "core/estimators/effectiveness/stream_delay.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "tests/support/allocation_guard.h"

namespace airworthy {
namespace {

using Delay = StreamDelay<double>;

constexpr double kStep_s = 0.01;

/// Manoeuvres: roll and pitch acceleration at any time.
std::array<double, 2> acceleration(double t) {
  return {20.0 * std::sin(7.0 * t) + 15.0 * std::sin(19.0 * t + 1.0),
          18.0 * std::cos(6.0 * t) + 16.0 * std::sin(23.0 * t)};
}
/// Its integral.
std::array<double, 2> rate(double t) {
  return {-20.0 / 7.0 * std::cos(7.0 * t) - 15.0 / 19.0 * std::cos(19.0 * t + 1.0),
          18.0 / 6.0 * std::sin(6.0 * t) - 16.0 / 23.0 * std::cos(23.0 * t)};
}

/// A gyroscope whose stamps are `late` behind, with noise of its own and, if it does not answer, with nothing else.
void fly(Delay& delay, double seconds, double late_s, bool answers = true) {
  std::mt19937 random{3};
  std::normal_distribution<double> normal;
  for (double t = 0.0; t < seconds; t += kStep_s) {
    const auto truth = rate(t - late_s);
    const std::array gyro{(answers ? truth[0] : 0.0) + 0.05 * normal(random),
                          (answers ? truth[1] : 0.0) + 0.05 * normal(random)};
    Delay::Accelerations u{};
    for (std::size_t k = 0; k < u.size(); ++k)
      u[k] = acceleration(t - static_cast<double>(k) * to_seconds(Delay::kStep) - kStep_s / 2.0);
    delay.add(kStep_s, gyro, u);
  }
}

TEST(StreamDelay, FindsTheDelayBetweenItsCandidates) {
  for (const double late_s : {0.0, 0.0125, 0.03, 0.047}) {
    Delay delay{0.06};
    fly(delay, 6.0, late_s);
    const auto found = delay.delay();
    ASSERT_TRUE(found) << late_s;
    EXPECT_NEAR(to_seconds(*found), late_s, 0.003);
  }
}

TEST(StreamDelay, FollowsALinkThatDrifts) {
  Delay delay{0.06};
  fly(delay, 10.0, 0.02);
  delay.interrupt();
  fly(delay, 40.0, 0.04);
  ASSERT_TRUE(delay.delay());
  EXPECT_NEAR(to_seconds(*delay.delay()), 0.04, 0.003);
}

TEST(StreamDelay, SaysNothingEarlyNorWithoutAnAnswer) {
  Delay early{0.06};
  fly(early, 1.0, 0.02);
  EXPECT_FALSE(early.delay());
  Delay still{0.06};
  fly(still, 60.0, 0.02, false);
  EXPECT_FALSE(still.delay());
}

TEST(StreamDelay, ADelayBeyondTheLastCandidateIsNotTakenForIt) {
  for (const double late_s : {0.060, 0.065, 0.075}) {
    Delay delay{0.06};
    fly(delay, 20.0, late_s);
    EXPECT_GT(delay.explained(Delay::kCandidates - 1), Delay::kLeastExplained) << late_s;
    EXPECT_FALSE(delay.delay()) << late_s;
  }
  Delay delay{0.06};
  fly(delay, 20.0, 0.056);
  ASSERT_TRUE(delay.delay());
  EXPECT_NEAR(to_seconds(*delay.delay()), 0.056, 0.003);
}

TEST(StreamDelay, UsesNoHeap) {
  const test::AllocationGuard guard;
  Delay delay{0.06};
  for (int k = 0; k < 1000; ++k) delay.add(kStep_s, {0.1 * k, 0.0}, {});
  static_cast<void>(delay.delay());
  EXPECT_EQ(guard.allocations(), 0U);
}

}  // namespace
}  // namespace airworthy
