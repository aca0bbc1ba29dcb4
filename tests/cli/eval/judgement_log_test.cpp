#include "cli/eval/judgement_log.h"

#include <gtest/gtest.h>

#include "cli/eval/report.h"

namespace airworthy::eval {
namespace {

TimePoint at(double time_s) { return from_us(1'000'000) + from_seconds(time_s); }

TEST(JudgementLog, AddsUpByCauseAndJoinsNeighbours) {
  JudgementLog log;
  EXPECT_FALSE(log.has_any());
  log.note(at(0.0), at(0.5), "on ground");
  log.note(at(0.5), at(1.0), "on ground");
  log.note(at(1.0), at(3.0), "");
  log.note(at(3.0), at(3.25), "pushed");
  log.note(at(3.25), at(4.0), "on ground");
  EXPECT_TRUE(log.has_any());
  EXPECT_DOUBLE_EQ(log.judged_s(), 2.0);
  EXPECT_DOUBLE_EQ(log.muted_s(), 2.0);
  ASSERT_EQ(log.muted().size(), 2U);
  EXPECT_EQ(log.muted()[0].why, "on ground");
  EXPECT_DOUBLE_EQ(log.muted()[0].seconds, 1.75);
  ASSERT_EQ(log.muted()[0].intervals.size(), 2U);
  EXPECT_EQ(log.muted()[0].intervals[0].until, at(1.0));
  EXPECT_EQ(log.muted()[1].intervals[0].from, at(3.0));
}

TEST(JudgementLog, KnowsWhatOfAnIntervalWasJudgedAndWhatMutedItMost) {
  JudgementLog log;
  EXPECT_EQ(log.main_cause(), "");
  log.note(at(0.0), at(1.0), "on ground");
  log.note(at(1.0), at(3.0), "");
  log.note(at(3.0), at(5.0), "pushed");
  log.note(at(5.0), at(6.0), "");
  EXPECT_DOUBLE_EQ(log.judged_s({at(0.0), at(9.0)}), 3.0);
  EXPECT_DOUBLE_EQ(log.judged_s({at(2.0), at(5.5)}), 1.5);
  EXPECT_DOUBLE_EQ(log.judged_s({at(3.5), at(4.5)}), 0.0);
  EXPECT_EQ(log.main_cause(), "pushed");
}

TEST(JudgementLog, TheTableListsTheMutedSeconds) {
  Evaluation evaluation;
  Flight flight;
  flight.name = "flight";
  flight.start = at(0.0);
  evaluation.flights.push_back(flight);
  EXPECT_EQ(to_muted_table(evaluation), "flight: the detector does not tell when it judges\n");
  evaluation.flights[0].judgement.note(at(0.0), at(0.5), "on ground");
  evaluation.flights[0].judgement.note(at(0.5), at(2.0), "");
  EXPECT_EQ(to_muted_table(evaluation),
            "flight: judged 1.50 s, muted 0.50 s\n"
            "      0.50 s  on ground: 0.00-0.50\n");
  JudgementLog rotor;
  rotor.note(at(0.0), at(1.5), "frozen");
  evaluation.flights[0].components.emplace("rotor 1", rotor);
  EXPECT_EQ(to_muted_table(evaluation),
            "flight: judged 1.50 s, muted 0.50 s\n"
            "      0.50 s  on ground: 0.00-0.50\n"
            "  rotor 1: judged 0.00 s, longest not: frozen\n");
}

}  // namespace
}  // namespace airworthy::eval
