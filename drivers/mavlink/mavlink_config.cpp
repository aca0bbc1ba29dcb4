#include "drivers/mavlink/mavlink_config.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/protocol/mavlink/message_table.h"
#include "core/protocol/mavlink/messages.h"
#include "runtime/config/vehicle.h"

namespace airworthy::drivers {
namespace {

using rt::ConfigTable;
using rt::Count;
using rt::Range;

constexpr int kMostRotors = 8;
constexpr int kUsualRotors = 4;  // where the vehicle file does not say

const std::vector<std::string> kImuMessages{"HIGHRES_IMU", "RAW_IMU", "SCALED_IMU", "SCALED_IMU2",
                                            "SCALED_IMU3"};

const mavlink::MessageInfo* find_by_name(const std::string& name) {
  const auto table = mavlink::message_table();
  const auto found = std::find_if(table.begin(), table.end(),
                                  [&name](const mavlink::MessageInfo& info) { return info.name == name; });
  return found == table.end() ? nullptr : &*found;
}

LinkAddress read_link(ConfigTable root) {
  const auto text = root.required<std::string>("link");
  const auto address = LinkAddress::parse(text);
  if (address) return *address;
  root.fail("link", address.error().text);
  return {};
}

void read_autopilot(ConfigTable table, MavlinkConfig& config) {
  config.system_id = table.optional<int>("system_id", 0, Range{0, 255});
  config.component_id = table.optional<int>("component_id", 1, Range{1, 255});
  config.autopilot = table.choice<Autopilot>("kind",
                                             {{"auto", Autopilot::kUnknown},
                                              {"px4", Autopilot::kPx4},
                                              {"ardupilot", Autopilot::kArdupilot},
                                              {"other", Autopilot::kOther}},
                                             Autopilot::kUnknown);
}

void read_imu(ConfigTable table, MavlinkConfig& config) {
  for (const std::string& name : table.optional<std::vector<std::string>>("sources", kImuMessages)) {
    if (std::find(kImuMessages.begin(), kImuMessages.end(), name) == kImuMessages.end()) {
      table.fail("sources", fmt::format("\"{}\" is not one of {}", name, fmt::join(kImuMessages, ", ")));
    } else {
      config.imu_sources.push_back(find_by_name(name)->id);
    }
  }
  config.raw_imu_unit = table.choice<RawImuUnit>(
      "raw_imu_unit",
      {{"auto", RawImuUnit::kByAutopilot}, {"milli_g", RawImuUnit::kMilliG}, {"none", RawImuUnit::kNone}},
      RawImuUnit::kByAutopilot);
  config.averaging_window_s = table.optional<double>("averaging_window_s", config.averaging_window_s,
                                                     Range{0.0, 1.0}.or_not_finite());
}

void read_rotors(ConfigTable root, const rt::VehicleFile& vehicle, MavlinkConfig& config) {
  ConfigTable table = root.table("rotors");
  const int described = vehicle.multirotor ? static_cast<int>(vehicle.multirotor->rotor_count) : kUsualRotors;
  config.rotor_count = table.optional<int>("count", described, Range{0, kMostRotors});
  if (vehicle.multirotor && config.rotor_count != described) {
    table.fail("count", fmt::format("{}, but vehicle \"{}\" is described with {} rotors", config.rotor_count,
                                    vehicle.name, described));
  }
  std::vector<int> identity;
  for (int rotor = 1; rotor <= config.rotor_count; ++rotor) identity.push_back(rotor);
  config.rotor_of_esc =
      table.optional<std::vector<int>>("rotor_of_esc", identity, Range{0, kMostRotors}, Count::at_most(32));
  for (const int rotor : config.rotor_of_esc) {
    if (rotor > config.rotor_count) {
      table.fail("rotor_of_esc", fmt::format("rotor {} exceeds count ({})", rotor, config.rotor_count),
                 {"count"});
    }
    if (rotor != 0 && std::count(config.rotor_of_esc.begin(), config.rotor_of_esc.end(), rotor) > 1) {
      table.fail("rotor_of_esc", fmt::format("rotor {} is given twice", rotor));
    }
  }

  ConfigTable command = root.table("rotor_command");
  config.rotor_command_source = command.choice<RotorCommandSource>(
      "source",
      {{"none", RotorCommandSource::kNone},
       {"SERVO_OUTPUT_RAW", RotorCommandSource::kServoOutputRaw},
       {"ACTUATOR_OUTPUT_STATUS", RotorCommandSource::kActuatorOutputStatus}},
      RotorCommandSource::kNone);
  const bool is_servo = config.rotor_command_source != RotorCommandSource::kActuatorOutputStatus;
  for (ConfigTable output :
       command.tables("output", {.unique_key = "rotor", .count = Count::at_most(kMostRotors)})) {
    OutputMap map;
    map.output = output.required<int>("output", Range{1, is_servo ? 16.0 : 32.0});
    map.port = output.optional<int>("port", 0, Range{0, 255});
    map.rotor = output.required<int>("rotor", Range{1, kMostRotors});
    map.stopped = output.optional<double>("stopped", 1000.0, Range{-1e6, 1e6});
    map.full = output.optional<double>("full", 2000.0, Range{-1e6, 1e6});
    if (map.rotor > config.rotor_count) {
      output.fail("rotor", fmt::format("{} exceeds rotors.count ({})", map.rotor, config.rotor_count));
    }
    if (map.full == map.stopped) {
      output.fail("full", fmt::format("must differ from stopped ({})", map.stopped), {"stopped"});
    }
    config.outputs.push_back(map);
  }
  if (config.rotor_command_source != RotorCommandSource::kNone && config.outputs.empty()) {
    command.fail("source", "needs at least one [[rotor_command.output]]", {"output"});
  }
}

void read_flight_state(ConfigTable table, MavlinkConfig& config) {
  config.field_timeout = from_seconds(table.optional<double>("field_timeout_s", 3.0, Range{0.1, 60.0}));
  config.airspeed_error_unit =
      table.choice<AirspeedErrorUnit>("airspeed_error_unit",
                                      {{"auto", AirspeedErrorUnit::kByAutopilot},
                                       {"m_s", AirspeedErrorUnit::kMetresPerSecond},
                                       {"cm_s", AirspeedErrorUnit::kCentimetresPerSecond}},
                                      AirspeedErrorUnit::kByAutopilot);
}

void read_send(ConfigTable table, MavlinkConfig& config) {
  config.send_heartbeat = table.optional<bool>("heartbeat", true);
  config.timesync_rate_Hz = table.optional<double>("timesync_rate_Hz", 2.0, Range{0.0, 20.0});
  config.own_system_id = table.optional<int>("system_id", 0, Range{0, 255});
  config.own_component_id = table.optional<int>("component_id", 191, Range{1, 255});
  for (ConfigTable request : table.tables("request", {.unique_key = "message"})) {
    RateRequest rate;
    rate.message = request.required<std::string>("message");
    rate.rate_Hz = request.required<double>("rate_Hz", Range{0.1, 1000.0});
    if (const auto* info = find_by_name(rate.message)) {
      rate.message_id = info->id;
    } else {
      request.fail("message", fmt::format("\"{}\" is no MAVLink message", rate.message));
    }
    config.requests.push_back(rate);
  }
}

}  // namespace

rt::Expected<MavlinkConfig> MavlinkConfig::load(const std::string& path,
                                                const std::vector<std::string>& overrides) {
  auto file = rt::ConfigFile::load(path, overrides);
  ConfigTable root = file.root();
  MavlinkConfig config;
  const rt::VehicleFile vehicle = rt::VehicleFile::named_by(root);
  config.vehicle = vehicle.name;
  config.link = read_link(root);
  config.silence = from_seconds(root.optional<double>("silence_s", 10.0, Range{1.0, 3600.0}));
  read_autopilot(root.table("autopilot"), config);
  read_imu(root.table("imu"), config);
  read_rotors(root, vehicle, config);
  read_flight_state(root.table("flight_state"), config);
  read_send(root.table("send"), config);
  config.hash = file.hash();
  return file.finish(std::move(config));
}

}  // namespace airworthy::drivers
