#include "runtime/process/args.h"

#include <gtest/gtest.h>
#include <sysexits.h>

#include <cstdlib>

namespace airworthy::rt {
namespace {

tl::expected<Args, Exit> parse(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "airworthy-x");
  return Args::parse(static_cast<int>(arguments.size()), arguments.data(), {"airworthy-x", "Watches x."});
}

/// The first line of the complaint; its exit code is checked here.
std::string bad_usage(const std::vector<const char*>& arguments) {
  const auto args = parse(arguments);
  if (args) return "accepted";
  EXPECT_EQ(args.error().code, EX_USAGE);
  const std::string hint = "\nrun with --help for the options";
  const std::string& text = args.error().text;
  const std::size_t at = text.rfind(hint);
  if (at == std::string::npos || at + hint.size() != text.size()) return "no hint: " + text;
  return text.substr(0, at);
}

class ArgsTest : public testing::Test {
 protected:
  ArgsTest() { ::unsetenv("LCM_DEFAULT_URL"); }
  ~ArgsTest() override { ::unsetenv("LCM_DEFAULT_URL"); }
};

TEST_F(ArgsTest, Defaults) {
  const auto args = parse({"--config", "x.toml"});
  ASSERT_TRUE(args.has_value()) << args.error().text;
  EXPECT_EQ(args->config_path, "x.toml");
  EXPECT_TRUE(args->overrides.empty());
  EXPECT_EQ(args->lcm_url, "udpm://239.255.76.67:7667?ttl=0");
  EXPECT_EQ(args->log_level, LogLevel::kInfo);
  EXPECT_EQ(args->clock, ClockSource::kLive);
  EXPECT_EQ(args->time_scale, 1.0);
  EXPECT_FALSE(args->check_config);
}

TEST_F(ArgsTest, EverythingSet) {
  const auto args = parse({"--config=x.toml", "--set", "a=1", "--set=b.c=x=y", "--set", "d=[1, 2]", "--set",
                           "{}", "--set", "", "--lcm-url", "memq://", "--check-config", "--log-level",
                           "debug", "--clock", "live", "--time-scale", "2.5"});
  ASSERT_TRUE(args.has_value()) << args.error().text;
  EXPECT_EQ(args->overrides, (std::vector<std::string>{"a=1", "b.c=x=y", "d=[1, 2]", "{}", ""}));
  EXPECT_EQ(args->lcm_url, "memq://");
  EXPECT_TRUE(args->check_config);
  EXPECT_EQ(args->log_level, LogLevel::kDebug);
  EXPECT_EQ(args->time_scale, 2.5);
}

TEST_F(ArgsTest, ClocksAndLevels) {
  EXPECT_EQ(parse({"--config", "x", "--clock", "tick"})->clock, ClockSource::kTick);
  EXPECT_EQ(parse({"--config", "x", "--log-level", "warning"})->log_level, LogLevel::kWarning);
  EXPECT_EQ(parse({"--config", "x", "--log-level", "error"})->log_level, LogLevel::kError);
}

TEST_F(ArgsTest, BusFromTheEnvironment) {
  ::setenv("LCM_DEFAULT_URL", "udpm://239.255.76.67:7777?ttl=0", 1);
  EXPECT_EQ(parse({"--config", "x"})->lcm_url, "udpm://239.255.76.67:7777?ttl=0");
  EXPECT_EQ(parse({"--config", "x", "--lcm-url", "memq://"})->lcm_url, "memq://");
  ::setenv("LCM_DEFAULT_URL", "", 1);
  EXPECT_EQ(parse({"--config", "x"})->lcm_url, Args::kDefaultLcmUrl);
}

TEST_F(ArgsTest, HelpAndVersionEndWell) {
  const auto help = parse({"--help"});
  ASSERT_FALSE(help.has_value());
  EXPECT_EQ(help.error().code, EX_OK);
  EXPECT_EQ(help.error().text.rfind("Watches x.\nUsage: airworthy-x [OPTIONS]", 0), 0U) << help.error().text;
  for (const char* option : {"--config", "--set", "--lcm-url", "--check-config", "--log-level", "--clock",
                             "--time-scale", "--version", "--help"}) {
    EXPECT_NE(help.error().text.find(option), std::string::npos) << option;
  }
  const auto version = parse({"--version"});
  ASSERT_FALSE(version.has_value());
  EXPECT_EQ(version.error().code, EX_OK);
  EXPECT_EQ(version.error().text, "airworthy-x " AIRWORTHY_VERSION);
}

TEST_F(ArgsTest, BadUsage) {
  EXPECT_EQ(bad_usage({}), "--config is required");
  EXPECT_EQ(bad_usage({"--config", "x", "--colour"}), "The following argument was not expected: --colour");
  EXPECT_EQ(bad_usage({"--config", "x", "y"}), "The following argument was not expected: y");
  EXPECT_EQ(bad_usage({"--config", "x", "--log-level", "loud"}),
            "--log-level: must be one of debug, info, warning, error");
  EXPECT_EQ(bad_usage({"--config", "x", "--clock", "sun"}), "--clock: must be one of live, tick");
  EXPECT_EQ(bad_usage({"--config", "x", "--time-scale", "two"}), "Could not convert: --time-scale = two");
  for (const char* scale : {"0", "-1", "nan", "inf"}) {
    EXPECT_EQ(bad_usage({"--config", "x", "--time-scale", scale}),
              "--time-scale: must be greater than 0 and finite")
        << scale;
  }
  EXPECT_EQ(bad_usage({"--config", "x", "--clock", "tick", "--time-scale", "1"}),
            "--time-scale: only with --clock live");
  EXPECT_EQ(bad_usage({"--config"}), "--config: 1 required FILE missing");
}

}  // namespace
}  // namespace airworthy::rt
