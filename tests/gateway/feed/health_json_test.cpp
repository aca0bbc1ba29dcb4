#include "gateway/feed/health_json.h"

#include <gtest/gtest.h>

#include <cmath>

namespace airworthy::gateway {
namespace {

using namespace health;

FaultReport fault() {
  FaultReport fault;
  fault.origin = {"airworthy-response", 7, 3, from_us(11), from_us(12)};
  fault.number = 2;
  fault.phase = FaultPhase::kUpdate;
  fault.detector = "response";
  fault.component = "rotor 2";
  fault.fault_kind = "loss_of_effectiveness";
  fault.severity = Severity::kCaution;
  fault.latched = true;
  fault.probability = NAN;
  fault.magnitude = 0.25;
  fault.magnitude_sigma = INFINITY;
  fault.magnitude_unit = "1";
  fault.onset = from_us(5);
  fault.detected = from_us(6);
  fault.summary = "weak";
  fault.candidates = {"rotor 2", "rotor 3"};
  fault.evidence = {{"score", 9.5, "sigma"}, {"other", NAN, "V"}};
  return fault;
}

// Spelled out as docs/feed.md promises it.
const char* const kFault = R"({
  "producer": "airworthy-response", "session": 7, "number": 2, "seq": 3, "phase": "update", "detector": "response",
  "component": "rotor 2", "fault_kind": "loss_of_effectiveness", "severity": "caution", "latched": true,
  "probability": null, "magnitude": 0.25, "magnitude_sigma": null, "magnitude_unit": "1", "summary": "weak",
  "advice": "Return.", "candidates": ["rotor 2", "rotor 3"],
  "evidence": [{"name": "score", "value": 9.5, "unit": "sigma"}, {"name": "other", "value": null, "unit": "V"}],
  "onset_us": 5, "onset_utc": null, "detected_us": 6, "detected_utc": null, "decided_us": 11, "decided_utc": null})";

TEST(HealthJson, Fault) {
  EXPECT_EQ(to_json(fault(), FeedTime{std::nullopt}), nlohmann::json::parse(kFault));
}

TEST(HealthJson, Snapshot) {
  HealthSnapshot snapshot;
  snapshot.time = from_us(100);
  snapshot.vehicle = "quad1";
  snapshot.status = Status::kFailed;
  snapshot.root_cause = "rotor 2";
  snapshot.advice = "Land now.";
  snapshot.components = {{"rotor 2", Status::kFailed, from_us(6), {"response: weak"}, "Land now."}};
  snapshot.processes = {
      {"p", true, ProcessStatus::kMissing, from_us(1), from_us(1), 7, 2, "no life sign"},
      {"q", true, ProcessStatus::kNeverSeen, from_us(0), std::nullopt, std::nullopt, 0, ""}};
  snapshot.links = {{"p",
                     "udp:1",
                     LinkStatus::kSilent,
                     from_us(3),
                     "open, but silent",
                     {{"IMU", 99.5}, {"X", std::nan("")}}}};
  snapshot.flight_phase = "in_flight";
  snapshot.faults = {{fault(), "p is missing"}};
  auto expected = nlohmann::json::parse(R"({
    "time_us": 100, "time_utc": null, "status": "failed", "flight_phase": "in_flight", "root_cause": "rotor 2", "advice": "Land now.",
    "components": [{"component": "rotor 2", "status": "failed", "since_us": 6, "since_utc": null,
                    "reasons": ["response: weak"], "advice": "Land now."}],
    "processes": [
      {"process": "p", "expected": true, "status": "missing", "since_us": 1, "since_utc": null, "last_seen_us": 1,
       "last_seen_utc": null, "session": 7, "restarts": 2, "detail": "no life sign"},
      {"process": "q", "expected": true, "status": "never_seen", "since_us": 0, "since_utc": null,
       "last_seen_us": null, "last_seen_utc": null, "session": null, "restarts": 0, "detail": ""}],
    "links": [{"driver": "p", "link": "udp:1", "status": "silent",
               "rates": [{"name": "IMU", "rate_Hz": 99.5}, {"name": "X", "rate_Hz": null}], "since_us": 3, "since_utc": null,
               "detail": "open, but silent"}]})");
  expected["faults"] = nlohmann::json::array({nlohmann::json::parse(kFault)});
  expected["faults"][0]["unconfirmed"] = "p is missing";
  EXPECT_EQ(to_json(snapshot, FeedTime{std::nullopt}), expected);
}

TEST(HealthJson, Words) {
  EXPECT_STREQ(to_word(Status::kUnknown), "unknown");
  EXPECT_STREQ(to_word(Status::kOk), "ok");
  EXPECT_STREQ(to_word(Status::kDegraded), "degraded");
  EXPECT_STREQ(to_word(ProcessStatus::kRunning), "running");
  EXPECT_STREQ(to_word(ProcessStatus::kDegraded), "degraded");
  EXPECT_STREQ(to_word(ProcessStatus::kStopped), "stopped");
  EXPECT_STREQ(to_word(LinkStatus::kUnknown), "unknown");
  EXPECT_STREQ(to_word(LinkStatus::kOk), "ok");
  EXPECT_STREQ(to_word(LinkStatus::kDown), "down");
  EXPECT_STREQ(to_word(FaultPhase::kRaise), "raise");
  EXPECT_STREQ(to_word(FaultPhase::kClear), "clear");
  EXPECT_STREQ(to_word(Severity::kAdvisory), "advisory");
  EXPECT_STREQ(to_word(Severity::kWarning), "warning");
}

}  // namespace
}  // namespace airworthy::gateway
