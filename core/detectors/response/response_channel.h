#pragma once

#include <array>

#include "core/detectors/cusum.h"
#include "core/detectors/fault_life_cycle.h"
#include "core/detectors/response/channel_prior.h"
#include "core/detectors/response/channel_verdict.h"
#include "core/detectors/response/evidence.h"
#include "core/detectors/response/fault_magnitude.h"
#include "core/detectors/response/regressor.h"
#include "core/estimators/delayed_regression.h"

namespace airworthy::response {

inline constexpr int kMostLearningDelayTicks = 128;

/// Which deviation of the response is a fault.
enum class Side : std::uint8_t { kLow, kHigh, kBoth };

struct ChannelParams {
  Term response;
  int term_count = 0;
  std::array<Term, kMostTerms> terms{};
  std::array<bool, kMostTerms> commanded{};  ///< gain loss: these terms make up the commanded response û
  std::array<bool, kMostTerms> warm_only{};  ///< terms that one flight is too short to tell apart: without a
                                             ///< calibration they count as 0
  Side side = Side::kBoth;                   ///< shift: which deviation is a fault
  EvidenceParams evidence;
  double warm_drift_sigmas = 1.75;  ///< shift: k₀ in place of evidence.drift_sigmas after a warm start
  double least_sigma =
      0.0;  ///< the spread of a prediction is never taken to be less, however quiet the flight
  DelayedRegressionParams regression;
  CusumParams cusum;
  FaultLifeCycleParams life_cycle;
  Duration warm_up{20'000'000};  ///< no verdict before so much flight has been seen
};

/// Expects one measured response from commands and state, and accumulates evidence that it no longer comes.
///   Operating point: docs/detection_matrix.md, rows "response".
class ResponseChannel {
 public:
  explicit ResponseChannel(const ChannelParams& params) noexcept;

  /// One tick. `flown` is the flight time seen so far. With `muted` nothing is learned and no evidence is
  /// gathered.
  ChannelVerdict step(const SignalFrame& frame, double tick_s, TimePoint now, Duration flown,
                      bool muted) noexcept;

  /// One tick of a multirotor that is not in flight, in place of step(). Nothing is learned and no evidence gathered;
  /// what a landing left of either is dropped, so that it does not count in the next flight. What was found stays
  /// found, for nobody looks.
  ChannelVerdict pause(const SignalFrame& frame, double tick_s, TimePoint now) noexcept;

  /// From now on expects, tests and alarms by what earlier flights say, until this flight says more. False
  /// where the prior does not fit the channel or is no prior: nothing changes then.
  [[nodiscard]] bool warm_start(const ChannelPrior& prior) noexcept;

  /// After a gap in the input: delays and unlearned samples are dropped, what was learned stays.
  void restart_history() noexcept;

  [[nodiscard]] bool fault_active() const noexcept { return life_cycle_.active(); }
  [[nodiscard]] bool warm() const noexcept { return warm_; }
  [[nodiscard]] double threshold() const noexcept { return params_.cusum.threshold; }

  /// x of the newest tick, in the order of the terms; NaN where not known.
  [[nodiscard]] const BoundedVector<double, kMostTerms>& regressors() const noexcept { return x_; }

 private:
  using Regression = DelayedRegression<double, kMostTerms, kMostLearningDelayTicks>;

  /// Steps all delays. x of the newest tick, with 0 for terms that count only after a warm start.
  [[nodiscard]] Regression::Vector read(const SignalFrame& frame, double tick_s, double& observed) noexcept;
  void accumulate(const ChannelVerdict& verdict, TimePoint now) noexcept;

  ChannelParams params_;
  Regressor response_;
  std::array<Regressor, kMostTerms> regressors_;
  Regression regression_;
  BoundedVector<double, kMostTerms> x_;
  bool warm_ = false;
  Cusum low_;   ///< evidence of a downward shift, or of a lost gain
  Cusum high_;  ///< evidence of an upward shift
  FaultLifeCycle life_cycle_;
  FaultMagnitude magnitude_;
};

}  // namespace airworthy::response
