#pragma once

namespace airworthy {

/// Second-order low-pass that delays all inputs of an estimator alike.
///   Model    y″ = ωn²·(u − y) − 2ζωn·y′                                                                  (1)
///   Update   trapezoidal rule over Δt with h = Δt/2, so that samples may be irregular:
///            v⁺ = [v·(1 − 2ζωn·h − ωn²·h²) + ωn²·h·(u + u⁻ − 2y)] / (1 + 2ζωn·h + ωn²·h²)
///            y⁺ = y + h·(v + v⁺)                                                                         (2)
///   Source   (1) is the input filter of [Strack2023]; (2) derived in docs/equations/effectiveness.md
///   Symbols  y → value_, v = y′ → rate_, u⁻ → input_
///   Valid for any Δt > 0 (the rule is A-stable); a ramp is delayed by 2ζ/ωn
template <class Scalar>
class SecondOrderLowpass {
 public:
  SecondOrderLowpass() noexcept = default;
  SecondOrderLowpass(Scalar natural_frequency_rad_s, Scalar damping_ratio) noexcept
      : frequency_{natural_frequency_rad_s}, damping_{damping_ratio} {}

  /// In equilibrium at `input`.
  void start(Scalar input) noexcept {
    input_ = value_ = input;
    rate_ = Scalar{0};
  }

  Scalar step(Scalar input, Scalar dt_s) noexcept {
    const Scalar h = dt_s / Scalar{2};
    const Scalar stiffness = frequency_ * frequency_ * h;
    const Scalar drag = Scalar{2} * damping_ * frequency_ * h;
    const Scalar rate =
        (rate_ * (Scalar{1} - drag - stiffness * h) + stiffness * (input + input_ - Scalar{2} * value_)) /
        (Scalar{1} + drag + stiffness * h);  // (2)
    value_ += h * (rate_ + rate);
    rate_ = rate;
    input_ = input;
    return value_;
  }

  [[nodiscard]] Scalar value() const noexcept { return value_; }

 private:
  Scalar frequency_ = 1;
  Scalar damping_ = 1;
  Scalar value_ = 0;
  Scalar rate_ = 0;
  Scalar input_ = 0;
};

}  // namespace airworthy
