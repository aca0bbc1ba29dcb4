#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "core/time/time.h"
#include "drivers/ports/link_address.h"
#include "runtime/config/config_file.h"

namespace airworthy::drivers {

/// Some messages mean different things from different autopilots. kUnknown until its HEARTBEAT was heard.
enum class Autopilot : std::uint8_t { kUnknown, kPx4, kArdupilot, kOther };

enum class RawImuUnit : std::uint8_t { kByAutopilot, kMilliG, kNone };
enum class AirspeedErrorUnit : std::uint8_t { kByAutopilot, kMetresPerSecond, kCentimetresPerSecond };
enum class RotorCommandSource : std::uint8_t { kNone, kServoOutputRaw, kActuatorOutputStatus };

/// One output of the flight controller that drives a rotor.
struct OutputMap {
  int output = 1;           ///< from 1, as SERVO_OUTPUT_RAW counts; element of ACTUATOR_OUTPUT_STATUS plus 1
  int port = 0;             ///< of SERVO_OUTPUT_RAW: 0 main, 1 auxiliary
  int rotor = 1;            ///< from 1
  double stopped = 1000.0;  ///< value at which the rotor stands, µs or the output driver's own unit
  double full = 2000.0;
};

struct RateRequest {
  std::string message;
  std::uint32_t message_id = 0;
  double rate_Hz = 0.0;
};

struct MavlinkConfig {
  std::string vehicle;
  std::string hash;
  LinkAddress link;
  Duration silence{10'000'000};  ///< a link silent for longer is reopened

  int system_id = 0;  ///< 0 = the first autopilot heard
  int component_id = 1;
  Autopilot autopilot = Autopilot::kUnknown;  ///< kUnknown = as its HEARTBEAT says

  /// Message ids that may feed IMU; where several report the same sensor, the earlier one counts.
  std::vector<std::uint32_t> imu_sources;
  RawImuUnit raw_imu_unit = RawImuUnit::kByAutopilot;
  double averaging_window_s = std::numeric_limits<double>::quiet_NaN();

  int rotor_count = 4;
  std::vector<int> rotor_of_esc;  ///< rotor number of ESC 0, 1, ...; 0 = none
  RotorCommandSource rotor_command_source = RotorCommandSource::kNone;
  std::vector<OutputMap> outputs;

  Duration field_timeout{3'000'000};
  AirspeedErrorUnit airspeed_error_unit = AirspeedErrorUnit::kByAutopilot;

  bool send_heartbeat = true;
  double timesync_rate_Hz = 2.0;  ///< 0 = none
  int own_system_id = 0;          ///< 0 = that of the autopilot
  int own_component_id = 191;
  std::vector<RateRequest> requests;

  [[nodiscard]] static rt::Expected<MavlinkConfig> load(const std::string& path,
                                                        const std::vector<std::string>& overrides);
};

}  // namespace airworthy::drivers
