#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/estimators/effectiveness/disturbed_axis.h"
#include "core/time/time.h"
#include "core/vehicle/multirotor.h"

namespace airworthy {

/// What one inertial sample says, and what each rotor contributes to it.
template <class Scalar, std::size_t kMost = kMaxRotors>
struct MotionSample {
  TimePoint time{};
  std::array<AxisInnovation<Scalar>, 2> rate;  ///< p, q
  AxisInnovation<Scalar> vertical;             ///< a_z
  /// Accelerations of rotor i as the model has them: ṗ, q̇ in rad/s², a_z in m/s².
  std::array<std::array<Scalar, 3>, kMost> contribution{};
};

/// Which losses one bank of hypotheses looks for, as a share of the rotor's thrust; negative: gains.
template <class Scalar>
struct LossRange {
  Scalar least;
  Scalar most;
  Scalar memory_s;  ///< evidence fades with this time constant
};

template <class Scalar>
struct RotorLossParams {
  Scalar threshold = 30;                   ///< h, nats
  Scalar margin = 8;                       ///< over the best hypothesis about another rotor, nats
  Scalar unexplained = 8;                  ///< what one rotor may leave unexplained, nats ...
  Scalar unexplained_ratio = Scalar(0.2);  ///< ... or as a share of all that is to be explained
  Scalar fruitless_s = Scalar(0.5);        ///< a sum that has so little to say after so long starts anew
  Scalar gain_odds = -10;                  ///< π of a gain, nats: no propeller grows in flight
  Scalar return_odds = 8;  ///< π of what was lost and comes back: likelier than a loss of another rotor
  Scalar varying_ratio = Scalar(0.5);  ///< of the evidence may come from changes of the rotor's speed alone
};

/// The threshold at which N·M cumulative sums of a likelihood ratio alarm falsely at most so often: each one's
/// mean time between false alarms is at least eʰ samples.
///   h = ln(N·M·samples per hour / false alarms per hour)
template <class Scalar>
[[nodiscard]] Scalar loss_threshold(Scalar false_alarms_per_hour, Scalar samples_per_s,
                                    std::size_t sums) noexcept {
  return std::log(static_cast<Scalar>(sums) * samples_per_s * Scalar{3600} / false_alarms_per_hour);
}

/// Generalised likelihood ratio over "rotor i has lost the share s of its thrust since t₀".
///   Signature     hᵢ: what the innovations e would hold if s were 1 since t₀ (RateAxis, ForceAxis)
///   Ratio         aᵢ = Σ hᵢ·e/S, bᵢ = Σ hᵢ²/S over axes and samples since t₀;  ℓᵢ(s) = s·aᵢ − s²·bᵢ/2            (1)
///   Size          ŝᵢ = aᵢ/bᵢ within the range of the bank, variance 1/bᵢ;  ℓᵢ = ℓᵢ(ŝᵢ); once i is named, from the range
///                 with the greatest ℓᵢ                                                                    (2)
///   Reset         t₀ ← now where ℓᵢ(s_least) ≤ 0, as in Page's cumulative sum; and where ℓᵢ is below the margin after
///                 half a second: by then the disturbance has taken the place of what began at t₀, hᵢ has faded, and
///                 a sum that goes on would be blind to what begins now                                      (3)
///   Something else  any acceleration of p, q and a_z at once since t₀:  ℓ₀ = Σ_axes a²/(2b)                     (4)
///   Decision      ℓᵢ ≥ h, (ℓᵢ + πᵢ) − (ℓⱼ + πⱼ) ≥ margin for every other rotor j, and ℓ₀ − ℓᵢ within what is allowed.
///                 π is the log of the odds before any evidence: of a loss 0, of a gain and of a return as given  (5)
///   Lasting       ℓ₀ − ℓᵢ ≥ −ℓᵢ/2: a loss is a lasting change, not the rotor's own ups and downs           (6)
///   Source        [Page1954], [Willsky1976]; derived in docs/equations/effectiveness.md
///   Deviations    t₀ by (3) instead of a search over all t₀: one sum for each rotor and range
/// Cost: 60 flops for each rotor and range; no heap.
template <class Scalar, std::size_t kMost = kMaxRotors, std::size_t kRanges = 2>
class RotorLossTest {
 public:
  struct Finding {
    std::size_t rotor = 0;
    std::size_t range = 0;
    Scalar loss = 0;           ///< ŝ
    Scalar loss_variance = 0;  ///< 1/b
    Scalar evidence = 0;       ///< ℓᵢ, nats
    Scalar second = 0;         ///< best ℓⱼ of another rotor
    Scalar unexplained = 0;    ///< ℓ₀ − ℓᵢ
    TimePoint onset{};
    /// What the null model has made of ŝ: to be taken back once the fault is believed.
    std::array<Scalar, 2> rate_shift{};
    std::array<Scalar, 3> disturbance_shift{};
  };

  RotorLossTest(std::size_t rotor_count, const RotorLossParams<Scalar>& params,
                const std::array<LossRange<Scalar>, kRanges>& ranges) noexcept
      : n_{rotor_count}, params_{params}, ranges_{ranges} {}

  void reset() noexcept { windows_ = {}; }

  /// Rotor i has lost something: a gain of up to this share of what is left gives it back.
  void may_return(std::size_t rotor, Scalar most_share) noexcept { most_return_[rotor] = most_share; }

  void step(const MotionSample<Scalar, kMost>& sample) noexcept {
    for (std::size_t r = 0; r < kRanges; ++r) {
      for (std::size_t i = 0; i < n_; ++i) accumulate(windows_[r][i], sample, i, ranges_[r]);
    }
  }

  /// The rotor that (5) names now.
  [[nodiscard]] std::optional<Finding> finding() const noexcept {
    for (std::size_t r = 0; r < kRanges; ++r) {
      const Finding best = leading(r);
      // A true loss shows as a lasting change of the body's acceleration. What fits only with the ups and downs of the
      // rotor's own speed is an error of the model while it manoeuvres.
      const bool lasts = best.unexplained >= -params_.varying_ratio * best.evidence;
      const bool decided = best.evidence >= params_.threshold &&
                           best.evidence - best.second >= params_.margin &&
                           best.unexplained <= allowed(best.evidence + best.unexplained) && lasts;
      if (decided) return sized(best);
    }
    return std::nullopt;
  }

  /// The rotor with most evidence in one range, decided or not.
  [[nodiscard]] Finding leading(std::size_t range) const noexcept {
    Finding best;
    best.range = range;
    for (std::size_t i = 0; i < n_; ++i) {
      if (windows_[range][i].evidence <= best.evidence) continue;
      best.rotor = i;
      best.evidence = windows_[range][i].evidence;
    }
    for (std::size_t r = 0; r < kRanges; ++r) {
      for (std::size_t i = 0; i < n_; ++i) {
        if (i == best.rotor) continue;
        best.second =
            std::max(best.second, windows_[r][i].evidence + prior_odds(r, i) - prior_odds(range, best.rotor));
      }
    }
    const Window& window = windows_[range][best.rotor];
    best.second = std::max(best.second, Scalar{0});
    best.unexplained = window.everything - window.evidence;
    best.onset = window.onset;
    read_size(window, best);
    return best;
  }

  /// ℓᵢ of one rotor.
  [[nodiscard]] Scalar evidence(std::size_t range, std::size_t rotor) const noexcept {
    return windows_[range][rotor].evidence;
  }

  /// Strong evidence that no single rotor explains: how often.
  [[nodiscard]] std::int64_t unexplained_disturbances() const noexcept { return unexplained_; }
  [[nodiscard]] Scalar threshold() const noexcept { return params_.threshold; }

 private:
  struct Window {
    bool open = false;
    TimePoint onset{};
    std::array<typename RateAxis<Scalar>::Signature, 2> rate{};
    typename ForceAxis<Scalar>::Signature vertical{};
    std::array<typename RateAxis<Scalar>::Signature, 2> free_rate{};
    typename ForceAxis<Scalar>::Signature free_vertical{};
    Scalar a = 0;
    Scalar b = 0;
    std::array<Scalar, 3> free_a{};
    std::array<Scalar, 3> free_b{};
    Scalar loss = 0;
    Scalar evidence = 0;    ///< ℓᵢ
    Scalar everything = 0;  ///< ℓ₀
  };

  /// π
  [[nodiscard]] Scalar prior_odds(std::size_t range, std::size_t rotor) const noexcept {
    if (ranges_[range].most > Scalar{0}) return Scalar{0};
    return -windows_[range][rotor].loss < most_return_[rotor] ? params_.return_odds : params_.gain_odds;
  }

  static void read_size(const Window& window, Finding& finding) noexcept {
    finding.loss = window.loss;
    finding.loss_variance = window.b > Scalar{0} ? Scalar{1} / window.b : Scalar{1};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      finding.rate_shift[axis] = window.loss * window.rate[axis].rate;
      finding.disturbance_shift[axis] = window.loss * window.rate[axis].disturbance;
    }
    finding.disturbance_shift[2] = window.loss * window.vertical.disturbance;
  }

  /// A quick decision comes from a range that knows great losses alone: the size is read where most is explained.
  [[nodiscard]] Finding sized(Finding finding) const noexcept {
    Scalar most = finding.evidence;
    for (std::size_t r = 0; r < kRanges; ++r) {
      const Window& window = windows_[r][finding.rotor];
      if (!(window.evidence > most) || (window.loss > Scalar{0}) != (finding.loss > Scalar{0})) continue;
      most = window.evidence;
      read_size(window, finding);
    }
    return finding;
  }

  [[nodiscard]] Scalar allowed(Scalar everything) const noexcept {
    return std::max(params_.unexplained, params_.unexplained_ratio * everything);
  }

  void accumulate(Window& window, const MotionSample<Scalar, kMost>& sample, std::size_t i,
                  const LossRange<Scalar>& range) noexcept {
    if (!window.open) {
      window = Window{};
      window.open = true;
      window.onset = sample.time;
    }
    const Scalar keep = Scalar{1} - sample.vertical.dt_s / range.memory_s;
    window.a *= keep;
    window.b *= keep;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const AxisInnovation<Scalar>& seen = axis < 2 ? sample.rate[axis] : sample.vertical;
      const Scalar f = -sample.contribution[i][axis];  // what is missing
      const Scalar h = axis < 2 ? window.rate[axis].step(seen, f) : window.vertical.step(seen, f);
      const Scalar free = axis < 2 ? window.free_rate[axis].step(seen, Scalar{1})
                                   : window.free_vertical.step(seen, Scalar{1});
      window.a += h * seen.innovation / seen.variance;  // (1)
      window.b += h * h / seen.variance;
      window.free_a[axis] = keep * window.free_a[axis] + free * seen.innovation / seen.variance;
      window.free_b[axis] = keep * window.free_b[axis] + free * free / seen.variance;
    }
    judge(window, range, sample.time);
  }

  void judge(Window& window, const LossRange<Scalar>& range, TimePoint now) noexcept {
    const auto ratio = [&window](Scalar s) { return s * window.a - s * s * window.b / Scalar{2}; };
    if (!(window.b > Scalar{0})) return;
    if (!(ratio(range.least) > Scalar{0})) {  // (3)
      window = Window{};
      return;
    }
    window.loss = std::clamp(window.a / window.b, std::min(range.least, range.most),
                             std::max(range.least, range.most));  // (2)
    window.evidence = ratio(window.loss);
    window.everything = Scalar{0};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (window.free_b[axis] > Scalar{0})
        window.everything +=
            window.free_a[axis] * window.free_a[axis] / (Scalar{2} * window.free_b[axis]);  // (4)
    }
    const bool is_fruitless = to_seconds(now - window.onset) > params_.fruitless_s;
    if (is_fruitless && window.evidence < params_.margin) {  // (3)
      window = Window{};
      return;
    }
    const Scalar left = window.everything - window.evidence;
    if (window.everything > params_.threshold && left > Scalar{2} * allowed(window.everything)) {
      ++unexplained_;
      window = Window{};
    }
  }

  std::size_t n_;
  RotorLossParams<Scalar> params_;
  std::array<LossRange<Scalar>, kRanges> ranges_;
  std::array<std::array<Window, kMost>, kRanges> windows_{};
  std::array<Scalar, kMost> most_return_{};
  std::int64_t unexplained_ = 0;
};

}  // namespace airworthy
