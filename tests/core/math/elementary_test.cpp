#include "core/math/elementary.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <type_traits>

namespace airworthy {
namespace {

template <class Scalar>
class Elementary : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Elementary, Scalars);

constexpr long double kPi = 3.141592653589793238462643383279502884L;

/// One unit in the last place of Scalar at `value`, no smaller than at `floor` or than the smallest number.
template <class Scalar>
long double ulp(long double value, long double floor) {
  const int exponent = std::ilogb(std::max(std::abs(value), floor));
  const int smallest = std::numeric_limits<Scalar>::min_exponent - 1;
  return std::ldexp(1.0L, std::max(exponent, smallest) - (std::numeric_limits<Scalar>::digits - 1));
}

/// Largest error in ulp of `ours` against `exact` over `values`.
template <class Scalar, class Ours, class Exact, class Next>
long double worst(int count, Next next, Ours ours, Exact exact, long double floor = 0.0L) {
  long double largest = 0.0L;
  for (int i = 0; i < count; ++i) {
    const Scalar x = next(i);
    const long double truth = exact(static_cast<long double>(x));
    const long double error = std::abs(static_cast<long double>(ours(x)) - truth) / ulp<Scalar>(truth, floor);
    largest = std::isnan(error) ? std::numeric_limits<long double>::infinity() : std::max(largest, error);
  }
  return largest;
}

template <class Scalar>
auto uniform(std::mt19937_64& random, double low, double high) {
  return [&random, draw = std::uniform_real_distribution<double>{low, high}](int) mutable {
    return static_cast<Scalar>(draw(random));
  };
}

constexpr int kCount = 400'000;

TYPED_TEST(Elementary, ExpIsWithinItsBoundOverTheWholeRange) {
  std::mt19937_64 random{1};
  const bool is_float = std::is_same_v<TypeParam, float>;
  const auto ours = [](TypeParam x) { return exp(x); };
  const auto exact = [](long double x) { return std::exp(x); };
  EXPECT_LT(worst<TypeParam>(kCount, uniform<TypeParam>(random, -1.0, 1.0), ours, exact), 1.5L);
  EXPECT_LT(worst<TypeParam>(kCount,
                             uniform<TypeParam>(random, is_float ? -103.0 : -745.0, is_float ? 88.7 : 709.7),
                             ours, exact),
            1.5L);
  // Across the switches of k, at odd multiples of ln 2 / 2.
  const auto near_switch = [](int i) {
    const int step = i / 200 - 50;
    return static_cast<TypeParam>((2.0 * (i % 200 - 100) + 1.0) * 0.34657359027997264 + step * 1e-7);
  };
  EXPECT_LT(worst<TypeParam>(20'000, near_switch, ours, exact), 1.5L);
}

TYPED_TEST(Elementary, ExpAtItsEnds) {
  using Limits = std::numeric_limits<TypeParam>;
  EXPECT_EQ(exp(TypeParam{0}), TypeParam{1});
  EXPECT_EQ(exp(Limits::infinity()), Limits::infinity());
  EXPECT_EQ(exp(-Limits::infinity()), TypeParam{0});
  EXPECT_TRUE(std::isnan(exp(Limits::quiet_NaN())));
  const TypeParam largest = std::log(Limits::max());
  EXPECT_TRUE(std::isfinite(exp(std::nextafter(largest, TypeParam{0}))));
  EXPECT_EQ(exp(std::nextafter(std::nextafter(largest, Limits::max()), Limits::max())), Limits::infinity());
  EXPECT_EQ(exp(TypeParam{-1000}), TypeParam{0});
}

TYPED_TEST(Elementary, LogIsWithinItsBoundFromTheSmallestNumberToTheLargest) {
  std::mt19937_64 random{2};
  const auto ours = [](TypeParam x) { return log(x); };
  const auto exact = [](long double x) { return std::log(x); };
  EXPECT_LT(worst<TypeParam>(kCount, uniform<TypeParam>(random, 0.5, 2.0), ours, exact), 1.5L);
  const int lowest = std::numeric_limits<TypeParam>::min_exponent - std::numeric_limits<TypeParam>::digits;
  const int highest = std::numeric_limits<TypeParam>::max_exponent - 1;
  const auto any = [&](int i) {
    const double mantissa = std::uniform_real_distribution<double>{1.0, 2.0}(random);
    return std::ldexp(static_cast<TypeParam>(mantissa), lowest + i % (highest - lowest));
  };
  EXPECT_LT(worst<TypeParam>(kCount, any, ours, exact), 1.5L);
  // Close to 1, where the logarithm is small and its relative error is easily lost.
  const auto near_one = [](int i) {
    return TypeParam{1} + static_cast<TypeParam>(i - 500) * std::numeric_limits<TypeParam>::epsilon();
  };
  EXPECT_LT(worst<TypeParam>(1000, near_one, ours, exact), 1.5L);
}

TYPED_TEST(Elementary, LogAtItsEnds) {
  using Limits = std::numeric_limits<TypeParam>;
  EXPECT_EQ(log(TypeParam{1}), TypeParam{0});
  EXPECT_EQ(log(TypeParam{0}), -Limits::infinity());
  EXPECT_EQ(log(Limits::infinity()), Limits::infinity());
  EXPECT_TRUE(std::isnan(log(TypeParam{-1})));
  EXPECT_TRUE(std::isnan(log(Limits::quiet_NaN())));
}

TYPED_TEST(Elementary, SineAndCosineAreWithinTheirBoundOverTheWholeRange) {
  std::mt19937_64 random{3};
  const auto sine = [](TypeParam x) { return sincos(x).sin; };
  const auto cosine = [](TypeParam x) { return sincos(x).cos; };
  const auto exact_sine = [](long double x) { return std::sin(x); };
  const auto exact_cosine = [](long double x) { return std::cos(x); };
  const double largest = std::is_same_v<TypeParam, float> ? 6e3 : 1e6;
  for (const double range : {1.0, 10.0, largest}) {
    EXPECT_LT(worst<TypeParam>(kCount, uniform<TypeParam>(random, -range, range), sine, exact_sine, 1e-3L),
              2.5L);
    EXPECT_LT(
        worst<TypeParam>(kCount, uniform<TypeParam>(random, -range, range), cosine, exact_cosine, 1e-3L),
        2.5L);
  }
  // At the multiples of π/4, where the quadrant changes and where a value is nearly 0.
  const auto near_switch = [&](int i) {
    const int eighth = i / 20 - 1900;
    const auto turn = static_cast<TypeParam>(eighth * kPi / 4.0L);
    return turn + static_cast<TypeParam>(i % 20 - 10) * std::numeric_limits<TypeParam>::epsilon() * turn;
  };
  EXPECT_LT(worst<TypeParam>(76'000, near_switch, sine, exact_sine, 1e-3L), 2.5L);
  EXPECT_LT(worst<TypeParam>(76'000, near_switch, cosine, exact_cosine, 1e-3L), 2.5L);
}

TYPED_TEST(Elementary, SineAndCosineOfWhatHasNoneAreNaN) {
  using Limits = std::numeric_limits<TypeParam>;
  for (const TypeParam x : {Limits::infinity(), -Limits::infinity(), Limits::quiet_NaN(), TypeParam{2e6}}) {
    EXPECT_TRUE(std::isnan(sincos(x).sin));
    EXPECT_TRUE(std::isnan(sincos(x).cos));
  }
  EXPECT_EQ(sincos(TypeParam{0}).sin, TypeParam{0});
  EXPECT_EQ(sincos(TypeParam{0}).cos, TypeParam{1});
}

// The compiler evaluates constants as IEEE 754 says; a machine or an option that computes otherwise is found.
TYPED_TEST(Elementary, TheMachineGivesTheBitsOfTheCompiler) {
  constexpr TypeParam kExp = exp(TypeParam{1});
  constexpr TypeParam kLog = log(TypeParam{10});
  constexpr SinCos<TypeParam> kSinCos = sincos(TypeParam{1});
  volatile TypeParam one = TypeParam{1};
  volatile TypeParam ten = TypeParam{10};
  EXPECT_EQ(exp(TypeParam{one}), kExp);
  EXPECT_EQ(log(TypeParam{ten}), kLog);
  EXPECT_EQ(sincos(TypeParam{one}).sin, kSinCos.sin);
  EXPECT_EQ(sincos(TypeParam{one}).cos, kSinCos.cos);
}

}  // namespace
}  // namespace airworthy
