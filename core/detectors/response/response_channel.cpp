#include "core/detectors/response/response_channel.h"

namespace airworthy::response {

using Transition = FaultLifeCycle::Transition;

ResponseChannel::ResponseChannel(const ChannelParams& params) noexcept
    : params_{params},
      response_{params.response},
      regression_{params.regression},
      x_{BoundedVector<double, kMostTerms>::Zero(params.term_count)},
      low_{params.cusum},
      high_{params.cusum},
      life_cycle_{params.life_cycle} {
  for (std::size_t i = 0; i < regressors_.size(); ++i) regressors_[i] = Regressor{params.terms[i]};
}

ResponseChannel::Regression::Vector ResponseChannel::read(const SignalFrame& frame, double tick_s,
                                                          double& observed) noexcept {
  observed = response_.step(frame, tick_s);
  auto x = x_;
  for (int i = 0; i < params_.term_count; ++i) {
    const auto term = static_cast<std::size_t>(i);
    x_(i) = x(i) = regressors_[term].step(frame, tick_s);
    if (params_.warm_only[term] && !warm_) x(i) = 0;
  }
  return x;
}

ChannelVerdict ResponseChannel::step(const SignalFrame& frame, double tick_s, TimePoint now, Duration flown,
                                     bool muted) noexcept {
  ChannelVerdict verdict;
  const auto x = read(frame, tick_s, verdict.observed);

  Regression::Prediction prediction;
  const bool frozen = muted || life_cycle_.active();  // what a fault does must not become what is expected
  const UpdateStatus status = frozen ? regression_.predict(x, verdict.observed, prediction)
                                     : regression_.update(x, verdict.observed, prediction);
  if (status == UpdateStatus::kNotFinite) {
    verdict.reason = NotJudged::kInputUnknown;
    verdict.test_ratio = std::max(low_.test_ratio(), high_.test_ratio());
    return verdict;
  }
  verdict.expected = prediction.expected;
  verdict.sigma = std::max(prediction.sigma, params_.least_sigma);
  if (status == UpdateStatus::kConverging || flown < params_.warm_up) return verdict;
  verdict.reason = NotJudged::kJudged;
  for (int i = 0; i < params_.term_count; ++i) {
    if (params_.commanded[static_cast<std::size_t>(i)]) verdict.commanded += regression_.theta()(i) * x(i);
  }
  if (!muted) accumulate(verdict, now);

  const Cusum& worse = low_.test_ratio() >= high_.test_ratio() ? low_ : high_;
  verdict.test_ratio = worse.test_ratio();
  verdict.transition = life_cycle_.step(verdict.test_ratio, now);
  if (verdict.transition == Transition::kRaise) magnitude_.begin(worse.onset());
  if (life_cycle_.active()) magnitude_.add(verdict);
  if (verdict.transition == Transition::kClear) {
    low_.reset();
    high_.reset();
    regression_.drop_unlearned();
  }
  magnitude_.tell(verdict);
  return verdict;
}

ChannelVerdict ResponseChannel::pause(const SignalFrame& frame, double tick_s, TimePoint now) noexcept {
  ChannelVerdict verdict;
  verdict.reason = NotJudged::kPaused;
  const auto x = read(frame, tick_s, verdict.observed);
  if (Regression::Prediction prediction;
      regression_.predict(x, verdict.observed, prediction) == UpdateStatus::kFused) {
    verdict.expected = prediction.expected;
    verdict.sigma = std::max(prediction.sigma, params_.least_sigma);
  }
  regression_.drop_unlearned();
  if (life_cycle_.active()) {
    verdict.test_ratio = std::max(low_.test_ratio(), high_.test_ratio());
    verdict.transition = life_cycle_.step(1.0, now);
  } else {
    low_.reset();
    high_.reset();
  }
  magnitude_.tell(verdict);
  return verdict;
}

bool ResponseChannel::warm_start(const ChannelPrior& prior) noexcept {
  auto theta = Regression::Vector{params_.term_count};
  auto gram = Regression::Matrix{params_.term_count, params_.term_count};
  auto next = prior.gram.begin();
  for (int i = 0; i < params_.term_count; ++i) {
    theta(i) = prior.theta[static_cast<std::size_t>(i)];
    for (int j = 0; j < params_.term_count; ++j) gram(i, j) = *next++;
  }
  if (!(prior.threshold > 0)) return false;
  if (!regression_.warm_start(theta, gram, prior.sigma, prior.worth_samples)) return false;
  params_.evidence.drift_sigmas = params_.warm_drift_sigmas;
  params_.cusum.threshold = prior.threshold;
  low_ = Cusum{params_.cusum};
  high_ = Cusum{params_.cusum};
  return warm_ = true;
}

void ResponseChannel::restart_history() noexcept {
  response_.reset_history();
  for (Regressor& regressor : regressors_) regressor.reset_history();
  regression_.drop_unlearned();
}

void ResponseChannel::accumulate(const ChannelVerdict& verdict, TimePoint now) noexcept {
  const double innovation = verdict.observed - verdict.expected;
  if (params_.evidence.alternative == Alternative::kGainLoss) {
    low_.step(gain_loss_evidence(params_.evidence, innovation, verdict.commanded, verdict.sigma), now);
    return;
  }
  const double z = innovation / verdict.sigma;
  if (params_.side != Side::kHigh) low_.step(shift_evidence(params_.evidence, -z), now);
  if (params_.side != Side::kLow) high_.step(shift_evidence(params_.evidence, z), now);
}

}  // namespace airworthy::response
