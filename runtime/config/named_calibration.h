#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>

#include "runtime/config/config_file.h"

namespace airworthy::rt {

/// The errors of a file that is no calibration of the wanted kind; where it is one for another detector, just that.
inline Error errors_of_calibration(const std::string& path, const Error& errors) {
  struct Kind {
    const char* detector;
    const char* key;  ///< that only its calibrations have: a reader of another kind does not know it
  };
  for (const Kind& kind : {Kind{"response", "configuration"}, Kind{"unbalance", "against_ratio"},
                           Kind{"effectiveness", "gyro_noise_rad_s"}}) {
    if (errors.text.find(fmt::format(": {}: unknown key", kind.key)) == std::string::npos) continue;
    return Error{fmt::format("{}: is a calibration for airworthy-{}", path, kind.detector)};
  }
  return errors;
}

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
    root.fail_in_other_file("calibration", errors_of_calibration(path, calibration.error()));
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
