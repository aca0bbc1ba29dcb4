#include "cli/watch/watcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace airworthy::watch {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr Watcher::Time kStart{};

FeedMessage health(std::int64_t sequence, json body = json::object(), std::int64_t session = 1) {
  body["vehicle"] = "quad1";
  return {"health", "quad1", session, sequence, body};
}

json body_with(const std::string& component_status, const std::string& reason) {
  return {{"status", component_status},
          {"components", {{{"component", "rotor 2"}, {"status", component_status}, {"reasons", {reason}}}}}};
}

TEST(SequenceCheck, CountsWhatIsMissing) {
  SequenceCheck check;
  EXPECT_EQ(check.add(1, 5).lost, 0) << "coming late is no loss";
  EXPECT_EQ(check.add(1, 6).lost, 0);
  EXPECT_EQ(check.add(1, 9).lost, 2);
  EXPECT_EQ(check.add(1, 9).lost, 0);
  EXPECT_FALSE(check.add(1, 10).restarted);
  EXPECT_TRUE(check.add(2, 50).restarted);
  EXPECT_EQ(check.add(2, 51).lost, 0);
  EXPECT_EQ(check.lost(), 2);
  EXPECT_GT(check.add(2, std::numeric_limits<std::int64_t>::max()).lost, 0) << "no overflow";
}

TEST(Watcher, OneLinePerChange) {
  WatchOptions options;
  Watcher watcher{options, kStart};
  EXPECT_THAT(watcher.add(health(0, body_with("ok", "")), kStart),
              ElementsAre("vehicle quad1 ok", "component rotor 2 ok"));
  EXPECT_THAT(watcher.add(health(1, body_with("ok", "")), kStart), IsEmpty());
  EXPECT_THAT(watcher.add(health(2, body_with("failed", "weak by 10 %")), kStart),
              ElementsAre("vehicle quad1 failed", "component rotor 2 failed: weak by 10 %"));
  EXPECT_THAT(watcher.add(health(3, body_with("failed", "weak by 11 %")), kStart), IsEmpty());
  EXPECT_THAT(watcher.add(health(4, body_with("unknown", "muted")), kStart),
              ElementsAre("vehicle quad1 unknown", "component rotor 2 unknown: muted"));
  EXPECT_THAT(watcher.add(health(5, body_with("unknown", "converging")), kStart),
              ElementsAre("component rotor 2 unknown: converging"));
  EXPECT_THAT(watcher.add(health(6, {{"status", "unknown"}}), kStart),
              ElementsAre("component rotor 2 is no longer reported"));
}

TEST(Watcher, FaultsAndEventsHaveTheirLines) {
  WatchOptions options;
  Watcher watcher{options, kStart};
  const json fault{{"producer", "p"},      {"session", 5},          {"number", 6},
                   {"phase", "raise"},     {"severity", "warning"}, {"component", "rotor 2"},
                   {"fault_kind", "loss"}, {"summary", "weak"},     {"magnitude", 0.25},
                   {"magnitude_unit", "1"}};
  EXPECT_THAT(watcher.add({"event", "quad1", 1, 0, {{"event", fault}}}, kStart),
              ElementsAre("event raise warning rotor 2 loss 0.25, fault p/5/6: weak"));
  EXPECT_THAT(watcher.add(health(1, {{"faults", {fault}}}), kStart),
              ElementsAre("vehicle quad1 ", "fault p/5/6 warning rotor 2 loss: weak"));
  EXPECT_THAT(watcher.add(health(2), kStart), ElementsAre("fault p/5/6 cleared"));
}

TEST(Watcher, TellsLossAndRestart) {
  WatchOptions options;
  Watcher watcher{options, kStart};
  (void)watcher.add(health(0), kStart);
  EXPECT_THAT(watcher.add(health(4), kStart), ElementsAre("lost 3 messages"));
  EXPECT_THAT(watcher.add(health(0, json::object(), 2), kStart), ElementsAre("the gateway restarted"));
  EXPECT_EQ(watcher.feed().lost, 3);
  EXPECT_EQ(watcher.feed().gateway_restarts, 1);
}

TEST(Watcher, TellsSilenceAndItsEnd) {
  WatchOptions options;
  options.endpoint = "tcp://127.0.0.1:5710";
  Watcher watcher{options, kStart};
  (void)watcher.add(health(0), kStart);
  EXPECT_THAT(watcher.check(kStart + milliseconds{1'400}), IsEmpty());
  EXPECT_FALSE(watcher.feed().silent_s);
  std::vector<std::string> told;
  for (int ms = 1'500; ms < 10'000; ms += 100) {
    for (const std::string& line : watcher.check(kStart + milliseconds{ms})) told.push_back(line);
    EXPECT_TRUE(watcher.feed().silent_s);
  }
  EXPECT_THAT(told, ElementsAre("no data from tcp://127.0.0.1:5710 for 2 s",
                                "no data from tcp://127.0.0.1:5710 for 4 s",
                                "no data from tcp://127.0.0.1:5710 for 8 s"));
  EXPECT_THAT(watcher.add(health(1), kStart + milliseconds{10'000}),
              ElementsAre("data again from tcp://127.0.0.1:5710"));
  EXPECT_FALSE(watcher.feed().silent_s);
}

TEST(Watcher, ARefusalIsToldOnceAndCounted) {
  WatchOptions options;
  Watcher watcher{options, kStart};
  EXPECT_THAT(watcher.refuse("no JSON"), ElementsAre("message refused: no JSON"));
  EXPECT_THAT(watcher.refuse("no JSON"), IsEmpty());
  EXPECT_EQ(watcher.feed().refused, 2);
  EXPECT_EQ(watcher.feed().messages, 0);
}

TEST(Watcher, JsonIsOneHarmlessLinePerMessage) {
  WatchOptions options;
  options.json = true;
  Watcher watcher{options, kStart};
  const auto lines = watcher.add(health(0, {{"text", "a\n\x1b[2J\xff ö"}}), kStart);
  ASSERT_EQ(lines.size(), 1U);
  for (const char c : lines[0]) {
    ASSERT_GE(c, ' ') << lines[0];
    ASSERT_LT(c, 0x7F) << lines[0];
  }
  EXPECT_EQ(json::parse(lines[0]).at("text"), "a\n\x1b[2J\xef\xbf\xbd ö");
}

TEST(Watcher, EndsAfterCountOrTimeout) {
  WatchOptions options;
  options.count = 2;
  options.timeout_s = 3.0;
  Watcher watcher{options, kStart};
  (void)watcher.add(health(0), kStart);
  EXPECT_FALSE(watcher.has_enough());
  (void)watcher.add(health(1), kStart);
  EXPECT_TRUE(watcher.has_enough());
  EXPECT_FALSE(watcher.has_waited_enough(kStart + milliseconds{2'999}));
  EXPECT_TRUE(watcher.has_waited_enough(kStart + milliseconds{3'000}));
}

std::string joined(const std::vector<std::string>& lines) {
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  return all;
}

TEST(Screen, Durations) {
  EXPECT_EQ(duration_text(0), "0 s");
  EXPECT_EQ(duration_text(59'999'999), "59 s");
  EXPECT_EQ(duration_text(200'000'000), "3 min 20 s");
  EXPECT_EQ(duration_text(7'500'000'000), "2 h 5 min");
  EXPECT_EQ(duration_text(349'200'000'000), "4 d 1 h");
}

HealthView example() {
  HealthView view;
  view.vehicle = "quad1";
  view.status = "failed";
  view.root_cause = "rotor 2";
  view.advice = "Land now.";
  view.components = {{"rotor 1", "ok", {3'000'000, ""}, {}, ""},
                     {"rotor 2", "failed", {2'000'000, ""}, {"response: weak"}, "Land now."}};
  view.processes = {{"airworthy-mavlink", "missing", true, {1'000'000, ""}, 2, "no life sign"}};
  view.links = {{"airworthy-mavlink", "udp:14550", "down", {std::nullopt, ""}, "refused"}};
  view.faults = {{"p/1/1",
                  "raise",
                  "p",
                  "rotor 2",
                  "loss",
                  "warning",
                  "Land now.",
                  "weak",
                  "0.25",
                  "p is missing",
                  true,
                  {2'000'000, ""}}};
  return view;
}

TEST(Screen, ShowsEverythingThatMatters) {
  FeedState feed;
  feed.endpoint = "tcp://127.0.0.1:5710";
  feed.messages = 12;
  feed.lost = 3;
  const std::string text = joined(screen(example(), feed, 100, 50, false));
  for (const char* part :
       {"quad1  FAILED  root cause: rotor 2  Land now.", "12 messages, 3 lost", "FAULTS (1)", "WARNING",
        "for 2 s", "loss 0.25, latched, by p", "unconfirmed: p is missing", "COMPONENTS (2)",
        "response: weak", "MISSING", "restarted 2 times", "DOWN", "udp:14550"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  EXPECT_THAT(text, Not(HasSubstr("\x1b")));
}

TEST(Screen, OldDataSaysSo) {
  FeedState feed;
  feed.endpoint = "tcp://127.0.0.1:5710";
  feed.silent_s = 7.2;
  EXPECT_THAT(screen(example(), feed, 100, 50, false).front(),
              HasSubstr("no data from tcp://127.0.0.1:5710 for 7 s; what follows is old"));
  HealthView healthy = example();
  healthy.status = "ok";
  EXPECT_THAT(joined(screen(healthy, feed, 100, 50, true)), HasSubstr("\x1b[90mquad1  OK"))
      << "grey, not green";
  EXPECT_THAT(joined(screen(std::nullopt, feed, 100, 50, false)), HasSubstr("Does airworthy-gateway run"));
}

TEST(Screen, FitsTheTerminal) {
  HealthView view = example();
  view.advice = "漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢漢";
  view.components.assign(100, view.components.front());
  FeedState feed;
  for (const std::size_t columns : {1U, 5U, 20U, 40U}) {
    const auto lines = screen(view, feed, columns, 10, false);
    EXPECT_EQ(lines.size(), 10U);
    for (const std::string& line : lines) {
      const auto continuation = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; };
      const auto bytes_more = static_cast<std::size_t>(std::count_if(line.begin(), line.end(), continuation));
      EXPECT_LE(line.size() - bytes_more, columns) << line;
    }
  }
  EXPECT_THAT(screen(view, feed, 40, 10, false).back(), HasSubstr("more lines"));
}

}  // namespace
}  // namespace airworthy::watch
