#include "gateway/feed/feed_publisher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <set>
#include <thread>

#include "tests/gateway/feed/feed_bench.h"
#include "tests/runtime/temporary_folder.h"

namespace airworthy::gateway {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// A socket in a folder that is gone at the end of the program, whether or not the publisher removes it.
std::string ipc_endpoint(const std::string& name) {
  static const rt::TemporaryFolder folder;
  return "ipc://" + (folder.path() / name).string();
}

FeedConfig at(const std::string& endpoint) {
  FeedConfig config;
  config.endpoint = endpoint;
  config.linger_ms = 0;
  return config;
}

/// Publishes until the subscriber hears it: a subscription takes its time. Returns the first message heard.
Received connect(FeedPublisher& feed, Subscriber& subscriber) {
  for (int i = 0; i < 200; ++i) {
    feed.publish("health", nlohmann::json::object());
    const auto heard = subscriber.drain(10);
    if (!heard.empty()) return heard.back();
  }
  ADD_FAILURE() << "no connection";
  return {};
}

TEST(FeedPublisher, SendsTopicSequenceAndObject) {
  zmq::context_t context;
  for (const std::string& endpoint : {std::string{"inproc://feed"}, ipc_endpoint("frames")}) {
    auto feed = FeedPublisher::open(context, at(endpoint), "quad1", 42);
    ASSERT_TRUE(feed) << feed.error().text;
    Subscriber subscriber{context, endpoint};
    const std::int64_t last = connect(**feed, subscriber).body.at("sequence");
    (*feed)->publish("event", {{"x", 1}});
    const auto received = subscriber.receive();
    ASSERT_TRUE(received);
    EXPECT_EQ(received->topic, "airworthy/quad1/event");
    EXPECT_EQ(received->sequence, std::to_string(last + 1));
    EXPECT_EQ(received->body, (nlohmann::json{{"schema", 1},
                                              {"kind", "event"},
                                              {"vehicle", "quad1"},
                                              {"session", 42},
                                              {"sequence", last + 1},
                                              {"x", 1}}));
  }
}

TEST(FeedPublisher, OneSequenceCountsAllKinds) {
  zmq::context_t context;
  auto feed = FeedPublisher::open(context, at("inproc://feed"), "quad1", 42);
  Subscriber all{context, "inproc://feed"};
  Subscriber events{context, "inproc://feed", "airworthy/quad1/event"};
  std::int64_t last = connect(**feed, all).body.at("sequence");
  (*feed)->publish("health", nlohmann::json::object());
  (*feed)->publish("event", nlohmann::json::object());
  EXPECT_EQ(all.receive()->body.at("sequence"), last + 1);
  EXPECT_EQ(all.receive()->body.at("sequence"), last + 2);
  EXPECT_EQ(events.receive()->body.at("sequence"), last + 2);
}

TEST(FeedPublisher, BrokenTextDoesNotStopTheFeed) {
  zmq::context_t context;
  auto feed = FeedPublisher::open(context, at("inproc://feed"), "quad1", 42);
  Subscriber subscriber{context, "inproc://feed"};
  connect(**feed, subscriber);
  (*feed)->publish("event", {{"text", "\xff\x1b"}});
  const auto received = subscriber.receive();
  ASSERT_TRUE(received);
  EXPECT_EQ(received->body.at("text"), "\xef\xbf\xbd\x1b");
}

TEST(FeedPublisher, ABoundEndpointIsAClearError) {
  zmq::context_t context;
  const std::string endpoint = "tcp://127.0.0.1:45731";
  auto first = FeedPublisher::open(context, at(endpoint), "quad1", 1);
  ASSERT_TRUE(first) << first.error().text;
  auto second = FeedPublisher::open(context, at(endpoint), "quad1", 2);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().text, AllOf(HasSubstr(endpoint), HasSubstr("Address already in use")));
}

TEST(FeedPublisher, ASubscriberThatDoesNotReadBlocksNobody) {
  zmq::context_t context;
  const std::string endpoint = ipc_endpoint("slow");
  FeedConfig config = at(endpoint);
  config.high_water_mark = 10;
  auto feed = FeedPublisher::open(context, config, "quad1", 1);
  ASSERT_TRUE(feed) << feed.error().text;
  zmq::socket_t asleep{context, zmq::socket_type::sub};
  asleep.set(zmq::sockopt::rcvhwm, 10);
  asleep.set(zmq::sockopt::linger, 0);
  asleep.set(zmq::sockopt::subscribe, "");
  asleep.connect(endpoint);
  Subscriber awake{context, endpoint};
  connect(**feed, awake);

  const nlohmann::json big{{"text", std::string(10'000, 'x')}};
  const auto start = std::chrono::steady_clock::now();
  std::set<std::int64_t> heard;
  for (int i = 0; i < 3'000; ++i) {
    (*feed)->publish("health", big);
    if (i % 5 == 4) {
      for (const Received& received : awake.drain(1))
        heard.insert(received.body.at("sequence").get<std::int64_t>());
    }
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds{30});
  EXPECT_GT(heard.size(), 2'500U) << "the other subscriber is served";
  EXPECT_EQ((*feed)->failed(), 0);
}

}  // namespace
}  // namespace airworthy::gateway
