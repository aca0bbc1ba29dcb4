#pragma once

#include <optional>

#include "core/detectors/fault_life_cycle.h"
#include "core/time/time.h"

namespace airworthy::actuator {

struct LossPolicyParams {
  double loss = 0.12;             ///< γ beyond this is a fault ...
  double probability = 0.97;      ///< ... when it is so with this probability ...
  Duration persistence{150'000};  ///< ... for so long
  FaultLifeCycleParams life_cycle{.clear_ratio = 0.5, .clear_after = Duration{5'000'000}, .latched = true};
};

/// Turns γ ± σ into the life of a fault.
///   P(γ > t) = ½·(1 + erf((γ − t)/(σ·√2)))                                                           (1)
/// Raised when (1) reaches `probability` for `persistence`; cleared when it stays below clear_ratio of that. The onset is
/// the last moment at which the loss was no more probable than not.
class LossPolicy {
 public:
  explicit LossPolicy(const LossPolicyParams& params) noexcept : params_{params}, life_{params.life_cycle} {}

  /// `may_raise` false: no new fault, an active one goes on.
  FaultLifeCycle::Transition step(double gamma, double sigma, bool may_raise, TimePoint now) noexcept;

  /// Time in which nothing was judged counts for nothing.
  void pause(TimePoint now) noexcept;

  /// For the next flight, after one may have repaired it: a latched fault is ready to be raised again. One that can clear
  /// stays active until it does.
  void rearm() noexcept {
    if (params_.life_cycle.latched) life_ = FaultLifeCycle{params_.life_cycle};
  }

  [[nodiscard]] double probability() const noexcept { return probability_; }
  [[nodiscard]] bool active() const noexcept { return life_.active(); }
  [[nodiscard]] TimePoint onset() const noexcept { return onset_; }

  static double exceedance(double gamma, double sigma, double threshold) noexcept;

 private:
  LossPolicyParams params_;
  FaultLifeCycle life_;
  double probability_ = 0.0;
  bool has_time_ = false;
  TimePoint likely_since_{};
  std::optional<TimePoint> certain_since_;
  TimePoint onset_{};
};

}  // namespace airworthy::actuator
