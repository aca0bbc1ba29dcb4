#include "gateway/gateway_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "gateway/feed/endpoint.h"
#include "runtime/config/vehicle.h"

namespace airworthy::gateway {
namespace {

using rt::ConfigTable;
using rt::Range;

constexpr std::size_t kLongestProcessName = 64;

FeedConfig read_feed(ConfigTable table) {
  FeedConfig feed;
  feed.endpoint = table.optional<std::string>("endpoint", feed.endpoint);
  feed.allow_plain_remote = table.optional<bool>("allow_plain_remote", feed.allow_plain_remote);
  feed.high_water_mark = table.optional<int>("high_water_mark", feed.high_water_mark, Range{1, 1e6});
  feed.linger_ms = table.optional<int>("linger_ms", feed.linger_ms, Range{0, 10'000});
  if (const auto wrong = endpoint_error(feed.endpoint)) {
    table.fail("endpoint", *wrong);
  } else if (!feed.allow_plain_remote && !is_local_endpoint(feed.endpoint)) {
    table.fail(
        "endpoint",
        fmt::format("{} can be reached from other computers, and the feed is not encrypted: use a loopback "
                    "address, or set feed.allow_plain_remote = true",
                    feed.endpoint),
        {"allow_plain_remote"});
  }
  return feed;
}

Duration read_duration(ConfigTable table, const char* key, Duration default_value, Range range_s) {
  return from_seconds(table.optional<double>(key, to_seconds(default_value), range_s));
}

void check_process_name(ConfigTable table, const char* key, const std::string& name) {
  if (name.empty() || name.size() > kLongestProcessName) {
    table.fail(key, fmt::format("\"{}\" is no process name: must have 1 to {} characters", name,
                                kLongestProcessName));
  }
}

/// A process that is named twice was hardly meant twice.
std::vector<std::string> read_processes(ConfigTable table, const char* key, rt::Count count) {
  auto names = table.required<std::vector<std::string>>(key, {}, count);
  for (auto name = names.begin(); name != names.end(); ++name) {
    check_process_name(table, key, *name);
    if (std::find(names.begin(), name, *name) != name) {
      table.fail(key, fmt::format("\"{}\" is named twice", *name));
    }
  }
  return names;
}

health::HealthConfig read_health(ConfigTable table) {
  health::HealthConfig health;
  health.expected_processes =
      read_processes(table, "expected_processes", rt::Count::at_most(health.limits.processes / 2));

  // Below 0.3 s a life sign every 0.2 s could not be on time; above 60 s a deadline is none.
  health.process_deadline =
      read_duration(table, "process_deadline_s", health.process_deadline, Range{0.3, 60.0});
  health.detector_deadline =
      read_duration(table, "detector_deadline_s", health.detector_deadline, Range{0.6, 60.0});
  health.link_deadline = read_duration(table, "link_deadline_s", health.link_deadline, Range{1.2, 60.0});
  health.link_silence = read_duration(table, "link_silence_s", health.link_silence, Range{0.1, 600.0});
  health.start_grace = read_duration(table, "start_grace_s", health.start_grace, Range{0.0, 600.0});

  for (ConfigTable& source : table.tables("source", {.unique_key = "process"})) {
    const auto process = source.required<std::string>("process");
    check_process_name(source, "process", process);
    health.feeds[process] = read_processes(source, "feeds", {});
  }
  return health;
}

}  // namespace

rt::Expected<GatewayConfig> GatewayConfig::load(const std::string& path,
                                                const std::vector<std::string>& overrides) {
  auto file = rt::ConfigFile::load(path, overrides);
  ConfigTable root = file.root();
  GatewayConfig config;
  const rt::VehicleFile vehicle = rt::VehicleFile::named_by(root);
  config.vehicle = vehicle.name;
  config.multirotor = vehicle.multirotor;
  config.feed = read_feed(root.table("feed"));
  config.health = read_health(root.required_table("health"));
  config.health.vehicle = config.vehicle;
  config.hash = file.hash();
  return file.finish(std::move(config));
}

}  // namespace airworthy::gateway
