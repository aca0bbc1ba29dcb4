#pragma once

namespace airworthy::calibrate {

/// `airworthy calibrate unbalance`. Returns the exit code.
[[nodiscard]] int calibrate_unbalance(int argc, char** argv);

}  // namespace airworthy::calibrate
