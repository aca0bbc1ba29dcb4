#include "cli/watch/health_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace airworthy::watch {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(HealthView, ReadsWhatTheFeedPromises) {
  const HealthView view = health_view(json::parse(R"({
    "vehicle": "quad1", "time_us": 10000000, "time_utc": "2026-11-22T03:20:00.000000Z", "status": "failed",
    "root_cause": "rotor 2", "advice": "Land now.",
    "components": [{"component": "rotor 2", "status": "failed", "since_us": 4000000, "since_utc": "U",
                    "reasons": ["a", "b"], "advice": "Land now."}],
    "processes": [{"process": "p", "expected": true, "status": "missing", "since_us": 9000000, "restarts": 2,
                   "detail": "no life sign"}],
    "links": [{"driver": "p", "link": "udp:1", "status": "silent", "since_us": 1, "detail": "quiet"}],
    "faults": [{"producer": "p", "session": 5, "number": 6, "component": "rotor 2", "fault_kind": "loss",
                "severity": "warning", "advice": "Land now.", "summary": "weak", "latched": true, "magnitude": 0.25,
                "magnitude_sigma": 0.5, "magnitude_unit": "g*mm", "detected_us": 8000000, "detected_utc": null,
                "unconfirmed": "p is missing"}]})"));
  EXPECT_EQ(view.vehicle, "quad1");
  EXPECT_EQ(view.utc, "2026-11-22T03:20:00.000000Z");
  EXPECT_EQ(view.status, "failed");
  EXPECT_EQ(view.root_cause, "rotor 2");
  ASSERT_THAT(view.components, SizeIs(1));
  EXPECT_EQ(view.components[0].since.age_us, 6'000'000);
  EXPECT_EQ(view.components[0].since.utc, "U");
  EXPECT_THAT(view.components[0].reasons, ElementsAre("a", "b"));
  ASSERT_THAT(view.processes, SizeIs(1));
  EXPECT_TRUE(view.processes[0].expected);
  EXPECT_EQ(view.processes[0].restarts, 2);
  ASSERT_THAT(view.links, SizeIs(1));
  EXPECT_EQ(view.links[0].name, "udp:1");
  ASSERT_THAT(view.faults, SizeIs(1));
  EXPECT_EQ(view.faults[0].id, "p/5/6");
  EXPECT_EQ(view.faults[0].magnitude, "0.25 ± 0.5 g*mm");
  EXPECT_EQ(view.faults[0].since.age_us, 2'000'000);
  EXPECT_TRUE(view.faults[0].latched);
  EXPECT_EQ(view.faults[0].unconfirmed, "p is missing");
}

TEST(HealthView, WhatIsMissingOrOfAnotherTypeIsEmpty) {
  for (const char* text :
       {"{}", "[]", "null", "3", R"({"components": {}, "processes": "x", "links": 5, "faults": null,
        "status": 3, "vehicle": ["x"], "time_us": "now"})"}) {
    const HealthView view = health_view(json::parse(text));
    EXPECT_EQ(view.status, "") << text;
    EXPECT_EQ(view.vehicle, "") << text;
    EXPECT_THAT(view.components, IsEmpty()) << text;
    EXPECT_EQ(event_view(json::parse(text)).component, "") << text;
  }
  const HealthView odd = health_view(json::parse(
      R"({"time_us": 9223372036854775807, "components": [3, null, {"component": 1, "since_us": -9223372036854775808,
          "reasons": [1, "a", null]}], "faults": [{"magnitude": null, "magnitude_sigma": 3, "number": "x"}, []]})"));
  ASSERT_THAT(odd.components, SizeIs(3));
  EXPECT_EQ(odd.components[2].since.age_us, std::nullopt) << "a difference beyond all numbers";
  EXPECT_THAT(odd.components[2].reasons, ElementsAre("a"));
  EXPECT_EQ(odd.faults.at(0).magnitude, "");
  EXPECT_EQ(odd.faults.at(0).id, "/-1/-1");
}

TEST(HealthView, NothingInItCommandsATerminal) {
  const HealthView view = health_view(json{
      {"vehicle", "\x1b[2Jquad"}, {"components", {{{"component", "a\nb\u009b"}, {"reasons", {"\x07"}}}}}});
  EXPECT_EQ(view.vehicle, " [2Jquad");
  EXPECT_EQ(view.components.at(0).name, "a b ");
  EXPECT_THAT(view.components.at(0).reasons, ElementsAre(" "));
}

TEST(HealthView, ListsAndTextsAreBounded) {
  json body{{"vehicle", std::string(100'000, 'x')}};
  for (int i = 0; i < 10'000; ++i) body["components"].push_back({{"component", "c"}});
  const HealthView view = health_view(body);
  EXPECT_THAT(view.vehicle, SizeIs(512));
  EXPECT_THAT(view.components, SizeIs(512));
}

}  // namespace
}  // namespace airworthy::watch
