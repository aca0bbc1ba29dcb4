#pragma once

namespace airworthy {

/// What became of a sample. On anything but kFused the estimator's state is as before.
enum class UpdateStatus {
  kFused,
  kConverging,    ///< taken, but no estimate yet
  kNotFinite,     ///< NaN or infinity in the sample, or in what it would have made of the state
  kOutOfRange,    ///< finite, but beyond what any sensor gives
  kTimeBackward,  ///< not newer than the last sample
  kNotExcited,    ///< predicted, but too little information in the regressor to learn from
};

}  // namespace airworthy
