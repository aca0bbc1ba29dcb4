#include "gateway/gateway_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace airworthy::gateway {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kShipped = AIRWORTHY_CONFIG_DIR "/gateway.toml";

std::string error_with(const std::string& override) {
  const auto config = GatewayConfig::load(kShipped, {override});
  return config ? "" : config.error().text;
}

TEST(GatewayConfig, TheShippedFileHoldsTheDefaults) {
  const auto config = GatewayConfig::load(kShipped, {});
  ASSERT_TRUE(config) << config.error().text;
  const health::HealthConfig defaults;
  EXPECT_EQ(config->vehicle, "plane1");
  EXPECT_EQ(config->health.vehicle, "plane1");
  EXPECT_EQ(config->feed.endpoint, FeedConfig{}.endpoint);
  EXPECT_EQ(config->feed.high_water_mark, FeedConfig{}.high_water_mark);
  EXPECT_EQ(config->feed.linger_ms, FeedConfig{}.linger_ms);
  EXPECT_THAT(config->health.expected_processes, ElementsAre("airworthy-mavlink", "airworthy-response"));
  EXPECT_EQ(config->health.process_deadline, defaults.process_deadline);
  EXPECT_EQ(config->health.detector_deadline, defaults.detector_deadline);
  EXPECT_EQ(config->health.link_deadline, defaults.link_deadline);
  EXPECT_EQ(config->health.link_silence, defaults.link_silence);
  EXPECT_EQ(config->health.start_grace, defaults.start_grace);
  EXPECT_THAT(config->health.feeds.at("airworthy-mavlink"), ElementsAre("airworthy-response"));
}

TEST(GatewayConfig, TheShippedFileOfAMultirotorExpectsItsDetectors) {
  const auto config = GatewayConfig::load(AIRWORTHY_CONFIG_DIR "/gateway_multirotor.toml", {});
  ASSERT_TRUE(config) << config.error().text;
  EXPECT_TRUE(config->multirotor.has_value());
  EXPECT_EQ(config->health.expected_processes.size(), 5U);
}

TEST(GatewayConfig, AnUnencryptedFeedStaysOnThisComputer) {
  EXPECT_THAT(error_with("feed.endpoint=tcp://0.0.0.0:5710"),
              HasSubstr("feed.endpoint: tcp://0.0.0.0:5710 can be reached from other computers"));
  EXPECT_TRUE(
      GatewayConfig::load(kShipped, {"feed.endpoint=tcp://0.0.0.0:5710", "feed.allow_plain_remote=true"}));
  EXPECT_TRUE(GatewayConfig::load(kShipped, {"feed.endpoint=ipc:///run/airworthy/feed"}));
}

TEST(GatewayConfig, EachRuleIsChecked) {
  EXPECT_THAT(error_with("feed.endpoint=5710"), HasSubstr("feed.endpoint"));
  EXPECT_THAT(error_with("feed.high_water_mark=0"),
              HasSubstr("feed.high_water_mark: must lie in [1, 1000000], is 0"));
  EXPECT_THAT(error_with("feed.linger_ms=-1"), HasSubstr("feed.linger_ms: must lie in [0, 10000], is -1"));
  EXPECT_THAT(error_with("feed.nonsense=1"), HasSubstr("feed.nonsense"));
  EXPECT_THAT(error_with("health.process_deadline_s=0.1"),
              HasSubstr("health.process_deadline_s: must lie in [0.3, 60], is 0.1"));
  EXPECT_THAT(error_with("health.detector_deadline_s=0.5"),
              HasSubstr("health.detector_deadline_s: must lie in [0.6, 60], is 0.5"));
  EXPECT_THAT(error_with("health.link_deadline_s=1.0"),
              HasSubstr("health.link_deadline_s: must lie in [1.2, 60], is 1"));
  EXPECT_THAT(error_with("health.link_silence_s=0"),
              HasSubstr("health.link_silence_s: must lie in [0.1, 600], is 0"));
  EXPECT_THAT(error_with("health.start_grace_s=-1"),
              HasSubstr("health.start_grace_s: must lie in [0, 600], is -1"));
  EXPECT_THAT(error_with("health.expected_processes=[\"\"]"), HasSubstr("is no process name"));
  EXPECT_THAT(error_with("health.expected_processes=[\"x\", \"y\", \"x\"]"),
              HasSubstr("health.expected_processes: \"x\" is named twice"));
  EXPECT_THAT(error_with("health.source=[{process=\"x\", feeds=[\"y\", \"y\"]}]"),
              HasSubstr("health.source[0].feeds: \"y\" is named twice"));
  std::string many = "health.expected_processes=[\"p\"";
  for (int i = 0; i < 40; ++i) many += ",\"p\"";
  EXPECT_THAT(error_with(many + "]"),
              HasSubstr("health.expected_processes: must have at most 32 elements, has 41"));
}

}  // namespace
}  // namespace airworthy::gateway
