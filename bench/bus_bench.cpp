// One message from publish to callback: through Node and LCM multicast, beside the same bytes through a plain UDP socket
// on loopback in the same run.

#include <arpa/inet.h>
#include <benchmark/benchmark.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <vector>

#include "runtime/bus/channels.h"
#include "runtime/bus/lcm_bus.h"
#include "runtime/clock/manual_clock.h"
#include "runtime/process/node.h"

namespace {

using namespace airworthy;

void publish_to_callback(benchmark::State& state, const std::string& url) {
  auto bus = rt::LcmBus::open(url);
  if (!bus) {
    state.SkipWithError(bus.error().text.c_str());
    return;
  }
  rt::ManualClock clock{from_us(1)};
  rt::Log log{"bench", rt::LogLevel::kError};
  rt::Node node{**bus, clock, log, {"bench", "bench", 1}};
  std::int64_t received = 0;
  node.subscribe<imu_t>(channel::kImu, [&received](const imu_t&) { ++received; });
  auto publisher = node.advertise(channel::kImu);
  imu_t imu{};
  std::int64_t sent = 0;
  for (auto step : state) {
    (void)step;
    publisher.publish(imu, from_us(++sent));
    while (received < sent) {
      if (!(*bus)->dispatch(1)) break;
    }
  }
  state.counters["bytes"] = imu.getEncodedSize();
}

void BM_LcmMulticast(benchmark::State& state) {
  publish_to_callback(state, "udpm://239.255.76.67:7699?ttl=0");
}
BENCHMARK(BM_LcmMulticast)->UseRealTime();

void BM_LcmInProcess(benchmark::State& state) { publish_to_callback(state, "memq://"); }
BENCHMARK(BM_LcmInProcess)->UseRealTime();

void BM_PlainUdpReference(benchmark::State& state) {
  const int receiver = socket(AF_INET, SOCK_DGRAM, 0);
  const int sender = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  const auto* const where = reinterpret_cast<const sockaddr*>(&address);
  if (bind(receiver, where, length) != 0 ||
      getsockname(receiver, reinterpret_cast<sockaddr*>(&address), &length) != 0) {
    state.SkipWithError("no loopback socket");
    return;
  }
  imu_t imu{};
  imu.header.producer = "bench";
  std::vector<std::uint8_t> payload(static_cast<std::size_t>(imu.getEncodedSize()));
  std::array<std::uint8_t, 2048> received{};
  for (auto step : state) {
    (void)step;
    imu.encode(payload.data(), 0, static_cast<int>(payload.size()));
    if (sendto(sender, payload.data(), payload.size(), 0, where, length) < 0) state.SkipWithError("sendto");
    const ssize_t size = recv(receiver, received.data(), received.size(), 0);
    imu.decode(received.data(), 0, static_cast<int>(size));
    benchmark::DoNotOptimize(imu);
  }
  close(sender);
  close(receiver);
}
BENCHMARK(BM_PlainUdpReference)->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
