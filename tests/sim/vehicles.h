#pragma once

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "runtime/config/vehicle.h"
#include "sim/config/scenario.h"

namespace airworthy::sim {

inline constexpr std::array kVehicles{
    "unbalance_small",  "unbalance_medium",   "unbalance_hexa", "bebop2", "f450", "octo",
    "indiflight_throw", "crazyflie_brushless"};

/// A shipped vehicle, by the name of its file.
inline Multirotor vehicle_named(const std::string& name) {
  const auto file = rt::VehicleFile::load(std::string{AIRWORTHY_CONFIG} + "/vehicles/" + name + ".toml");
  EXPECT_TRUE(file.has_value()) << (file ? "" : file.error().text);
  return file ? file->multirotor.value_or(Multirotor{}) : Multirotor{};
}

/// A flight plan out of parts.
inline Scenario plan_of(std::vector<Segment> segments, std::vector<Fault> faults = {}) {
  Scenario scenario;
  scenario.segments = std::move(segments);
  scenario.faults = std::move(faults);
  return scenario;
}

/// Take-off to 2 m at 1 s and a hover until the end.
inline Scenario hover_plan(double duration_s) {
  return plan_of({Segment{.manoeuvre = Manoeuvre::kGround, .duration_s = 1.0},
                  Segment{.manoeuvre = Manoeuvre::kTakeOff, .duration_s = 4.0},
                  Segment{.manoeuvre = Manoeuvre::kHover, .duration_s = duration_s - 5.0}});
}

}  // namespace airworthy::sim
