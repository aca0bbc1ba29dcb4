#pragma once

namespace airworthy {

/// What became of a sample. On anything but kFused the estimator's state is as before.
enum class UpdateStatus {
  kFused,
  kConverging,    ///< taken, but no estimate yet
  kNotFinite,     ///< NaN or infinity in the sample
  kTimeBackward,  ///< not newer than the last sample
};

}  // namespace airworthy
