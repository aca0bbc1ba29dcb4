#pragma once

#include <array>

#include "core/detectors/fault_life_cycle.h"
#include "core/detectors/response/channel_verdict.h"
#include "core/detectors/response/fault_magnitude.h"
#include "core/detectors/response/signals.h"
#include "core/estimators/factorised_rls.h"
#include "core/estimators/running_moments.h"

namespace airworthy::response {

inline constexpr int kMostPastValues = 25;

/// What makes a sample of a commanded → measured pair.
enum class Samples : std::uint8_t {
  kEverySetpoint,  ///< every set-point message, with the newest measured attitude, however old or repeated
  kFresh,          ///< every new measured attitude, with the newest set-point
};

struct ArxParams {
  Signal input = Signal::kRollSetpoint;
  Signal output = Signal::kRoll;
  Samples samples = Samples::kFresh;
  int past_outputs = kMostPastValues;  ///< n_a
  int past_inputs = kMostPastValues;   ///< n_b, beside the newest input
  double forgetting = 1.0;             ///< these three as in FactorisedRlsParams
  double prior_variance = 1e6;
  double excitation_floor = 1.0;
  double threshold_sigmas = 4.5;    ///< alarm at |z| of this size
  int arm_after_samples = 200;      ///< armed after so many learned samples ...
  double settled_change = 0.01;     ///< ... once no coefficient changes by so much (ε) at a sample ...
  int settled_samples = 20;         ///< ... nor did at so many before it
  int moments_after_samples = 0;    ///< innovations of the first samples that mean and variance leave out
  Duration longest_gap{2'000'000};  ///< a longer silence restarts the history
};

/// Expects one measured signal from its own past and from what was commanded, learned in flight, and calls a
/// prediction error that is too far from its mean a fault.
///   Model     y_k = Σ aᵢ·y_{k−i} (i = 1…n_a) + Σ bⱼ·u_{k−j} (j = 0…n_b) + e                              (1)
///   Learning  recursive least squares, core/estimators/factorised_rls.h                                 (2)
///   Armed     for good, after arm_after_samples samples and once ‖K·e‖∞ < ε has held for settled_samples (3)
///   Test      z = (e − mean e)/deviation e, moments over all earlier samples; alarm at |z| ≥ threshold   (4)
///   Source    Keipour, Mousaei, Scherer, Automatic Real-time Anomaly Detection for Autonomous Aerial
///             Vehicles (2019), as told in the project's design; the paper itself was not at hand
///   Symbols   n_a past_outputs, n_b past_inputs, ε settled_change
///   Deviations  the verdict of a sample comes with the next tick, at most a tick period later; the paper
///             says neither when an alarm ends nor what "stays under ε" is long: see life cycle,
///             settled_samples
///   Valid for samples at an even rate; their spacing does not enter
/// Kept for comparison; config/response_arx.toml says what it costs.
class ArxChannel {
 public:
  ArxChannel(const ArxParams& params, const FaultLifeCycleParams& life_cycle, Duration warm_up) noexcept;

  /// One sample of the pair. Not finite, or not newer than the last: refused, nothing changes.
  void sample(TimePoint time, double input, double output) noexcept;

  /// One tick: the verdict on the worst sample since the last tick, or on the newest one again. `flown` is
  /// the flight time seen so far. With `muted` there is no evidence, and the history starts anew.
  ChannelVerdict step(TimePoint now, Duration flown, bool muted) noexcept;

  /// One tick of a multirotor that is not in flight, in place of step(): no evidence, the history starts anew, and what
  /// was found stays found.
  ChannelVerdict pause(TimePoint now) noexcept;

  /// After a gap in the input: past values and what is not yet judged are dropped, what was learned stays.
  void restart_history() noexcept {
    past_count_ = 0;
    judged_ = {};
    judged_since_tick_ = false;
  }

  [[nodiscard]] const ArxParams& params() const noexcept { return params_; }
  [[nodiscard]] bool fault_active() const noexcept { return life_cycle_.active(); }

 private:
  using Rls = FactorisedRls<double, 2 * kMostPastValues + 1>;

  struct Judged {
    TimePoint time;
    double observed = 0;
    double expected = 0;
    double sigma = 0;
    double test_ratio = 0;
  };

  void judge(TimePoint time, double output, const Rls::Innovation& innovation) noexcept;
  void remember(double input, double output) noexcept;

  ArxParams params_;
  Duration warm_up_;
  Rls rls_;
  RunningMoments moments_;
  FaultLifeCycle life_cycle_;
  std::array<double, kMostPastValues> past_outputs_{};  ///< newest first
  std::array<double, kMostPastValues> past_inputs_{};
  int past_count_ = 0;
  bool sampled_ = false;
  TimePoint last_sample_;
  std::int64_t predicted_ = 0;
  int settled_ = 0;
  bool armed_ = false;
  Judged judged_;  ///< the newest sample, or a worse one since the last tick
  bool judged_since_tick_ = false;
  FaultMagnitude magnitude_;
};

}  // namespace airworthy::response
