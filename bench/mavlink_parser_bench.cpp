// The parser beside the least any parser must do in the same run: find frames by trusted headers, check each
// with a plain byte-wise checksum, copy the payload.
#include <benchmark/benchmark.h>

#include <cstring>
#include <vector>

#include "core/protocol/mavlink/messages.h"
#include "core/protocol/mavlink/parser.h"

namespace airworthy::mavlink {
namespace {

/// One second of a busy link, repeated: inertial samples, attitude, ESC telemetry.
std::vector<std::uint8_t> busy_link() {
  std::vector<std::uint8_t> stream;
  std::uint8_t sequence = 0;
  const auto add = [&](const auto& message) {
    const EncodedFrame frame = encode(message, {1, 1}, sequence++);
    stream.insert(stream.end(), frame.view().begin(), frame.view().end());
  };
  for (std::uint32_t i = 0; i < 2000; ++i) {
    HighresImu imu;
    imu.time_usec = 2000ULL * i;
    imu.zacc = -9.81F;
    imu.xgyro = 0.01F * static_cast<float>(i % 17);
    imu.temperature = 41.0F;
    imu.fields_updated = 0x1FFF;
    add(imu);
    if (i % 5 == 0) add(Attitude{.time_boot_ms = 2 * i, .roll = 0.1F, .pitch = 0.2F, .yaw = 0.3F});
    if (i % 10 == 0)
      add(EscStatus{.time_usec = 2000ULL * i, .rpm = {6000, 6100, 6200, 6300}, .voltage = {16, 16, 16, 16}});
  }
  return stream;
}

void parser(benchmark::State& state) {
  const auto stream = busy_link();
  for (auto _ : state) {
    Parser parser;
    std::size_t frames = 0;
    parser.push(stream, [&](const Frame& frame) { frames += frame.length > 0 ? 1U : 0U; });
    benchmark::DoNotOptimize(frames);
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(stream.size()));
}
BENCHMARK(parser);

void parser_byte_by_byte(benchmark::State& state) {
  const auto stream = busy_link();
  for (auto _ : state) {
    Parser parser;
    std::size_t frames = 0;
    for (const std::uint8_t& byte : stream) {
      parser.push(std::span{&byte, 1}, [&](const Frame& frame) { frames += frame.length > 0 ? 1U : 0U; });
    }
    benchmark::DoNotOptimize(frames);
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(stream.size()));
}
BENCHMARK(parser_byte_by_byte);

void plain_reference(benchmark::State& state) {
  const auto stream = busy_link();
  for (auto _ : state) {
    std::array<std::uint8_t, kMaxPayload> payload{};
    std::size_t frames = 0;
    for (std::size_t at = 0; at + kHeaderSizeV2 <= stream.size();) {
      const std::size_t length = stream[at + 1];
      std::uint32_t crc = 0xFFFF;
      for (std::size_t i = at + 1; i < at + kHeaderSizeV2 + length; ++i) {
        std::uint32_t byte = (stream[i] ^ crc) & 0xFFU;
        byte = (byte ^ (byte << 4U)) & 0xFFU;
        crc = (crc >> 8U) ^ (byte << 8U) ^ (byte << 3U) ^ (byte >> 4U);
      }
      std::memcpy(payload.data(), stream.data() + at + kHeaderSizeV2, length);
      frames += crc != 0 ? 1U : 0U;
      benchmark::DoNotOptimize(payload);
      at += kHeaderSizeV2 + length + kChecksumSize;
    }
    benchmark::DoNotOptimize(frames);
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(stream.size()));
}
BENCHMARK(plain_reference);

}  // namespace
}  // namespace airworthy::mavlink

BENCHMARK_MAIN();
