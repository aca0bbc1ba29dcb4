#include "core/estimators/unbalance/sensor_response.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

namespace airworthy {
namespace {

using Complex = std::complex<double>;
using Response = SensorResponse<double>;

Complex complex(Phasor<double> p) { return {p.re, p.im}; }

// Mean of e^{jωt} over a window around t = 0, by Simpson's rule.
Complex average_by_quadrature(double speed_rad_s, double window_s) {
  constexpr int kIntervals = 2000;
  const double step_s = window_s / kIntervals;
  Complex sum = 0.0;
  for (int i = 0; i <= kIntervals; ++i) {
    const double weight = i == 0 || i == kIntervals ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
    sum += weight * std::polar(1.0, speed_rad_s * (i * step_s - 0.5 * window_s));
  }
  return sum / (3.0 * kIntervals);
}

/// A vibration e^{jωt}, its real part along x and its imaginary part along y, through the filter of the samples.
Complex brute_force(Response& response, double speed_rad_s, double dt_s, double window_s) {
  const Complex averaged = window_s > 0.0 ? average_by_quadrature(speed_rad_s, window_s) : Complex{1.0};
  Complex out;
  Complex in;
  for (int k = 0; k < 4000; ++k) {
    in = std::polar(1.0, speed_rad_s * dt_s * k);
    const Complex sample = averaged * in;
    const auto filtered = response.high_pass({sample.real(), sample.imag()}, dt_s);
    out = {filtered[0], filtered[1]};
  }
  return out / in;
}

TEST(SensorResponse, IsWhatTheSampledFilterDoesBeyondHalfTheSamplingRateToo) {
  for (const double dt_s : {0.0005, 0.002, 0.005, 0.01}) {
    for (const double high_pass_rad_s : {30.0, 75.0}) {
      for (double speed_Hz = 3.0; speed_Hz < 600.0; speed_Hz *= 1.17) {
        Response response{high_pass_rad_s, 0.0};
        const double speed_rad_s = 2.0 * std::numbers::pi * speed_Hz;
        const Complex expected = brute_force(response, speed_rad_s, dt_s, 0.0);
        const Complex got = complex(response.at(speed_rad_s, dt_s, 0.0));
        ASSERT_NEAR(std::abs(got - expected), 0.0, 1e-8) << speed_Hz << " Hz at " << dt_s << " s";
      }
    }
  }
}

TEST(SensorResponse, AveragesAsTheIntegralDoes) {
  const double window_s = 0.005;
  for (double speed_Hz = 1.0; speed_Hz < 600.0; speed_Hz *= 1.1) {
    Response response{75.0, 0.0};
    const double speed_rad_s = 2.0 * std::numbers::pi * speed_Hz;
    const Complex expected = brute_force(response, speed_rad_s, window_s, window_s);
    ASSERT_NEAR(std::abs(complex(response.at(speed_rad_s, window_s, window_s)) - expected), 0.0, 1e-8)
        << speed_Hz;
  }
}

TEST(SensorResponse, TheAverageIsSmoothWhereItsFormulaChanges) {
  const Response response{0.0, 0.0};
  for (double half = 1e-6; half < 1.0; half *= 1.05) {
    ASSERT_NEAR(response.sensor(2.0 * half, 1.0).re, std::sin(half) / half, 1e-9) << half;
    ASSERT_EQ(response.sensor(2.0 * half, 1.0).im, 0.0);
  }
  EXPECT_EQ(response.sensor(0.0, 0.005).re, 1.0);
}

TEST(SensorResponse, TheAverageTurnsTheVibrationRoundBeyondItsFirstZero) {
  const Response response{0.0, 0.0};
  EXPECT_LT(response.sensor(2.0 * std::numbers::pi * 242.0, 0.005).re, -0.1);
  EXPECT_NEAR(response.sensor(2.0 * std::numbers::pi * 200.0, 0.005).re, 0.0, 1e-12);
}

TEST(SensorResponse, LowPassIsButterworthsOfSecondOrder) {
  const Response response{0.0, 180.0};
  for (double ratio = 0.01; ratio < 10.0; ratio *= 1.3) {
    const Complex got = complex(response.sensor(2.0 * std::numbers::pi * 180.0 * ratio, 0.0));
    EXPECT_NEAR(std::norm(got), 1.0 / (1.0 + std::pow(ratio, 4)), 1e-12) << ratio;
    EXPECT_LT(got.imag(), 0.0);  // it lags
  }
  EXPECT_NEAR(std::arg(complex(response.sensor(2.0 * std::numbers::pi * 180.0, 0.0))),
              -0.5 * std::numbers::pi, 1e-12);
}

TEST(SensorResponse, EachPartMultipliesTheOthers) {
  Response all{75.0, 180.0};
  Response high_pass{75.0, 0.0};
  (void)all.high_pass({0.0, 0.0}, 0.002);
  (void)high_pass.high_pass({0.0, 0.0}, 0.002);
  for (const double speed_rad_s : {20.0, 500.0, 1520.0}) {
    const Complex expected = complex(high_pass.at(speed_rad_s, 0.002, 0.0)) *
                             complex(Response{0.0, 180.0}.sensor(speed_rad_s, 0.0)) *
                             average_by_quadrature(speed_rad_s, 0.003);
    EXPECT_NEAR(std::abs(complex(all.at(speed_rad_s, 0.002, 0.003)) - expected), 0.0, 1e-10) << speed_rad_s;
  }
}

TEST(SensorResponse, RestartsAsIfTheSampleHadAlwaysBeen) {
  Response response{75.0, 0.0};
  (void)response.high_pass({5.0, -3.0}, 0.002);
  response.restart({9.0, 2.0});
  for (int i = 0; i < 5; ++i) {
    const auto out = response.high_pass({9.0, 2.0}, 0.002);
    EXPECT_EQ(out[0], 0.0);
    EXPECT_EQ(out[1], 0.0);
  }
}

TEST(SensorResponse, ARotorThatStandsShakesNothing) {
  Response response{75.0, 180.0};
  (void)response.high_pass({0.0, 0.0}, 0.002);
  EXPECT_EQ(response.at(0.0, 0.002, 0.005).magnitude(), 0.0);
}

}  // namespace
}  // namespace airworthy
