#pragma once

namespace airworthy::calibrate {

/// `airworthy calibrate response`, and `--suggest-pairs`. Returns the exit code.
[[nodiscard]] int calibrate_response(int argc, char** argv);

}  // namespace airworthy::calibrate
