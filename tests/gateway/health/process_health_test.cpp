#include <gtest/gtest.h>

#include "tests/gateway/health/health_bench.h"

namespace airworthy::health {
namespace {

/// Life signs 5 times a second from `from_s` on, up to before `to_s`.
void live(Bench& bench, Speaker& speaker, double from_s, double to_s) {
  for (double t = from_s; t < to_s - 1e-9; t += 0.2) {
    bench.model.add(speaker.sign(at_s(t)));
    bench.run_to(at_s(t + 0.1));
  }
}

TEST(ProcessHealth, ARunningProcessIsRunning) {
  Bench bench;
  Speaker response{"airworthy-response"};
  live(bench, response, 0.01, 2.0);
  ASSERT_NE(bench.process("airworthy-response"), nullptr);
  EXPECT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kRunning);
  EXPECT_EQ(bench.process("airworthy-response")->last_seen, at_s(1.81));
  EXPECT_EQ(bench.process("airworthy-response")->restarts, 0);
}

TEST(ProcessHealth, NamedAsMissingWithinOneSecondOfDeath) {
  // It dies right after a life sign, or right before the next one was due.
  for (const double death_after_sign_s : {0.0, 0.199}) {
    HealthConfig config;
    config.expected_processes = {"airworthy-response"};
    Bench bench{config};
    Speaker response{"airworthy-response"};
    live(bench, response, 0.01, 2.0);
    const TimePoint last_sign = at_s(1.81);
    const TimePoint death = last_sign + from_seconds(death_after_sign_s);
    while (bench.step().processes.front().status == ProcessStatus::kRunning) {
      ASSERT_LE(bench.now, death + Duration{1'000'000});
    }
    EXPECT_LE(bench.now, death + Duration{1'000'000});
    EXPECT_GT(bench.snapshot.time, last_sign + Duration{800'000}) << "called missing too early";
    EXPECT_TRUE(bench.snapshot.changed);
    EXPECT_EQ(bench.snapshot.root_cause, "process airworthy-response");
    EXPECT_EQ(bench.process("airworthy-response")->since, last_sign);
  }
}

TEST(ProcessHealth, RejoinsByItself) {
  Bench bench;
  Speaker response{"airworthy-response"};
  live(bench, response, 0.01, 1.0);
  bench.run_to(at_s(3.0));
  ASSERT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kMissing);
  live(bench, response, 3.01, 3.5);
  EXPECT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kRunning);
  EXPECT_EQ(bench.process("airworthy-response")->restarts, 0) << "the same session";
}

TEST(ProcessHealth, CountsRestartsBySession) {
  Bench bench;
  Speaker response{"airworthy-response", 10};
  live(bench, response, 0.01, 1.0);
  response.restart(11);
  live(bench, response, 1.21, 2.0);
  response.restart(12);
  live(bench, response, 2.21, 3.0);
  EXPECT_EQ(bench.process("airworthy-response")->restarts, 2);
  EXPECT_EQ(bench.process("airworthy-response")->session, 12);
}

TEST(ProcessHealth, ALateMessageOfTheOldSessionIsNoRestart) {
  Bench bench;
  Speaker old{"airworthy-response", 10};
  live(bench, old, 0.01, 1.0);
  Speaker fresh{"airworthy-response", 11};
  live(bench, fresh, 1.21, 2.0);
  bench.model.add(old.sign(at_s(1.1), ProcessState::kStopping));
  live(bench, fresh, 2.01, 2.5);
  EXPECT_EQ(bench.process("airworthy-response")->restarts, 1);
  EXPECT_EQ(bench.process("airworthy-response")->session, 11);
  EXPECT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kRunning);
  EXPECT_EQ(bench.model.counters().stale_messages, 1);
}

TEST(ProcessHealth, AnOrderlyStopIsNotMissing) {
  HealthConfig config;
  config.expected_processes = {"airworthy-response"};
  Bench bench{config};
  Speaker response{"airworthy-response"};
  live(bench, response, 0.01, 1.0);
  bench.model.add(response.sign(at_s(1.1), ProcessState::kStopping));
  bench.run_to(at_s(4.0));
  EXPECT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kStopped);
  EXPECT_EQ(bench.snapshot.root_cause, "process airworthy-response");
  EXPECT_EQ(bench.snapshot.status, Status::kUnknown);
}

TEST(ProcessHealth, AnExpectedProcessThatNeverCameIsToldAfterTheStartGrace) {
  HealthConfig config;
  config.expected_processes = {"airworthy-mavlink"};
  Bench bench{config};
  bench.run_to(at_s(4.9));
  ASSERT_NE(bench.process("airworthy-mavlink"), nullptr);
  EXPECT_EQ(bench.process("airworthy-mavlink")->status, ProcessStatus::kNeverSeen);
  EXPECT_EQ(bench.snapshot.root_cause, "");
  EXPECT_EQ(bench.snapshot.status, Status::kUnknown);
  bench.run_to(at_s(5.2));
  EXPECT_EQ(bench.snapshot.root_cause, "process airworthy-mavlink");
  EXPECT_EQ(bench.process("airworthy-mavlink")->detail, "expected, but never seen");
  EXPECT_EQ(bench.snapshot.status, Status::kUnknown);
}

TEST(ProcessHealth, ADegradedProcessSaysWhy) {
  Bench bench;
  Speaker mavlink{"airworthy-mavlink"};
  bench.model.add(mavlink.sign(at_s(0.01), ProcessState::kDegraded, "no device clock"));
  bench.run_to(at_s(0.2));
  EXPECT_EQ(bench.process("airworthy-mavlink")->status, ProcessStatus::kDegraded);
  EXPECT_EQ(bench.process("airworthy-mavlink")->detail, "no device clock");
  EXPECT_EQ(bench.snapshot.status, Status::kDegraded);
  EXPECT_EQ(bench.snapshot.root_cause, "process airworthy-mavlink");
}

TEST(ProcessHealth, TwoProcessesUnderOneNameAreToldApartFromRestarts) {
  Bench bench;
  Speaker a{"airworthy-response", 10};
  Speaker b{"airworthy-response", 11};
  for (int i = 0; i < 10; ++i) {
    bench.model.add(a.sign(at_s(0.2 * i + 0.01)));
    bench.model.add(b.sign(at_s(0.2 * i + 0.06)));
    bench.run_to(at_s(0.2 * i + 0.1));
  }
  EXPECT_EQ(bench.process("airworthy-response")->restarts, 1);
  EXPECT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kDegraded);
  EXPECT_EQ(bench.process("airworthy-response")->detail, "two processes run under this name");
  EXPECT_GE(bench.model.counters().session_conflicts, 10);
}

TEST(ProcessHealth, AFreshProcessBesideRecordedTicksIsJudgedByItsArrival) {
  Bench bench;  // ticks near 100 s
  Speaker fresh{"airworthy-response"};
  for (int i = 0; i < 20; ++i) {
    bench.model.add(fresh.sign(from_us(7'000'000'000 + i * 200'000)));
    bench.run_to(at_s(0.2 * i + 0.1));
    ASSERT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kRunning);
  }
  EXPECT_EQ(bench.model.counters().foreign_clock, 20);
  const TimePoint silent_from = bench.now;
  while (bench.step().processes.front().status == ProcessStatus::kRunning) ASSERT_LT(bench.now, at_s(60));
  EXPECT_LE(bench.now - silent_from, Duration{1'000'000});
}

TEST(ProcessHealth, APauseOfTheTicksMakesNobodyMissing) {
  Bench bench;
  Speaker response{"airworthy-response"};
  live(bench, response, 0.01, 1.0);
  bench.now += Duration{30'000'000};  // the computer slept
  bench.step();
  bench.step();
  EXPECT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kRunning);
  EXPECT_EQ(bench.model.counters().tick_gaps, 1);
  const TimePoint woke = bench.now;
  while (bench.step().processes.front().status == ProcessStatus::kRunning) ASSERT_LT(bench.now, at_s(60));
  EXPECT_GT(bench.now - woke, Duration{700'000}) << "a fresh grace period";
  EXPECT_LT(bench.now - woke, Duration{1'000'000}) << "but no more than that";
}

TEST(ProcessHealth, TicksThatAreAlwaysSlowStillFindTheDead) {
  Bench bench;
  Speaker response{"airworthy-response"};
  bench.model.add(response.sign(at_s(0.01)));
  bench.step();
  for (int i = 0; i < 4; ++i) {
    bench.now += Duration{950'000};
    bench.step();
  }
  EXPECT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kMissing);
}

TEST(ProcessHealth, TicksThatJumpBackMakeNobodyMissing) {
  Bench bench;
  Speaker response{"airworthy-response"};
  live(bench, response, 0.01, 1.0);
  bench.now = from_us(5'000'000);  // the recording starts again
  EXPECT_FALSE(bench.model.tick(bench.now).has_value());
  EXPECT_EQ(bench.model.counters().tick_jumps_back, 1);
  for (int i = 0; i < 10; ++i) {
    bench.step();
    ASSERT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kRunning);
    ASSERT_LE(bench.process("airworthy-response")->since, bench.now);
  }
  bench.run_to(from_us(7'000'000));
  EXPECT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kMissing) << "and the dead are found";
  response.restart(2);
  bench.model.add(response.sign(from_us(7'060'000)));
  bench.run_to(from_us(7'100'000));
  EXPECT_EQ(bench.process("airworthy-response")->status, ProcessStatus::kRunning);
}

TEST(ProcessHealth, ARepeatedOrSwappedTickIsIgnored) {
  Bench bench;
  bench.step();
  EXPECT_FALSE(bench.model.tick(bench.now).has_value());
  EXPECT_FALSE(bench.model.tick(bench.now - Duration{30'000}).has_value());
  EXPECT_EQ(bench.model.counters().ticks_out_of_order, 2);
  EXPECT_EQ(bench.model.counters().tick_jumps_back, 0);
}

}  // namespace
}  // namespace airworthy::health
