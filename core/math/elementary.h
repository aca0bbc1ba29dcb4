#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace airworthy {

template <class Scalar>
struct SinCos {
  Scalar sin = 0;
  Scalar cos = 0;
};

/// The elementary functions of core. The library's may differ in the last place from one machine to another, and
/// so may a verdict that follows from them; these use only additions, multiplications, divisions and bits, which
/// IEEE 754 fixes, and give the same bits on x86, arm64 and Cortex-M4 (with -ffp-contract=off, rounding to nearest).
///   Method      Cody and Waite's reduction with the constant split so that the leading products are exact, then the
///               Taylor polynomial, whose first omitted term is below a quarter of a rounding unit at the end of the
///               reduced range:  |r| ≤ ln 2 / 2 (exp),  |s| ≤ 3 − 2√2 (log),  |r| ≤ π/4 (sincos)
///   Error       exp, log < 1.5 ulp; sin, cos < 2.5 ulp where the value exceeds 1e-3, else 2.5 ulp of 1e-3 (float and
///               double; swept against long double in tests/core/math/elementary_test.cpp)
///   Symbols     k, r: x = k·ln 2 + r or k·π/2 + r;  x = 2ᵏ·m, s = (m − 1)/(m + 1)
namespace elementary {

template <class Scalar>
struct Constants;

template <>
struct Constants<double> {
  using Bits = std::uint64_t;
  static constexpr int kMantissaBits = 52;
  static constexpr int kExponentBias = 1023;
  static constexpr double kLn2High = 0x1.62e42fefa3800p-1;  // 42 bits: exact times |k| < 2¹¹
  static constexpr double kLn2Low = 0x1.ef35793c76730p-45;
  static constexpr double kExpLargest = 0x1.62e42fefa39efp+9;    // ln of the largest number
  static constexpr double kExpSmallest = -0x1.74910d52d3051p+9;  // below, the result rounds to 0
  static constexpr double kSinCosLargest = 1e6;  // k < 2²⁰, so that k·kHalfPi[0…2] are exact
  static constexpr double kHalfPi[4] = {0x1.921fb544p+0, 0x1.0b4611a6p-34, 0x1.3198a2ep-69,
                                        0x1.b839a252049c1p-104};
  static constexpr int kExpTerms = 12;
  static constexpr int kLogTerms = 10;
  static constexpr int kSinCosTerms = 8;
};

template <>
struct Constants<float> {
  using Bits = std::uint32_t;
  static constexpr int kMantissaBits = 23;
  static constexpr int kExponentBias = 127;
  static constexpr float kLn2High = 0x1.62e4p-1F;  // 15 bits: exact times |k| < 2⁹
  static constexpr float kLn2Low = 0x1.7f7d1cp-20F;
  static constexpr float kExpLargest = 0x1.62e42ep+6F;
  static constexpr float kExpSmallest = -0x1.9fe368p+6F;
  static constexpr float kSinCosLargest = 6e3F;  // k < 2¹²
  static constexpr float kHalfPi[4] = {0x1.92p+0F, 0x1.fb4p-12F, 0x1.444p-24F, 0x1.68c234p-39F};
  static constexpr int kExpTerms = 7;
  static constexpr int kLogTerms = 4;
  static constexpr int kSinCosTerms = 5;
};

/// 1/(m + first)! with m in steps of `step`, and the signs in turn if `alternates`: coefficients of a Taylor series.
template <class Scalar, int kTerms>
[[nodiscard]] consteval std::array<Scalar, static_cast<std::size_t>(kTerms)> inverse_factorials(
    int first, int step, bool alternates) {
  std::array<Scalar, static_cast<std::size_t>(kTerms)> result{};
  double factorial = 1.0;  // exact up to 18!
  int m = 1;
  for (int n = 0; n < kTerms; ++n) {
    for (; m <= first + n * step; ++m) factorial *= static_cast<double>(m);
    const bool is_negative = alternates && n % 2 == 1;
    result[static_cast<std::size_t>(n)] = static_cast<Scalar>((is_negative ? -1.0 : 1.0) / factorial);
  }
  return result;
}

/// 2/3, 2/5, 2/7, …
template <class Scalar, int kTerms>
[[nodiscard]] consteval std::array<Scalar, static_cast<std::size_t>(kTerms)> log_coefficients() {
  std::array<Scalar, static_cast<std::size_t>(kTerms)> result{};
  for (int n = 0; n < kTerms; ++n) {
    result[static_cast<std::size_t>(n)] = static_cast<Scalar>(2.0 / static_cast<double>(2 * n + 3));
  }
  return result;
}

/// c₀ + c₁·x + c₂·x² + …
template <class Scalar, std::size_t kTerms>
[[nodiscard]] constexpr Scalar polynomial(const std::array<Scalar, kTerms>& c, Scalar x) noexcept {
  Scalar sum = c[kTerms - 1];
  for (std::size_t n = kTerms - 1; n > 0; --n) sum = c[n - 1] + x * sum;
  return sum;
}

/// 2ᵏ for a k whose power is a normal number.
template <class Scalar>
[[nodiscard]] constexpr Scalar power_of_two(int k) noexcept {
  using C = Constants<Scalar>;
  return std::bit_cast<Scalar>(static_cast<typename C::Bits>(k + C::kExponentBias) << C::kMantissaBits);
}

/// The integer nearest to x, for |x| < 2³¹ − 1.
template <class Scalar>
[[nodiscard]] constexpr int nearest(Scalar x) noexcept {
  const Scalar half = static_cast<Scalar>(0.5);
  return static_cast<int>(x < Scalar{0} ? x - half : x + half);
}

}  // namespace elementary

/// eˣ. Infinite above the range, 0 below; NaN gives NaN.
template <class Scalar>
[[nodiscard]] constexpr Scalar exp(Scalar x) noexcept {
  using C = elementary::Constants<Scalar>;
  if (!(x <= C::kExpLargest)) return x + std::numeric_limits<Scalar>::infinity();  // also NaN
  if (x < C::kExpSmallest) return Scalar{0};
  const int k = elementary::nearest(x * static_cast<Scalar>(1.4426950408889634));  // 1/ln 2
  const Scalar r = (x - static_cast<Scalar>(k) * C::kLn2High) - static_cast<Scalar>(k) * C::kLn2Low;
  constexpr auto kSeries = elementary::inverse_factorials<Scalar, C::kExpTerms>(2, 1, false);
  const Scalar power = Scalar{1} + (r + r * r * elementary::polynomial(kSeries, r));
  // In two steps, for 2ᵏ alone may be beyond the normal numbers though the product is not.
  const int half = k / 2;
  return power * elementary::power_of_two<Scalar>(half) * elementary::power_of_two<Scalar>(k - half);
}

/// Natural logarithm. −∞ at 0; NaN below 0 and for NaN.
template <class Scalar>
[[nodiscard]] constexpr Scalar log(Scalar x) noexcept {
  using C = elementary::Constants<Scalar>;
  using Bits = typename C::Bits;
  if (x == Scalar{0}) return -std::numeric_limits<Scalar>::infinity();
  if (!(x > Scalar{0})) return std::numeric_limits<Scalar>::quiet_NaN();
  if (x > std::numeric_limits<Scalar>::max()) return x;
  int k = 0;
  if (x < std::numeric_limits<Scalar>::min()) {
    k = -(C::kMantissaBits + 1);
    x *= elementary::power_of_two<Scalar>(C::kMantissaBits + 1);
  }
  const Bits bits = std::bit_cast<Bits>(x);
  k += static_cast<int>(bits >> C::kMantissaBits) - C::kExponentBias;
  constexpr Bits kFraction = (Bits{1} << C::kMantissaBits) - 1;
  Scalar m =
      std::bit_cast<Scalar>((bits & kFraction) | (static_cast<Bits>(C::kExponentBias) << C::kMantissaBits));
  if (m > static_cast<Scalar>(1.4142135623730951)) {
    m *= static_cast<Scalar>(0.5);
    ++k;
  }
  // ln m = 2s + s·R with R = 2s²/3 + 2s⁴/5 + …; as 2s = f − s·f, it is f − s·(f − R), where f = m − 1 is exact.
  const Scalar f = m - Scalar{1};
  const Scalar s = f / (m + Scalar{1});
  const Scalar s2 = s * s;
  constexpr auto kSeries = elementary::log_coefficients<Scalar, C::kLogTerms>();
  const Scalar series = s2 * elementary::polynomial(kSeries, s2);
  const auto exponent = static_cast<Scalar>(k);
  return exponent * C::kLn2High + (f - (s * (f - series) - exponent * C::kLn2Low));
}

/// Sine and cosine of an angle in rad, |x| ≤ 1e6 (double) or 6e3 (float): beyond, and for NaN, both are NaN. An
/// angle that grows for ever must be wrapped anyhow, or its own rounding is what is left of it.
template <class Scalar>
[[nodiscard]] constexpr SinCos<Scalar> sincos(Scalar x) noexcept {
  using C = elementary::Constants<Scalar>;
  if (!(x >= -C::kSinCosLargest && x <= C::kSinCosLargest)) {
    return {std::numeric_limits<Scalar>::quiet_NaN(), std::numeric_limits<Scalar>::quiet_NaN()};
  }
  const int k = elementary::nearest(x * static_cast<Scalar>(0.63661977236758134));  // 2/π
  Scalar r = x;
  for (const Scalar part : C::kHalfPi) r -= static_cast<Scalar>(k) * part;
  const Scalar r2 = r * r;
  constexpr auto kSine = elementary::inverse_factorials<Scalar, C::kSinCosTerms>(3, 2, true);
  constexpr auto kCosine = elementary::inverse_factorials<Scalar, C::kSinCosTerms>(4, 2, true);
  const Scalar sine = r - r * r2 * elementary::polynomial(kSine, r2);
  const Scalar half_r2 = static_cast<Scalar>(0.5) * r2;
  const Scalar cosine = Scalar{1} - (half_r2 - r2 * r2 * elementary::polynomial(kCosine, r2));
  switch (static_cast<unsigned>(k) % 4U) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

}  // namespace airworthy
