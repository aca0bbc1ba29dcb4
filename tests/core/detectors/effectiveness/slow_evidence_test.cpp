#include "core/detectors/effectiveness/slow_evidence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/allocation_guard.h"
#include "tests/support/hovering_quad.h"

namespace airworthy::effectiveness {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kStep_s = 0.002;
constexpr double kLeastExcess = 0.15;

SlowEvidenceParams params() {
  SlowEvidenceParams result;
  result.vehicle = test::HoveringQuad::described();
  result.vehicle.torque_ratio_m = 0.015;
  result.vehicle.propeller_inertia_kg_m2 = 1e-6;
  result.effectiveness = EffectivenessMatrix<double>::of(result.vehicle);
  result.speeds = {.rotor_count = 4, .speed_max_rad_s = 1300.0};
  result.least_excess_ratio = kLeastExcess;
  return result;
}

/// A controlled flight of a body that answers as described but for `effectiveness`; the speeds wander by 5 %.
class Flight : public test::HoveringQuad {
 public:
  Flight() : HoveringQuad{23} { wander_ratio = 0.05; }

  SlowEvidence slow{params()};
  std::array<int, 4> report_every{5, 5, 5, 5};  ///< steps of 2 ms between reports of a rotor; 0: silent
  bool has_gaps = false;                        ///< rotor 2 is silent for 60 ms twice a second
  bool may_accuse = true;
  double vertical_error_m_s2 = 0.0;

  std::vector<SlowEvidence::Excess> fly(double seconds) {
    std::vector<SlowEvidence::Excess> found;
    for (double t = 0.0; t < seconds; t += kStep_s) {
      if (const auto excess = step()) found.push_back(*excess);
    }
    return found;
  }

  [[nodiscard]] TimePoint now() const { return from_us(1'000'000 + 2'000 * steps_); }

 private:
  std::optional<SlowEvidence::Excess> step() {
    ++steps_;
    std::array<double, 4> reported{kNaN, kNaN, kNaN, kNaN};
    HoveringQuad::step(kStep_s, [&](std::size_t i, double speed_rad_s) {
      const bool is_due =
          report_every[i] > 0 && steps_ % report_every[i] == 0 && !(has_gaps && i == 2 && steps_ % 250 < 30);
      if (is_due) reported[i] = speed_rad_s + noise(0.5);
    });
    slow.on_speeds(now(), reported);
    SlowSample sample;
    sample.time = now();
    sample.accel_m_s2 = {0.0, 0.0, measured_vertical_m_s2() + vertical_error_m_s2};
    sample.gyro_rad_s = measured_rates_rad_s();
    sample.is_judged = true;
    sample.may_accuse = may_accuse;
    return slow.on_imu(sample);
  }

  std::int64_t steps_ = 0;
};

TEST(SlowEvidence, FindsTheExcessAndSaysItOnce) {
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    Flight flight;
    flight.effectiveness[rotor] = 1.5;
    const auto found = flight.fly(40.0);
    ASSERT_GT(found.size(), 5U);
    EXPECT_TRUE(found.front().is_first);
    EXPECT_GE(found.front().evidence, flight.slow.excess_threshold());
    EXPECT_GE(found.front().evidence - found.front().second, SlowEvidence::kMargin);
    EXPECT_GT(found.front().probability, 0.99);
    EXPECT_NEAR(found.back().effectiveness, 1.5, 0.1);
    for (std::size_t k = 1; k < found.size(); ++k) EXPECT_FALSE(found[k].is_first || found[k].is_over);
    for (const auto& one : found) EXPECT_EQ(one.rotor, rotor);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(flight.slow.is_active(i), i == rotor);
  }
}

TEST(SlowEvidence, AccusesNobodyOfAHealthyVehicleNorBeforeItMay) {
  Flight healthy;
  EXPECT_TRUE(healthy.fly(120.0).empty());
  Flight unsure;
  unsure.may_accuse = false;
  unsure.effectiveness[0] = 1.5;
  EXPECT_TRUE(unsure.fly(40.0).empty());
  EXPECT_GT(unsure.slow.effectiveness(0), 1.3);
}

// Found by others, as by the fast test: what is believed is followed, and ends here once the rotor has been healthy.
TEST(SlowEvidence, ClearsWhatOthersHaveFoundOnceItHasBeenHealthy) {
  Flight flight;
  flight.fly(5.0);
  flight.slow.believe(2, 1.4);
  flight.slow.note(2, true);
  EXPECT_TRUE(flight.slow.is_active(2));
  EXPECT_EQ(flight.slow.effectiveness(2), 1.4) << "as believed, before anything is seen";
  const TimePoint start = flight.now();
  const auto found = flight.fly(60.0);
  ASSERT_FALSE(found.empty());
  EXPECT_TRUE(found.back().is_over);
  EXPECT_EQ(found.back().rotor, 2U);
  EXPECT_NEAR(found.back().effectiveness, 1.0, kLeastExcess / 2.0);
  EXPECT_GE(found.back().sample - start, SlowEvidence::kClearAfter);
  for (std::size_t k = 0; k + 1 < found.size(); ++k) EXPECT_FALSE(found[k].is_over);
  EXPECT_FALSE(flight.slow.is_active(2));
}

TEST(SlowEvidence, FollowsTwoThatOthersHaveFound) {
  Flight flight;
  flight.effectiveness = {1.4, 1.0, 1.4, 1.0};
  for (const std::size_t rotor : {0U, 2U}) {
    flight.slow.believe(rotor, 1.4);
    flight.slow.note(rotor, true);
  }
  std::array<int, 4> told{};
  for (const auto& one : flight.fly(30.0)) {
    EXPECT_FALSE(one.is_over || one.is_first);
    EXPECT_NEAR(one.effectiveness, 1.4, 0.2);
    ++told[one.rotor];
  }
  EXPECT_GT(told[0], 5);
  EXPECT_GT(told[2], 5);
  flight.effectiveness = {1.0, 1.0, 1.0, 1.0};
  for (const std::size_t rotor : {0U, 2U}) flight.slow.believe(rotor, 1.0);
  std::vector<std::size_t> over;
  for (const auto& one : flight.fly(60.0)) {
    if (one.is_over) over.push_back(one.rotor);
  }
  EXPECT_EQ(over, (std::vector<std::size_t>{0, 2}));
}

TEST(SlowEvidence, JudgesAfreshAfterLanding) {
  for (const bool is_changed : {true, false}) {
    Flight flight;
    flight.effectiveness[1] = 1.5;
    ASSERT_FALSE(flight.fly(40.0).empty());
    flight.slow.believe(1, 1.5);
    flight.slow.end_flight();
    EXPECT_TRUE(flight.slow.is_active(1));
    EXPECT_EQ(flight.slow.effectiveness(1), 1.0);
    if (is_changed) flight.effectiveness[1] = 1.0;
    const TimePoint start = flight.now();
    const auto found = flight.fly(60.0);
    int first = 0;
    int over = 0;
    for (const auto& one : found) {
      EXPECT_EQ(one.rotor, 1U);
      EXPECT_GE(one.since, start);
      first += one.is_first ? 1 : 0;
      over += one.is_over ? 1 : 0;
    }
    EXPECT_EQ(first, is_changed ? 0 : 1);
    EXPECT_EQ(over, is_changed ? 1 : 0);
    EXPECT_EQ(flight.slow.is_active(1), !is_changed);
  }
}

TEST(SlowEvidence, TheLossOfAnotherStartsOverAndLeavesTheExcess) {
  Flight flight;
  flight.effectiveness[1] = 1.5;
  ASSERT_FALSE(flight.fly(40.0).empty());
  flight.effectiveness[3] = 0.6;
  flight.slow.believe(3, 0.6);
  flight.slow.note(3, false);
  const TimePoint start = flight.now();
  const auto found = flight.fly(40.0);
  ASSERT_FALSE(found.empty());
  for (const auto& one : found) {
    EXPECT_EQ(one.rotor, 1U);
    EXPECT_FALSE(one.is_over);
    EXPECT_GE(one.since, start) << "by evidence against the new model";
  }
  EXPECT_NEAR(flight.slow.effectiveness(1), 1.5, 0.15);
  EXPECT_NEAR(flight.slow.effectiveness(3), 0.6, 0.1);
}

TEST(SlowEvidence, SaysNothingWhereARotorIsSilentOrSeldomReports) {
  for (const int every : {0, 20, 50}) {
    Flight flight;
    flight.fly(1.0);
    flight.report_every[2] = every;  // the others go on
    flight.effectiveness[0] = 2.0;
    EXPECT_TRUE(flight.fly(60.0).empty()) << every;
  }
}

TEST(SlowEvidence, SaysNothingForASecondAfterAGapOfARotor) {
  Flight flight;
  flight.has_gaps = true;
  flight.effectiveness[0] = 1.5;
  EXPECT_TRUE(flight.fly(60.0).empty());
  flight.has_gaps = false;
  EXPECT_FALSE(flight.fly(60.0).empty());
}

TEST(SlowEvidence, MessagesThatSayNothingDoNotMakeReportsFrequent) {
  Flight flight;
  flight.report_every = {20, 20, 20, 20};  // 40 ms, among messages of NaN every 2 ms
  flight.effectiveness[0] = 1.5;
  EXPECT_TRUE(flight.fly(60.0).empty());
}

TEST(SlowEvidence, RotorsMayReportInTurn) {
  Flight flight;
  flight.report_every = {5, 7, 5, 6};
  flight.effectiveness[0] = 1.5;
  EXPECT_FALSE(flight.fly(40.0).empty());
}

// Just before the first look, or some time before.
TEST(SlowEvidence, WhatIsNoNumberAccusesNobody) {
  for (int steps = 490; steps < 530; ++steps) {
    Flight flight;
    flight.fly((steps - 0.5) * kStep_s);
    flight.vertical_error_m_s2 = kNaN;
    EXPECT_TRUE(flight.fly(0.5 * kStep_s).empty()) << steps;
    flight.vertical_error_m_s2 = 0.0;
    EXPECT_TRUE(flight.fly(0.1).empty()) << steps;
  }
}

TEST(SlowEvidence, UsesNoHeap) {
  Flight flight;
  const test::AllocationGuard guard;
  EXPECT_TRUE(flight.fly(5.0).empty());
  EXPECT_EQ(guard.allocations(), 0U);
}

}  // namespace
}  // namespace airworthy::effectiveness
