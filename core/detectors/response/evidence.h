#pragma once

#include <algorithm>
#include <cstdint>

namespace airworthy::response {

/// What a fault does to a response.
enum class Alternative : std::uint8_t {
  kShift,     ///< moves it by an unknown amount: a thrust that is gone, a rudder that is stuck
  kGainLoss,  ///< leaves less of its commanded part: a control surface that is gone
};

struct EvidenceParams {
  Alternative alternative = Alternative::kShift;
  double clip_sigmas = 4.0;     ///< one residual counts no more than this
  double drift_sigmas = 1.25;   ///< shift: k₀, what a healthy residual may average, in σ
  double remaining_gain = 0.5;  ///< gain loss: γ, the part of the commanded response that is left
  double sigma_inflation =
      1.7;  ///< gain loss: residuals repeat from tick to tick; this widens σ to make up for it
  double most_per_tick = 1.0;  ///< gain loss: no tick adds or takes more evidence than this
};

/// Evidence of one tick that the response shifted upwards (for downwards: give −z).
///   g = clip(z, ±c) − k₀                                                                             (1)
///   Valid for  z = e/s, the normalised innovation; negative in the mean while E[z] < k₀
[[nodiscard]] inline double shift_evidence(const EvidenceParams& params, double z) noexcept {
  return std::clamp(z, -params.clip_sigmas, params.clip_sigmas) - params.drift_sigmas;
}

/// Evidence of one tick that only the part γ of the commanded response is left: the log-likelihood ratio of
/// e ~ N(−(1−γ)û, s′²) against e ~ N(0, s′²), made robust by two clips.
///   v = (1−γ)·û/s′;  g = clip(−v·clip(e/s′, ±c) − v²/2, ±g_max)                                      (2)
///   Symbols    û commanded part of the expected response, e innovation, s′ = sigma_inflation·s
///   Without a command v = 0 and g = 0: no excitation, no evidence, so there is no separate gate.
[[nodiscard]] inline double gain_loss_evidence(const EvidenceParams& params, double innovation,
                                               double commanded, double sigma) noexcept {
  const double s = params.sigma_inflation * sigma;
  const double z = std::clamp(innovation / s, -params.clip_sigmas, params.clip_sigmas);
  const double v = (1.0 - params.remaining_gain) * commanded / s;
  return std::clamp(-v * z - 0.5 * v * v, -params.most_per_tick, params.most_per_tick);
}

}  // namespace airworthy::response
