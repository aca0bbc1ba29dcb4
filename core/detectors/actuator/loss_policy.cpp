#include "core/detectors/actuator/loss_policy.h"

#include <cmath>
#include <numbers>

namespace airworthy::actuator {

double LossPolicy::exceedance(double gamma, double sigma, double threshold) noexcept {  // (1)
  return 0.5 * std::erfc((threshold - gamma) / (sigma * std::numbers::sqrt2));
}

FaultLifeCycle::Transition LossPolicy::step(double gamma, double sigma, bool may_raise,
                                            TimePoint now) noexcept {
  probability_ = exceedance(gamma, sigma, params_.loss);
  if (!has_time_ || probability_ < 0.5) likely_since_ = now;
  has_time_ = true;
  const bool holds = probability_ >= params_.probability && may_raise;
  if (!holds) certain_since_.reset();
  if (holds && !certain_since_) certain_since_ = now;
  if (!life_.active()) {
    if (!holds || now - *certain_since_ < params_.persistence) return FaultLifeCycle::Transition::kNone;
    onset_ = likely_since_;
  }
  return life_.step(probability_ / params_.probability, now);
}

void LossPolicy::pause(TimePoint now) noexcept {
  certain_since_.reset();
  likely_since_ = now;
}

}  // namespace airworthy::actuator
