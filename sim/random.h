#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string_view>

namespace airworthy::sim {

/// A reproducible stream of random numbers. Streams with different names are independent, so that one more
/// noise source changes nothing for the others. The engine is the standard's, the transformations are ours,
/// because those of the standard library differ between implementations.
class Random {
 public:
  Random(std::uint64_t seed, std::string_view name, std::uint64_t index = 0)
      : engine_{mix(mix(seed ^ hash(name)) + index)} {}

  /// In [0, 1).
  [[nodiscard]] double uniform() { return static_cast<double>(engine_() >> 11U) * 0x1.0p-53; }
  [[nodiscard]] double uniform(double from, double to) { return from + (to - from) * uniform(); }
  [[nodiscard]] bool chance(double probability) { return uniform() < probability; }

  /// Standard normal, by Box and Muller.
  [[nodiscard]] double normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    const double angle = 2.0 * std::numbers::pi * uniform();
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
  }
  [[nodiscard]] Eigen::Vector3d normal3() {
    const double x = normal();
    const double y = normal();
    return {x, y, normal()};
  }

 private:
  // splitmix64
  static std::uint64_t mix(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15;
    x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9;
    x = (x ^ (x >> 27U)) * 0x94d049bb133111eb;
    return x ^ (x >> 31U);
  }
  // FNV-1a
  static std::uint64_t hash(std::string_view name) {
    std::uint64_t value = 0xcbf29ce484222325;
    for (const char c : name) value = (value ^ static_cast<unsigned char>(c)) * 0x100000001b3;
    return value;
  }

  std::mt19937_64 engine_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

/// First-order Gauss-Markov process with the given standard deviation and correlation time; starts stationary.
class GaussMarkov {
 public:
  GaussMarkov(double sigma, double correlation_time_s, Random random)
      : sigma_{sigma},
        correlation_time_s_{correlation_time_s},
        random_{random},
        value_{sigma * random_.normal()} {}

  double step(double dt_s) {
    const double decay = std::exp(-dt_s / correlation_time_s_);
    value_ = decay * value_ + sigma_ * std::sqrt(1.0 - decay * decay) * random_.normal();
    return value_;
  }
  [[nodiscard]] double value() const { return value_; }

 private:
  double sigma_;
  double correlation_time_s_;
  Random random_;
  double value_;
};

}  // namespace airworthy::sim
