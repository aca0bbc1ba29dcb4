#include <gtest/gtest.h>

#include "cli/doctor/lcm_url.h"

namespace airworthy::doctor {
namespace {

TEST(LcmUrl, EmptyIsLcmsDefaultBus) {
  const auto address = parse_lcm_url("");
  ASSERT_TRUE(address);
  EXPECT_TRUE(address->multicast);
  EXPECT_EQ(address->group, "239.255.76.67");
  EXPECT_EQ(address->port, 7667);
  EXPECT_EQ(address->ttl, 0);
}

TEST(LcmUrl, ReadsGroupPortAndTtlAmongOtherOptions) {
  const auto address = parse_lcm_url("udpm://239.1.2.3:7700?recv_buf_size=4194304&ttl=1");
  ASSERT_TRUE(address);
  EXPECT_EQ(address->group, "239.1.2.3");
  EXPECT_EQ(address->port, 7700);
  EXPECT_EQ(address->ttl, 1);
}

TEST(LcmUrl, EachPartMayBeLeftOut) {
  EXPECT_EQ(parse_lcm_url("udpm://:7700")->port, 7700);
  EXPECT_EQ(parse_lcm_url("udpm://:7700")->group, "239.255.76.67");
  EXPECT_EQ(parse_lcm_url("udpm://239.1.2.3")->port, 7667);
  EXPECT_EQ(parse_lcm_url("udpm://?ttl=2")->ttl, 2);
}

TEST(LcmUrl, OtherSchemesUseNoMulticast) {
  EXPECT_FALSE(parse_lcm_url("memq://")->multicast);
  EXPECT_FALSE(parse_lcm_url("file:///tmp/flight.lcm?speed=0")->multicast);
}

TEST(LcmUrl, NamesWhatIsWrong) {
  const auto reason = [](const char* url) {
    const auto address = parse_lcm_url(url);
    return address ? "accepted" : address.error().text;
  };
  EXPECT_EQ(reason("239.255.76.67"),
            "LCM URL '239.255.76.67': must look like udpm://239.255.76.67:7667?ttl=0");
  EXPECT_EQ(
      reason("udpm://10.0.0.1:7667"),
      "LCM URL 'udpm://10.0.0.1:7667': '10.0.0.1' is not a multicast address (224.0.0.0 to 239.255.255.255)");
  EXPECT_EQ(reason("udpm://239.1.2.3:65536"),
            "LCM URL 'udpm://239.1.2.3:65536': port '65536' must be 1 to 65535");
  EXPECT_EQ(reason("udpm://239.1.2.3:7667x"),
            "LCM URL 'udpm://239.1.2.3:7667x': port '7667x' must be 1 to 65535");
  EXPECT_EQ(reason("udpm://?ttl=256"), "LCM URL 'udpm://?ttl=256': ttl '256' must be 0 to 255");
  EXPECT_EQ(reason("udpm://?ttl"), "LCM URL 'udpm://?ttl': ttl '' must be 0 to 255");
}

}  // namespace
}  // namespace airworthy::doctor
