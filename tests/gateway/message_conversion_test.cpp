#include "gateway/message_conversion.h"

#include <gtest/gtest.h>

#include <cmath>

namespace airworthy::gateway {
namespace {

using namespace health;

header_t header() {
  header_t header;
  header.time_us = 10;
  header.sent_us = 20;
  header.seq = 30;
  header.producer = "p";
  header.session = 40;
  return header;
}

fault_event_t event() {
  fault_event_t event{};
  event.header = header();
  event.number = 5;
  event.phase = 2;
  event.detector = "d";
  event.component = "rotor 1";
  event.fault_kind = "kind";
  event.severity = 2;
  event.latched = 1;
  event.probability = 0.5;
  event.magnitude = 1.5;
  event.magnitude_sigma = 0.25;
  event.magnitude_unit = "g*mm";
  event.onset_us = 7;
  event.detected_us = 8;
  event.summary = "s";
  event.candidate_count = 1;
  event.candidates = {"rotor 1"};
  event.evidence_count = 1;
  event.evidence.resize(1);
  event.evidence[0].name = "n";
  event.evidence[0].value = 3.5;
  event.evidence[0].unit = "V";
  return event;
}

std::vector<std::uint8_t> bytes_of(const fault_event_t& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  EXPECT_GT(message.encode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
  return bytes;
}

TEST(MessageConversion, AFaultComesBackAsItWas) {
  HealthSnapshot snapshot;
  snapshot.faults.push_back({*to_input(event()), ""});
  const vehicle_health_t health = to_message(snapshot);
  ASSERT_EQ(health.fault_count, 1);
  EXPECT_EQ(bytes_of(health.faults.at(0)), bytes_of(event()));
}

TEST(MessageConversion, WithoutAMeaningfulStateThereIsNoInput) {
  process_status_t process{};
  process.state = 4;
  EXPECT_FALSE(to_input(process));
  process.state = -1;
  EXPECT_FALSE(to_input(process));
  process.state = 3;
  EXPECT_EQ(to_input(process)->state, ProcessState::kStopping);
  detector_status_t detector{};
  detector.state = 4;
  EXPECT_FALSE(to_input(detector));
  fault_event_t fault = event();
  fault.phase = 0;
  EXPECT_FALSE(to_input(fault));
  fault.phase = 4;
  EXPECT_FALSE(to_input(fault));
}

TEST(MessageConversion, AnUnknownSeverityIsStillAFault) {
  fault_event_t fault = event();
  fault.severity = 100;
  EXPECT_EQ(to_input(fault)->severity, Severity::kWarning);
  fault.severity = -5;
  EXPECT_EQ(to_input(fault)->severity, Severity::kAdvisory);
}

TEST(MessageConversion, DetectorStatus) {
  detector_status_t status{};
  status.header = header();
  status.detector = "d";
  status.state = 3;
  status.muted_reason = "on ground";
  status.component_count = 2;
  status.components.resize(2);
  status.components[0].component = "rotor 1";
  status.components[0].judged = 1;
  status.components[1].component = "rotor 2";
  status.components[1].reason = "not excited";
  status.active_count = 1;
  status.active = {event()};
  auto report = to_input(status);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->state, DetectorState::kMuted);
  EXPECT_EQ(report->muted_reason, "on ground");
  EXPECT_TRUE(report->components.at(0).judged);
  EXPECT_FALSE(report->components.at(1).judged);
  EXPECT_EQ(report->components.at(1).reason, "not excited");
  EXPECT_EQ(report->active.at(0).number, 5);
  EXPECT_TRUE(report->active_is_complete);
  status.active[0].phase = 9;
  EXPECT_FALSE(to_input(status)->active_is_complete) << "one that nobody understands may be any";
}

TEST(MessageConversion, DriverStatus) {
  driver_status_t status{};
  status.header = header();
  status.link = "udp:1";
  status.connected = 1;
  status.detail = "x";
  status.seconds_since_data = NAN;
  const auto report = to_input(status);
  EXPECT_EQ(report->link, "udp:1");
  EXPECT_TRUE(report->connected);
  EXPECT_EQ(report->detail, "x");
  EXPECT_TRUE(std::isnan(report->seconds_since_data));
  EXPECT_EQ(report->origin.sent, from_us(20));
  EXPECT_EQ(report->origin.time, from_us(10));
}

TEST(MessageConversion, VehicleHealthUsesTheNumbersOfTheMessage) {
  HealthSnapshot snapshot;
  snapshot.vehicle = "quad1";
  snapshot.status = Status::kFailed;
  snapshot.components = {{"rotor 2", Status::kDegraded, from_us(6), {"a", "b"}, "Return."}};
  snapshot.processes = {
      {"p", true, ProcessStatus::kMissing, from_us(1), from_us(2), 7, 2, "no life sign"},
      {"q", true, ProcessStatus::kNeverSeen, from_us(0), std::nullopt, std::nullopt, 0, ""}};
  snapshot.links = {{"p", "udp:1", LinkStatus::kDown, from_us(3), "gone", {}}};
  const vehicle_health_t message = to_message(snapshot);
  EXPECT_EQ(message.status, 3);
  ASSERT_EQ(message.component_count, 1);
  EXPECT_EQ(message.components[0].status, 2);
  EXPECT_EQ(message.components[0].reason_count, 2);
  EXPECT_EQ(message.components[0].since_us, 6);
  ASSERT_EQ(message.process_count, 2);
  EXPECT_EQ(message.processes[0].status, 3);
  EXPECT_EQ(message.processes[0].last_seen_us, 2);
  EXPECT_EQ(message.processes[0].session, 7);
  EXPECT_EQ(message.processes[1].last_seen_us, -1);
  EXPECT_EQ(message.processes[1].session, -1);
  ASSERT_EQ(message.link_count, 1);
  EXPECT_EQ(message.links[0].status, 3);
}

}  // namespace
}  // namespace airworthy::gateway
