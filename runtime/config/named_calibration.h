#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>

#include "runtime/config/config_file.h"

namespace airworthy::rt {

/// The calibration file that a configuration names under its required key `calibration`, read by `load` (a path to an
/// Expected of something with `hash` and `vehicle`). Nothing where the name is empty or `opens_it` is false; nor where
/// the file has a mistake or belongs to another vehicle, which is reported through `root`.
template <class Load>
auto named_calibration(ConfigTable root, const std::string& vehicle, bool opens_it, Load load) {
  using Calibration = typename decltype(load(std::string{}))::value_type;
  std::optional<Calibration> found;
  const auto path = root.required_path("calibration");
  if (path.empty() || !opens_it) return found;
  auto calibration = load(path);
  if (!calibration) {
    root.fail_in_other_file(calibration.error());
    return found;
  }
  root.record("calibration.hash", calibration->hash);
  if (calibration->vehicle != vehicle) {
    root.fail("calibration",
              fmt::format("is of vehicle \"{}\", not of \"{}\"", calibration->vehicle, vehicle), {"vehicle"});
    return found;
  }
  found = std::move(*calibration);
  return found;
}

}  // namespace airworthy::rt
