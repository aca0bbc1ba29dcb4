#pragma once

#include <cstdint>

#include "core/detectors/fault_life_cycle.h"
#include "core/time/time.h"

namespace airworthy::response {

/// Why a channel gives no verdict at a tick.
enum class NotJudged : std::uint8_t {
  kJudged,
  kConverging,
  kInputUnknown,
  kPaused,  ///< by the monitor, which knows why
};

/// The verdict of one tick with all that a reader needs to recompute it.
struct ChannelVerdict {
  NotJudged reason = NotJudged::kConverging;
  double observed = 0;
  double expected = 0;
  double commanded = 0;   ///< the commanded part of it, for a gain loss
  double sigma = 0;       ///< of observed − expected, predicted
  double test_ratio = 0;  ///< alarm at 1
  FaultLifeCycle::Transition transition = FaultLifeCycle::Transition::kNone;
  TimePoint onset;             ///< of the active fault
  double mean_innovation = 0;  ///< since the onset, while a fault is active
  double mean_innovation_sigma = 0;
};

}  // namespace airworthy::response
