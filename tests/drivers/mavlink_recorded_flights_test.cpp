// The whole path from bytes to messages on real ArduPilot flights.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "core/protocol/mavlink/parser.h"
#include "core/protocol/mavlink/tlog.h"
#include "drivers/mavlink/mavlink_receiver.h"
#include "tests/drivers/mavlink_support.h"
#include "tests/support/recorded_data.h"

namespace airworthy::drivers {
namespace {

std::vector<std::uint8_t> unpacked(const std::filesystem::path& path) {
  std::vector<std::uint8_t> bytes;
  FILE* pipe = popen(("xz -dc '" + path.string() + "'").c_str(), "r");
  if (pipe == nullptr) return bytes;
  std::array<std::uint8_t, 65536> block{};
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), pipe)) {
    bytes.insert(bytes.end(), block.begin(), block.begin() + static_cast<std::ptrdiff_t>(count));
  }
  EXPECT_EQ(pclose(pipe), 0);
  return bytes;
}

template <class Message>
void expect_monotone(const testing::RecordingSink::Record<Message>& record, const char* name) {
  for (std::size_t i = 1; i < record.size(); ++i)
    ASSERT_GE(record[i].first, record[i - 1].first) << name << " " << i;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

TEST(MavlinkRecordedFlights, BecomeTheMessagesTheyWere) {
  const auto folder = airworthy::testing::recorded_data() / "alfa_mavlink";
  if (!std::filesystem::is_directory(folder)) {
    GTEST_SKIP() << "no recorded flights in " << folder
                 << "; set AIRWORTHY_DATA to the folder that holds them";
  }
  int flights = 0;
  for (const auto& entry : std::filesystem::directory_iterator{folder}) {
    if (entry.path().extension() != ".xz") continue;
    SCOPED_TRACE(entry.path().filename());
    const MavlinkConfig config = testing::default_config();
    testing::RecordingSink sink;
    rt::Counters counters;
    rt::Log log{"test", rt::LogLevel::kError};
    MavlinkReceiver receiver{config, sink, counters, log};
    mavlink::Parser parser;
    const auto bytes = unpacked(entry.path());
    mavlink::TlogReader reader{bytes};
    mavlink::TlogRecord record;
    TimePoint arrival{};
    while (reader.next(record) == mavlink::TlogStatus::kRecord) {
      arrival = std::max(arrival, from_us(record.time_us));
      parser.push(record.packet, [&](const mavlink::Frame& frame) { receiver.on_frame(frame, arrival); });
    }

    EXPECT_EQ(receiver.autopilot(), Autopilot::kArdupilot);
    expect_monotone(sink.imu, "IMU");
    expect_monotone(sink.attitude, "ATTITUDE");
    expect_monotone(sink.setpoint, "ATTITUDE_SETPOINT");
    expect_monotone(sink.flight_state, "FLIGHT_STATE");
    const auto received = [&receiver](std::uint32_t id) {
      return static_cast<std::size_t>(receiver.counts().at(id));
    };
    EXPECT_EQ(sink.imu.size(), received(mavlink::RawImu::kId) + received(mavlink::ScaledImu2::kId));
    EXPECT_EQ(sink.attitude.size(), received(mavlink::Attitude::kId));
    EXPECT_EQ(sink.setpoint.size(), received(mavlink::NavControllerOutput::kId));
    EXPECT_GE(sink.flight_state.size(),
              received(mavlink::VfrHud::kId) + received(mavlink::NavControllerOutput::kId));
    for (const counter_t& counter : counters.to_messages()) {
      EXPECT_FALSE(counter.name.starts_with("refused.")) << counter.name << " " << counter.value;
    }

    // In flight the specific force is about 1 g, and speed control keeps within a few m/s: a wrong unit would
    // be off by a factor of 100 or 1000.
    std::vector<double> accel_m_s2;
    for (const auto& [time, imu] : sink.imu) {
      accel_m_s2.push_back(std::hypot(imu.accel_m_s2[0], imu.accel_m_s2[1], imu.accel_m_s2[2]));
    }
    EXPECT_GT(median(accel_m_s2), 9.0);
    EXPECT_LT(median(accel_m_s2), 14.0);
    std::vector<double> airspeed_error_m_s;
    for (const auto& [time, state] : sink.flight_state) {
      if (!std::isnan(state.airspeed_error_m_s))
        airspeed_error_m_s.push_back(std::abs(state.airspeed_error_m_s));
    }
    EXPECT_GT(median(airspeed_error_m_s), 0.1);
    EXPECT_LT(median(airspeed_error_m_s), 10.0);
    EXPECT_EQ(receiver.device_time().summary(arrival).source, "arrival");
    ++flights;
  }
  EXPECT_GT(flights, 0);
}

}  // namespace
}  // namespace airworthy::drivers
