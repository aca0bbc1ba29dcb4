#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>

#include "cli/doctor/findings.h"

namespace airworthy::doctor {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kMebibyte = 1024 * 1024;

/// A computer on which everything is as it should be; each test spoils one thing.
Probes good_computer() {
  Probes probes;
  probes.multicast.loopback_up = true;
  probes.multicast.route_table_read = true;
  probes.multicast.route = Route{"lo", false};
  probes.multicast.delivery = {Delivery::Outcome::kDelivered, 0};
  probes.receive_buffer = {4 * kMebibyte, kMebibyte};
  probes.time = {true, {1'000, 1'000, 2'000}, 1'800'000'000, 1'700'000'000};
  probes.resources = {"/var/log/flights", 20'000 * kMebibyte, true, 2'000 * kMebibyte};
  return probes;
}

Finding find(const Probes& probes, const std::string& id) {
  const auto findings = judge(probes);
  const auto found =
      std::find_if(findings.begin(), findings.end(), [&](const auto& f) { return f.id == id; });
  EXPECT_NE(found, findings.end()) << id;
  return found == findings.end() ? Finding{} : *found;
}

TEST(DoctorFindings, AGoodComputerHasNone) {
  for (const auto& finding : judge(good_computer())) {
    EXPECT_EQ(finding.level, Level::kOk) << finding.id;
    EXPECT_EQ(finding.why + finding.cure + finding.permanent, "") << finding.id;
    EXPECT_NE(finding.found, "") << finding.id;
  }
}

TEST(DoctorFindings, NothingObservedIsNeverOkNorAFailureButForTheClock) {
  Probes blind;
  blind.resources.log_directory = "/";
  for (const auto& finding : judge(blind)) {
    EXPECT_NE(finding.level, Level::kOk) << finding.id;
    EXPECT_NE(finding.why, "") << finding.id;
    if (finding.id != "time.boottime" && finding.id != "disk.log_directory") {
      EXPECT_EQ(finding.level, Level::kUnknown) << finding.id;
    }
  }
}

TEST(DoctorFindings, LoopbackDown) {
  auto probes = good_computer();
  probes.multicast.loopback_up = false;
  const auto finding = find(probes, "multicast.loopback_up");
  EXPECT_EQ(finding.level, Level::kFailure);
  EXPECT_EQ(finding.cure, "ip link set lo up");
}

TEST(DoctorFindings, NoRoute) {
  auto probes = good_computer();
  probes.multicast.route.reset();
  probes.multicast.delivery = {};
  const auto finding = find(probes, "multicast.route");
  EXPECT_EQ(finding.level, Level::kFailure);
  EXPECT_EQ(finding.found, "no route to the bus's group 239.255.76.67");
  EXPECT_EQ(finding.cure, "ip route replace 224.0.0.0/4 dev lo");
  EXPECT_THAT(finding.permanent, HasSubstr("/etc/systemd/network/"));
  EXPECT_EQ(find(probes, "multicast.delivery").level, Level::kUnknown);
}

TEST(DoctorFindings, ARouteThatRefuses) {
  auto probes = good_computer();
  probes.multicast.route = Route{"*", true};
  const auto finding = find(probes, "multicast.route");
  EXPECT_EQ(finding.level, Level::kFailure);
  EXPECT_EQ(finding.cure, "ip route replace 239.255.76.67/32 dev lo");
}

TEST(DoctorFindings, ALocalBusThatHangsOnAnOutsideLink) {
  auto probes = good_computer();
  probes.multicast.route = Route{"wlan0", false};
  const auto finding = find(probes, "multicast.route");
  EXPECT_EQ(finding.level, Level::kWarning);
  EXPECT_THAT(finding.why, HasSubstr("wlan0"));
  EXPECT_EQ(finding.cure, "ip route replace 224.0.0.0/4 dev lo");
}

TEST(DoctorFindings, ABusOfSeveralComputersNeedsAnOutsideLink) {
  auto probes = good_computer();
  probes.multicast.address.ttl = 1;
  EXPECT_EQ(find(probes, "multicast.route").level, Level::kWarning);
  EXPECT_THAT(find(probes, "multicast.route").cure, HasSubstr("dev INTERFACE"));
  probes.multicast.route = Route{"eth0", false};
  EXPECT_EQ(find(probes, "multicast.route").level, Level::kOk);
}

TEST(DoctorFindings, EachCauseOfLostDeliveryIsToldApart) {
  using Outcome = Delivery::Outcome;
  struct Case {
    Delivery delivery;
    const char* found;
    const char* cure;
  };
  for (const auto& [delivery, found, cure] : {
           Case{{Outcome::kNoSocket, EMFILE}, "no socket for it: Too many open files", ""},
           Case{{Outcome::kJoinRefused, ENOBUFS},
                "refuses to join 239.255.76.67: too many groups",
                "sysctl -w net.ipv4.igmp_max_memberships=100"},
           Case{{Outcome::kJoinRefused, ENODEV},
                "refuses to join 239.255.76.67: No such device",
                "ip route replace 224.0.0.0/4 dev lo"},
           Case{{Outcome::kSendRefused, EPERM},
                "forbidden, by a packet filter",
                "iptables -I OUTPUT -d 239.255.76.67/32 -j ACCEPT"},
           Case{{Outcome::kSendRefused, ENETUNREACH},
                "fails: Network is unreachable",
                "ip route replace 239.255.76.67/32 dev lo"},
           Case{{Outcome::kLost, 0}, "does not come back", "iptables -I INPUT -d 239.255.76.67/32 -j ACCEPT"},
       }) {
    auto probes = good_computer();
    probes.multicast.delivery = delivery;
    const auto finding = find(probes, "multicast.delivery");
    EXPECT_EQ(finding.level, Level::kFailure) << found;
    EXPECT_THAT(finding.found, HasSubstr(found));
    EXPECT_EQ(finding.cure, cure) << found;
  }
}

TEST(DoctorFindings, ABusWithoutMulticastNeedsNone) {
  auto probes = good_computer();
  probes.multicast.address.multicast = false;
  probes.multicast.route.reset();
  probes.multicast.delivery = {};
  EXPECT_EQ(find(probes, "multicast.route").level, Level::kOk);
  EXPECT_EQ(find(probes, "multicast.delivery").level, Level::kOk);
}

TEST(DoctorFindings, SmallReceiveBuffers) {
  auto probes = good_computer();
  probes.receive_buffer = {4 * kMebibyte - 1, kMebibyte - 1};
  EXPECT_EQ(find(probes, "receive_buffer.largest").level, Level::kWarning);
  EXPECT_EQ(find(probes, "receive_buffer.largest").cure, "sysctl -w net.core.rmem_max=4194304");
  EXPECT_THAT(find(probes, "receive_buffer.largest").permanent, HasSubstr("/etc/sysctl.d/"));
  EXPECT_EQ(find(probes, "receive_buffer.default").level, Level::kWarning);
  EXPECT_EQ(find(probes, "receive_buffer.default").cure, "sysctl -w net.core.rmem_default=1048576");
}

TEST(DoctorFindings, UnsynchronisedUtcIsAWarningOnly) {
  auto probes = good_computer();
  probes.time.synchronised = false;
  EXPECT_EQ(find(probes, "time.utc").level, Level::kWarning);
}

TEST(DoctorFindings, VehicleTimeMustRunForward) {
  auto probes = good_computer();
  probes.time.boottime_ns = {5'000, 4'000, 6'000};
  EXPECT_EQ(find(probes, "time.boottime").level, Level::kFailure);
  EXPECT_EQ(find(probes, "time.boottime").found, "CLOCK_BOOTTIME went back by 1000 ns");
  probes.time.boottime_ns = {5'000, 5'000, 5'000};
  EXPECT_EQ(find(probes, "time.boottime").found, "CLOCK_BOOTTIME stands still");
  probes.time.boottime_ns.clear();
  EXPECT_EQ(find(probes, "time.boottime").level, Level::kFailure);
}

TEST(DoctorFindings, AWallClockFromBeforeTheBuildIsWrong) {
  auto probes = good_computer();
  probes.time.wall_clock_s = 0;  // what a computer without a battery-backed clock says after its start
  const auto finding = find(probes, "time.wall_clock");
  EXPECT_EQ(finding.level, Level::kWarning);
  EXPECT_EQ(finding.found, "it is 1970-01-01, before this program was built (2023-11-14)");
  probes.time.wall_clock_s = probes.time.build_time_s;
  EXPECT_EQ(find(probes, "time.wall_clock").level, Level::kOk);
}

TEST(DoctorFindings, DiskOfTheLogDirectory) {
  auto probes = good_computer();
  auto& free_bytes = probes.resources.disk_free_bytes;
  free_bytes = 1024 * kMebibyte;
  EXPECT_EQ(find(probes, "disk.log_directory").level, Level::kOk);
  EXPECT_EQ(find(probes, "disk.log_directory").found, "1.0 GiB free in /var/log/flights");
  free_bytes = 1024 * kMebibyte - 1;
  EXPECT_EQ(find(probes, "disk.log_directory").level, Level::kWarning);
  free_bytes = 100 * kMebibyte - 1;
  EXPECT_EQ(find(probes, "disk.log_directory").level, Level::kFailure);
  free_bytes.reset();
  EXPECT_EQ(find(probes, "disk.log_directory").level, Level::kFailure);
  EXPECT_EQ(find(probes, "disk.log_directory").cure, "mkdir -p '/var/log/flights'");
}

TEST(DoctorFindings, ALogDirectoryOfAnotherUserIsUnknown) {
  auto probes = good_computer();
  probes.resources.log_directory_writable = false;
  EXPECT_EQ(find(probes, "disk.log_directory").level, Level::kUnknown);
}

TEST(DoctorFindings, Memory) {
  auto probes = good_computer();
  probes.resources.memory_available_bytes = 256 * kMebibyte - 1;
  EXPECT_EQ(find(probes, "memory.available").level, Level::kWarning);
  probes.resources.memory_available_bytes = 64 * kMebibyte - 1;
  EXPECT_EQ(find(probes, "memory.available").level, Level::kFailure);
}

}  // namespace
}  // namespace airworthy::doctor
