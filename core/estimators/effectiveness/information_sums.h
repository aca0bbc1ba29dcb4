#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace airworthy {

/// What white innovations say about parameters that act on them linearly.
///   Model        e = Σ θₚ·hₚ + v,  v ~ N(0, S)                                                        (1)
///   Information  M = Σ h·hᵀ/S,  c = Σ h·e/S;  log-likelihood of θ over θ = 0: cᵀθ − ½·θᵀMθ                (2)
///   Outliers     e is clipped at 3√S, so that no single moment decides (Huber)                              (3)
/// Only the lower triangle of M is kept. Cost of a sample with n parameters: n·(n + 3) flops; no heap.
template <class Scalar, std::size_t kMost>
struct InformationSums {
  std::array<std::array<Scalar, kMost>, kMost> matrix{};
  std::array<Scalar, kMost> vector{};

  void add(const std::array<Scalar, kMost>& h, std::size_t n, Scalar innovation, Scalar variance) noexcept {
    const Scalar most = Scalar{3} * std::sqrt(variance);
    innovation = std::clamp(innovation, -most, most);  // (3)
    for (std::size_t i = 0; i < n; ++i) {
      const Scalar weighted = h[i] / variance;
      vector[i] += weighted * innovation;
      for (std::size_t j = 0; j <= i; ++j) matrix[i][j] += weighted * h[j];
    }
  }

  /// Old samples count less.
  void fade(Scalar keep, std::size_t n) noexcept {
    for (std::size_t i = 0; i < n; ++i) {
      vector[i] *= keep;
      for (std::size_t j = 0; j <= i; ++j) matrix[i][j] *= keep;
    }
  }

  [[nodiscard]] Scalar at(std::size_t i, std::size_t j) const noexcept {
    return i >= j ? matrix[i][j] : matrix[j][i];
  }
};

}  // namespace airworthy
