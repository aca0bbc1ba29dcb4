#pragma once

namespace airworthy::calibrate {

/// `airworthy calibrate effectiveness`. Returns the exit code.
[[nodiscard]] int calibrate_effectiveness(int argc, char** argv);

}  // namespace airworthy::calibrate
