#pragma once

#include <algorithm>
#include <cmath>

namespace airworthy {

/// One measured quantity of an axis, predicted and compared.
template <class Scalar>
struct AxisInnovation {
  Scalar innovation = 0;        ///< e
  Scalar variance = 1;          ///< S
  Scalar gain = 0;              ///< of the measured state, K₁
  Scalar disturbance_gain = 0;  ///< of the disturbance, K₂
  Scalar dt_s = 0;
};

/// Adapts the variance of a measurement from its innovations, clipped so that a fault teaches little.
///   R ← R + Δt/T·(min(e², 9·S) − S),  R_min ≤ R ≤ R_max                                                 (1)
/// What is no number teaches nothing.
template <class Scalar>
struct AdaptiveVariance {
  Scalar value = 1;
  Scalar least = 0;
  Scalar most = 0;
  Scalar time_s = 2;

  void step(Scalar innovation, Scalar variance, Scalar dt_s) noexcept {
    if (!std::isfinite(innovation) || !std::isfinite(variance)) return;
    const Scalar clipped = std::min(innovation * innovation, Scalar{9} * variance);
    value = std::clamp(value + dt_s / time_s * (clipped - variance), least, most);  // (1)
  }
};

/// Body rate under a known acceleration u and an unknown one d that wanders.
///   Model      ρ̇ = u + d + w₁,  ḋ = w₂;  gyro = ρ + v;  w₁, w₂ white with densities q₁, q₂, v ~ N(0, R)         (1)
///   Update     Kalman filter of two states, P⁻ = F·P·Fᵀ + diag(q₁, q₂)·Δt, F = [1 Δt; 0 1]                  (2)
///   Signature  what an unmodelled acceleration f leaves in later innovations:
///              δρ⁻ = δρ + Δt·(δd + f), h = δρ⁻, δ ← δ⁻ − K·h                                          (3)
///   Source     derived in docs/equations/effectiveness.md
///   Symbols    ρ → rate_, d → disturbance_, P → p11_, p12_, p22_
///   Valid for  Δt in (0, 0.05 s]; 25 flops, no heap
template <class Scalar>
class RateAxis {
 public:
  struct Noise {
    Scalar acceleration_density;  ///< q₁, (rad/s²)²/Hz
    Scalar disturbance_density;   ///< q₂, (rad/s²)²/s
  };
  struct Signature {
    Scalar rate = 0;
    Scalar disturbance = 0;

    /// (3): the trace of f in this innovation.
    Scalar step(const AxisInnovation<Scalar>& axis, Scalar f) noexcept {
      const Scalar h = rate + axis.dt_s * (disturbance + f);
      rate = h - axis.gain * h;
      disturbance -= axis.disturbance_gain * h;
      return h;
    }
  };

  void start(Scalar gyro_rad_s, Scalar rate_variance, Scalar disturbance_variance) noexcept {
    rate_ = gyro_rad_s;
    disturbance_ = 0;
    p11_ = rate_variance;
    p12_ = 0;
    p22_ = disturbance_variance;
  }
  /// After a gap: what the disturbance was is still known.
  void resume(Scalar gyro_rad_s, Scalar rate_variance) noexcept {
    rate_ = gyro_rad_s;
    p11_ = rate_variance;
    p12_ = 0;
  }

  [[nodiscard]] AxisInnovation<Scalar> step(Scalar dt_s, Scalar u_rad_s2, Scalar gyro_rad_s,
                                            const Noise& noise, Scalar measurement_variance) noexcept {
    rate_ += dt_s * (u_rad_s2 + disturbance_);
    p11_ += dt_s * (Scalar{2} * p12_ + dt_s * p22_ + noise.acceleration_density);  // (2)
    p12_ += dt_s * p22_;
    p22_ += dt_s * noise.disturbance_density;
    AxisInnovation<Scalar> axis;
    axis.innovation = gyro_rad_s - rate_;
    axis.variance = p11_ + measurement_variance;
    axis.gain = p11_ / axis.variance;
    axis.disturbance_gain = p12_ / axis.variance;
    axis.dt_s = dt_s;
    rate_ += axis.gain * axis.innovation;
    disturbance_ += axis.disturbance_gain * axis.innovation;
    p22_ -= axis.disturbance_gain * p12_;
    p11_ = measurement_variance * axis.gain;
    p12_ = measurement_variance * axis.disturbance_gain;
    return axis;
  }

  /// Takes back what the filter made of an acceleration that is now explained otherwise.
  void shift(Scalar rate_rad_s, Scalar disturbance_rad_s2) noexcept {
    rate_ += rate_rad_s;
    disturbance_ += disturbance_rad_s2;
  }

  [[nodiscard]] Scalar rate() const noexcept { return rate_; }
  [[nodiscard]] Scalar disturbance() const noexcept { return disturbance_; }
  [[nodiscard]] Scalar disturbance_variance() const noexcept { return p22_; }

 private:
  Scalar rate_ = 0;
  Scalar disturbance_ = 0;
  Scalar p11_ = 0;
  Scalar p12_ = 0;
  Scalar p22_ = 0;
};

/// Specific force along an axis: known u plus an unknown d that wanders.
///   Model      a = u + d + v,  ḋ = w;  w white with density q, v ~ N(0, R)                                  (1)
///   Signature  h = δd + f,  δd ← δd − K·h                                                              (2)
template <class Scalar>
class ForceAxis {
 public:
  struct Signature {
    Scalar disturbance = 0;

    Scalar step(const AxisInnovation<Scalar>& axis, Scalar f) noexcept {  // (2)
      const Scalar h = disturbance + f;
      disturbance -= axis.disturbance_gain * h;
      return h;
    }
  };

  void start(Scalar disturbance_variance) noexcept {
    disturbance_ = 0;
    p_ = disturbance_variance;
  }

  [[nodiscard]] AxisInnovation<Scalar> step(Scalar dt_s, Scalar u_m_s2, Scalar accel_m_s2, Scalar density,
                                            Scalar measurement_variance) noexcept {
    p_ += dt_s * density;
    AxisInnovation<Scalar> axis;
    axis.innovation = accel_m_s2 - u_m_s2 - disturbance_;
    axis.variance = p_ + measurement_variance;
    axis.disturbance_gain = p_ / axis.variance;
    axis.dt_s = dt_s;
    disturbance_ += axis.disturbance_gain * axis.innovation;
    p_ = measurement_variance * axis.disturbance_gain;
    return axis;
  }

  void shift(Scalar disturbance_m_s2) noexcept { disturbance_ += disturbance_m_s2; }
  [[nodiscard]] Scalar disturbance() const noexcept { return disturbance_; }

 private:
  Scalar disturbance_ = 0;
  Scalar p_ = 0;
};

}  // namespace airworthy
