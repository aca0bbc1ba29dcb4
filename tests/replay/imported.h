#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "cli/import/table.h"
#include "cli/import/table_map.h"
#include "runtime/bus/log_bus.h"
#include "runtime/clock/manual_clock.h"
#include "runtime/log/log.h"
#include "runtime/process/node.h"
#include "tests/runtime/temporary_folder.h"

namespace airworthy::testing {

/// Writes a recorded flight as an LCM log, with a shipped map; the name of its vehicle.
inline std::string import_recording(const std::filesystem::path& recording, const std::string& map_name,
                                    const std::filesystem::path& log) {
  const auto map = importer::ImportMap::load(std::string{AIRWORTHY_CONFIG} + "/import/" + map_name + ".toml");
  EXPECT_TRUE(map.has_value()) << (map ? "" : map.error().text);
  const auto imported = importer::import_table(recording, *map, {}, map->vehicle, log,
                                               [](double) { return rt::Expected<void>{}; });
  EXPECT_TRUE(imported.has_value()) << (imported ? "" : imported.error().text);
  return map->vehicle;
}

/// A recorded flight, imported with a shipped map, ready to be played into what subscribes at its node.
class Imported {
 public:
  Imported(const std::filesystem::path& recording, const std::string& map_name) {
    const auto log = folder_.path() / "flight.lcm";
    vehicle_ = import_recording(recording, map_name, log);
    auto bus = rt::LogBus::open(log.string());
    EXPECT_TRUE(bus.has_value());
    bus_ = std::move(*bus);
    node_ = std::make_unique<rt::Node>(*bus_, clock_, quiet_, rt::Identity{vehicle_, "test", 1});
  }

  [[nodiscard]] const std::string& vehicle() const { return vehicle_; }

  [[nodiscard]] rt::Node& node() { return *node_; }
  /// Another at the same bus.
  [[nodiscard]] rt::Node node_of(const std::string& service) {
    return {*bus_, clock_, quiet_, rt::Identity{vehicle_, service, 1}};
  }

  void play() {
    const auto played = bus_->play(clock_, [](std::string_view) { return true; });
    EXPECT_TRUE(played.has_value());
  }

 private:
  rt::TemporaryFolder folder_;
  std::string vehicle_;
  rt::ManualClock clock_;
  rt::Log quiet_{"test", rt::LogLevel::kError};
  std::unique_ptr<rt::LogBus> bus_;
  std::unique_ptr<rt::Node> node_;
};

}  // namespace airworthy::testing
