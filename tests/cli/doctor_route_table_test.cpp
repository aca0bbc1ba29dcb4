#include <gtest/gtest.h>

#include "cli/doctor/route_table.h"

namespace airworthy::doctor {
namespace {

const std::string kHeading =
    "Iface\tDestination\tGateway \tFlags\tRefCnt\tUse\tMetric\tMask\t\tMTU\tWindow\tIRTT\n";
// Addresses are in network byte order, printed as the host's integer: 224.0.0.0/4 is 000000E0/000000F0.
const std::string kDefaultRoute = "eth0\t00000000\t010200C0\t0003\t0\t0\t0\t00000000\t0\t0\t0\n";
const std::string kMulticastRoute = "lo\t000000E0\t00000000\t0001\t0\t0\t0\t000000F0\t0\t0\t0\n";

TEST(RouteTable, NothingInAnEmptyTable) {
  EXPECT_FALSE(find_route("", "239.255.76.67"));
  EXPECT_FALSE(find_route(kHeading, "239.255.76.67"));
}

TEST(RouteTable, LongestPrefixWinsWhateverTheOrder) {
  EXPECT_EQ(find_route(kHeading + kDefaultRoute, "239.255.76.67")->interface, "eth0");
  EXPECT_EQ(find_route(kHeading + kDefaultRoute + kMulticastRoute, "239.255.76.67")->interface, "lo");
  EXPECT_EQ(find_route(kHeading + kMulticastRoute + kDefaultRoute, "239.255.76.67")->interface, "lo");
}

TEST(RouteTable, ARouteElsewhereDoesNotCount) {
  EXPECT_FALSE(
      find_route(kHeading + "eth0\t000200C0\t00000000\t0001\t0\t0\t0\t00FFFFFF\t0\t0\t0\n", "239.255.76.67"));
}

TEST(RouteTable, ARouteThatIsDownDoesNotCount) {
  EXPECT_FALSE(
      find_route(kHeading + "lo\t000000E0\t00000000\t0000\t0\t0\t0\t000000F0\t0\t0\t0\n", "239.255.76.67"));
}

TEST(RouteTable, LeastMetricWinsAmongEqualPrefixes) {
  const std::string wireless = "wlan0\t00000000\t010200C0\t0003\t0\t0\t600\t00000000\t0\t0\t0\n";
  const std::string wired = "eth0\t00000000\t010200C0\t0003\t0\t0\t100\t00000000\t0\t0\t0\n";
  EXPECT_EQ(find_route(kHeading + wireless + wired, "239.255.76.67")->interface, "eth0");
  EXPECT_EQ(find_route(kHeading + wired + wireless, "239.255.76.67")->interface, "eth0");
}

TEST(RouteTable, SaysThatARouteRefuses) {
  EXPECT_TRUE(
      find_route(kHeading + "*\t000000E0\t00000000\t0201\t0\t0\t0\t000000F0\t0\t0\t0\n", "239.255.76.67")
          ->rejects);
  EXPECT_TRUE(
      find_route(kHeading + "*\t000000E0\t00000000\t0001\t0\t0\t0\t000000F0\t0\t0\t0\n", "239.255.76.67")
          ->rejects);
  EXPECT_FALSE(find_route(kHeading + kMulticastRoute, "239.255.76.67")->rejects);
}

TEST(RouteTable, BrokenLinesAreSkipped) {
  EXPECT_EQ(find_route(kHeading + "lo\t0000\n\nnonsense\n" + kDefaultRoute, "239.255.76.67")->interface,
            "eth0");
}

}  // namespace
}  // namespace airworthy::doctor
