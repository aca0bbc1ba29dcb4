#pragma once

#include <cmath>

namespace airworthy {

/// A complex number of core, which has no <complex>: plain arithmetic with the same bits on every machine.
template <class Scalar>
struct Phasor {
  Scalar re = 0;
  Scalar im = 0;

  [[nodiscard]] Scalar squared() const noexcept { return re * re + im * im; }
  [[nodiscard]] Scalar magnitude() const noexcept { return std::sqrt(squared()); }

  friend Phasor operator+(Phasor a, Phasor b) noexcept { return {a.re + b.re, a.im + b.im}; }
  friend Phasor operator-(Phasor a, Phasor b) noexcept { return {a.re - b.re, a.im - b.im}; }
  friend Phasor operator*(Scalar k, Phasor a) noexcept { return {k * a.re, k * a.im}; }
  friend Phasor operator*(Phasor a, Phasor b) noexcept {
    return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
  }
  friend Phasor operator/(Phasor a, Phasor b) noexcept {
    const Scalar scale = Scalar{1} / b.squared();
    return {scale * (a.re * b.re + a.im * b.im), scale * (a.im * b.re - a.re * b.im)};
  }
};

}  // namespace airworthy
