#include "cli/watch/feed_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "cli/watch/health_view.h"

namespace airworthy::watch {
namespace {

using ::testing::HasSubstr;

const std::string kTopic = "airworthy/quad1/health";
const std::string kBody =
    R"({"schema":1,"kind":"health","vehicle":"quad1","session":42,"sequence":7,"time_us":9,"status":"ok"})";

std::string reason(const std::string& topic, const std::string& sequence, const std::string& body) {
  const auto message = parse_message(topic, sequence, body);
  return message ? "" : message.error().text;
}

std::string replaced(const std::string& what, const std::string& by) {
  std::string body = kBody;
  body.replace(body.find(what), what.size(), by);
  return body;
}

TEST(ParseMessage, AGoodOne) {
  const auto message = parse_message(kTopic, "7", kBody);
  ASSERT_TRUE(message) << message.error().text;
  EXPECT_EQ(message->kind, "health");
  EXPECT_EQ(message->vehicle, "quad1");
  EXPECT_EQ(message->session, 42);
  EXPECT_EQ(message->sequence, 7);
  EXPECT_EQ(message->body.at("status"), "ok");
}

TEST(ParseMessage, SaysWhyItRefuses) {
  EXPECT_EQ(reason(kTopic, "7", ""), "no JSON");
  EXPECT_EQ(reason(kTopic, "7", "\xff\x00garbage"), "no JSON");
  EXPECT_EQ(reason(kTopic, "7", kBody.substr(0, kBody.size() - 1)), "no JSON");
  EXPECT_EQ(reason(kTopic, "7", "[1]"), "no JSON object");
  EXPECT_EQ(reason(kTopic, "7", "3"), "no JSON object");
  EXPECT_THAT(reason(kTopic, "7", "{}"), HasSubstr("no schema number"));
  EXPECT_THAT(reason(kTopic, "7", replaced("\"schema\":1", "\"schema\":\"1\"")),
              HasSubstr("no schema number"));
  EXPECT_EQ(reason(kTopic, "7", replaced("\"schema\":1", "\"schema\":2")),
            "schema 2; this program reads schema 1");
  EXPECT_EQ(reason(kTopic, "7", replaced("42", "null")), "no session or sequence number");
  EXPECT_EQ(reason(kTopic, "7", replaced("\"sequence\":7", "\"sequence\":7.0")),
            "no session or sequence number");
  EXPECT_EQ(reason(kTopic, "7", replaced("\"sequence\":7", "\"sequence\":-7")),
            "no session or sequence number");
  EXPECT_EQ(reason(kTopic, "7", replaced("\"sequence\":7", "\"sequence\":18446744073709551615")),
            "no session or sequence number");
  EXPECT_EQ(reason(kTopic, "7", replaced("\"sequence\":7", "\"sequence\":1e400")), "no JSON");
  EXPECT_EQ(reason(kTopic, "8", kBody), "two sequence numbers that differ");
  EXPECT_EQ(reason("airworthy/quad2/health", "7", kBody), "a topic that does not match its content");
  EXPECT_EQ(reason(kTopic, "7", replaced("\"quad1\"", "[]")), "a topic that does not match its content");
}

TEST(ParseMessage, DeepNestingIsRefusedWithoutExhaustion) {
  const std::string deep = std::string(2'000'000, '[');
  EXPECT_EQ(reason(kTopic, "7", replaced("\"ok\"", deep)), "nested too deeply");
  EXPECT_EQ(reason(kTopic, "7", replaced("\"ok\"", std::string(40, '[') + std::string(40, ']'))),
            "nested too deeply");
}

TEST(ParseMessage, NoMutationOfAMessageBreaksTheReader) {
  const std::string whole =
      R"({"schema":1,"kind":"health","vehicle":"quad1","session":42,"sequence":7,"time_us":9,
    "time_utc":null,"status":"failed","root_cause":"rotor 2","advice":"Land now.","components":[{"component":"rotor 2",
    "status":"failed","since_us":6,"since_utc":null,"reasons":["a","b"],"advice":"Land now."}],"processes":[{"process":
    "p","expected":true,"status":"missing","since_us":1,"restarts":2,"session":null,"detail":"x"}],"links":[{"driver":
    "p","link":"udp:1","status":"silent","since_us":-3,"detail":""}],"faults":[{"producer":"p","session":1,"number":2,
    "magnitude":0.5,"magnitude_sigma":null,"latched":true,"detected_us":4,"evidence":[]}],"event":{"component":"x"}})";
  std::mt19937_64 random{4};
  int parsed = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string text = whole;
    for (int k = static_cast<int>(random() % 4); k >= 0; --k) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, random() % 20);
          break;
        case 2:
          text.insert(at, text.substr(random() % text.size(), random() % 40));
          break;
        default:
          text[at] = "0123456789-{}[]\",:ntf"[random() % 22];
          break;
      }
    }
    const auto message = parse_message(kTopic, "7", text);
    if (!message) continue;
    ++parsed;
    const HealthView view = health_view(message->body);
    (void)event_view(message->body);
    for (const ComponentView& component : view.components) ASSERT_LE(component.name.size(), 512U);
  }
  EXPECT_GT(parsed, 1'000) << "some must get as far as the views";
}

}  // namespace
}  // namespace airworthy::watch
