#include "runtime/detector/fault_reporter.h"

#include <gtest/gtest.h>

#include "runtime/bus/channels.h"
#include "runtime/bus/lcm_bus.h"
#include "runtime/clock/manual_clock.h"

namespace airworthy::rt {
namespace {

using Transition = FaultLifeCycle::Transition;

/// A detector's reporter on an in-process bus, and somebody who listens.
class FaultReporterTest : public ::testing::Test {
 protected:
  FaultReporterTest() {
    fault_.fault_kind = "unbalance";
    fault_.magnitude_unit = "g*mm";
    listener_.subscribe<fault_event_t>(channel::kFaultEvent,
                                       [this](const fault_event_t& event) { events_.push_back(event); });
    listener_.subscribe<detector_status_t>(
        channel::kDetectorStatus, [this](const detector_status_t& status) { statuses_.push_back(status); });
  }

  void report(std::size_t slot, Transition transition, double magnitude) {
    fault_.magnitude = magnitude;
    fault_.component = "rotor " + std::to_string(slot + 1);
    fault_.summary = "off by " + std::to_string(static_cast<int>(magnitude));
    reporter_.report(slot, transition, clock_.now(), fault_);
    deliver();
  }

  void wait(Duration duration) {
    clock_.advance_to(clock_.now() + duration);
    deliver();
  }

  void deliver() {
    while (*bus_->dispatch(100) > 0) {
    }
  }

  std::unique_ptr<LcmBus> bus_{std::move(*LcmBus::open("memq://"))};
  ManualClock clock_{from_us(10'000'000)};
  Log log_{"test", LogLevel::kError};
  Node listener_{*bus_, clock_, log_, {"v1", "listener", 4}};
  Node node_{*bus_, clock_, log_, {"v1", "airworthy-some", 5}};
  DetectorReport state_{DetectorState::kMuted, "on the ground", {assessment("rotor 1", "not in flight", {})}};
  FaultReporter reporter_{node_, "some", [this] { return state_; }};
  Fault fault_;
  std::vector<fault_event_t> events_;
  std::vector<detector_status_t> statuses_;
};

TEST_F(FaultReporterTest, StatusComesTwiceASecondWithWhatTheDetectorSays) {
  for (int i = 0; i < 4; ++i) wait(FaultReporter::kStatusPeriod);
  ASSERT_EQ(statuses_.size(), 4U);
  const detector_status_t& status = statuses_.back();
  EXPECT_EQ(status.detector, "some");
  EXPECT_EQ(status.state, static_cast<int>(DetectorState::kMuted));
  EXPECT_EQ(status.muted_reason, "on the ground");
  ASSERT_EQ(status.component_count, 1);
  EXPECT_EQ(status.components[0].judged, 0);
  EXPECT_EQ(status.components[0].reason, "not in flight");
  EXPECT_EQ(assessment("rotor 1", "", {}).judged, 1);
}

TEST_F(FaultReporterTest, AFaultKeepsItsNumberFromRaiseToClear) {
  report(0, Transition::kRaise, 5.0);
  ASSERT_EQ(statuses_.size(), 1U) << "at once, not at the next half second";
  EXPECT_EQ(statuses_.back().active_count, 1);
  const std::int64_t raised_us = events_.back().detected_us;
  wait(Duration{100'000});
  report(0, Transition::kUpdate, 7.0);
  report(0, Transition::kClear, 0.0);
  ASSERT_EQ(events_.size(), 3U);
  for (const fault_event_t& event : events_) {
    EXPECT_EQ(event.number, 1);
    EXPECT_EQ(event.component, "rotor 1");
    EXPECT_EQ(event.detected_us, raised_us);
  }
  EXPECT_EQ(events_[0].phase, 1);
  EXPECT_EQ(events_[1].phase, 2);
  EXPECT_EQ(events_[1].magnitude, 7.0);
  EXPECT_EQ(events_[1].summary, "off by 7");
  EXPECT_EQ(events_[2].phase, 3);
  EXPECT_EQ(events_[2].summary, "off by 7") << "a cleared fault keeps the words of what it was";
  EXPECT_EQ(statuses_.back().active_count, 0);
  EXPECT_EQ(statuses_.back().recent_count, 3) << "a lost event heals by the status";
  report(0, Transition::kRaise, 5.0);
  EXPECT_EQ(events_.back().number, 2) << "found again, a fault is a new one";
}

TEST_F(FaultReporterTest, RaisedAgainBeforeItWasClearedAFaultIsUpdated) {
  report(0, Transition::kRaise, 5.0);
  report(0, Transition::kRaise, 8.0);
  ASSERT_EQ(events_.size(), 2U);
  EXPECT_EQ(events_[1].number, 1);
  EXPECT_EQ(events_[1].phase, 2);
  EXPECT_EQ(events_[1].magnitude, 8.0);
  report(1, Transition::kRaise, 1.0);
  EXPECT_EQ(events_.back().number, 2);
  EXPECT_EQ(statuses_.back().active_count, 2);
}

TEST_F(FaultReporterTest, FaultsOfDifferentSlotsLiveBesideEachOther) {
  report(0, Transition::kRaise, 1.0);
  report(3, Transition::kRaise, 2.0);
  EXPECT_EQ(statuses_.back().active_count, 2);
  report(0, Transition::kClear, 0.0);
  ASSERT_EQ(statuses_.back().active_count, 1);
  EXPECT_EQ(statuses_.back().active[0].component, "rotor 4");
}

TEST_F(FaultReporterTest, WhatWasNeverRaisedSaysNothing) {
  report(1, Transition::kUpdate, 1.0);
  report(1, Transition::kClear, 1.0);
  report(1, Transition::kNone, 1.0);
  EXPECT_TRUE(events_.empty());
  EXPECT_TRUE(statuses_.empty());
}

TEST_F(FaultReporterTest, OnlyTheNewestEventsAreRepeated) {
  report(0, Transition::kRaise, 1.0);
  for (int i = 0; i < 40; ++i) report(0, Transition::kUpdate, 2.0 + i);
  wait(FaultReporter::kStatusPeriod);
  ASSERT_EQ(statuses_.back().recent.size(), FaultReporter::kRecentEvents);
  EXPECT_EQ(statuses_.back().recent.back().magnitude, 41.0);
}

}  // namespace
}  // namespace airworthy::rt
