#include "core/detectors/response/arx_channel.h"

#include <algorithm>
#include <cmath>

namespace airworthy::response {

using Transition = FaultLifeCycle::Transition;

ArxChannel::ArxChannel(const ArxParams& params, const FaultLifeCycleParams& life_cycle,
                       Duration warm_up) noexcept
    : params_{params},
      warm_up_{warm_up},
      rls_{{.terms = params.past_outputs + params.past_inputs + 1,
            .prior_variance = params.prior_variance,
            .forgetting = params.forgetting,
            .excitation_floor = params.excitation_floor}},
      life_cycle_{life_cycle} {}

void ArxChannel::sample(TimePoint time, double input, double output) noexcept {
  if (!std::isfinite(input) || !std::isfinite(output) || (sampled_ && time <= last_sample_)) return;
  if (sampled_ && time - last_sample_ > params_.longest_gap) restart_history();
  sampled_ = true;
  last_sample_ = time;
  if (past_count_ >= std::max(params_.past_outputs, params_.past_inputs)) {
    Rls::Vector x{params_.past_outputs + params_.past_inputs + 1};  // (1)
    Eigen::Index at = 0;
    x(at++) = input;
    for (int i = 0; i < params_.past_outputs; ++i) x(at++) = past_outputs_[static_cast<std::size_t>(i)];
    for (int i = 0; i < params_.past_inputs; ++i) x(at++) = past_inputs_[static_cast<std::size_t>(i)];
    Rls::Innovation innovation;
    if (rls_.update(x, output, innovation) != UpdateStatus::kNotFinite) judge(time, output, innovation);
  }
  remember(input, output);
}

void ArxChannel::judge(TimePoint time, double output, const Rls::Innovation& innovation) noexcept {
  settled_ = innovation.largest_change < params_.settled_change ? settled_ + 1 : 0;
  if (rls_.fused() >= params_.arm_after_samples && settled_ >= params_.settled_samples) armed_ = true;  // (3)
  if (armed_ && moments_.variance() > 0) {                                                              // (4)
    const double sigma = moments_.deviation();
    const double expected = innovation.expected + moments_.mean();
    const double test_ratio = std::abs(output - expected) / (sigma * params_.threshold_sigmas);
    if (!judged_since_tick_ || test_ratio > judged_.test_ratio) {
      judged_ = {time, output, expected, sigma, test_ratio};
    }
    judged_since_tick_ = true;
  }
  if (++predicted_ > params_.moments_after_samples) moments_.add(innovation.innovation);
}

void ArxChannel::remember(double input, double output) noexcept {
  std::shift_right(past_outputs_.begin(), past_outputs_.end(), 1);
  std::shift_right(past_inputs_.begin(), past_inputs_.end(), 1);
  past_outputs_[0] = output;
  past_inputs_[0] = input;
  past_count_ = std::min(past_count_ + 1, kMostPastValues);
}

ChannelVerdict ArxChannel::step(TimePoint now, Duration flown, bool muted) noexcept {
  if (muted) restart_history();
  ChannelVerdict verdict;
  verdict.observed = judged_.observed;
  verdict.expected = judged_.expected;
  verdict.sigma = judged_.sigma;
  verdict.onset = magnitude_.onset();
  const bool fresh = judged_since_tick_;
  judged_since_tick_ = false;
  if (!sampled_ || now - last_sample_ > params_.longest_gap) {
    verdict.reason = NotJudged::kInputUnknown;
    return verdict;
  }
  if (!armed_ || judged_.sigma <= 0 || flown < warm_up_ || muted) return verdict;
  verdict.reason = NotJudged::kJudged;
  verdict.test_ratio = judged_.test_ratio;
  verdict.transition = life_cycle_.step(verdict.test_ratio, now);
  if (verdict.transition == Transition::kRaise) magnitude_.begin(judged_.time);
  if (life_cycle_.active() && fresh) magnitude_.add(verdict);
  magnitude_.tell(verdict);
  return verdict;
}

ChannelVerdict ArxChannel::pause(TimePoint now) noexcept {
  restart_history();
  ChannelVerdict verdict;
  verdict.reason = NotJudged::kPaused;
  if (life_cycle_.active()) verdict.transition = life_cycle_.step(1.0, now);
  magnitude_.tell(verdict);
  return verdict;
}

}  // namespace airworthy::response
